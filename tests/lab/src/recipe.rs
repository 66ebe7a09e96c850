//! What a recipe is.

use god_object::{Pose, Vector6};

use crate::measure::Measure;
use crate::method::Scene;

/// A limit for a measure, over all start phases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Of what.
    pub measure: Measure,
    /// Most that passes, in the measure's unit.
    pub limit: f64,
}

impl Line {
    /// `measure <= limit`.
    #[must_use]
    pub fn at_most(measure: Measure, limit: f64) -> Self {
        Self { measure, limit }
    }
}

/// A length at a time, s, of a body at a pose.
pub type OverTime = Box<dyn Fn(f64, &Pose) -> f64>;

/// A scene, a motion, the right answer and what passes.
pub struct Recipe {
    /// Short name, such as `R11`.
    pub name: &'static str,
    /// Which case of it.
    pub case: String,
    /// What it is about.
    pub about: &'static str,
    /// Body and obstacles.
    pub scene: Scene,
    /// Where the device is at a time, s.
    pub device: Box<dyn Fn(f64) -> Pose>,
    /// How long it takes, s.
    pub duration: f64,
    /// The force of the exact quasi-static problem at a time, N and N m.
    pub ideal: Box<dyn Fn(f64) -> Vector6>,
    /// How deep the body at a pose is in an obstacle, m; 0 where it is free.
    pub depth: Box<dyn Fn(&Pose) -> f64>,
    /// How far the body at a time and a pose is beyond the side that it belongs to, m; 0 where it is on it.
    pub astray: OverTime,
    /// How many start phases of the updates are run, evenly over a period.
    pub phases: u32,
    /// What passes at a rate of updates, Hz.
    pub lines: Box<dyn Fn(u32) -> Vec<Line>>,
}

impl std::fmt::Debug for Recipe {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.name, self.case)
    }
}
