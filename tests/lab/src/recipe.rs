//! What a recipe is: a scene, a motion of the device, the right answer, and what passes.

use std::sync::OnceLock;

use god_object::{Pose, Vector6};
use taut_method_tests::checker::PenetrationChecker;

use crate::clock::{TICK, Tick};
use crate::measure::Measure;
use crate::method::{Method, Scene};
use crate::oracle;
use crate::reference::{self, Answer};

/// Error that a scene may spend at the 95th percentile, in just-noticeable differences, and share of the time above one of them.
pub(crate) const JND_BUDGET: f64 = 0.5;
pub(crate) const JND_SHARE: f64 = 0.01;

/// A limit for a measure, over all start phases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Of what.
    pub measure: Measure,
    /// Most that passes, in the measure's unit.
    pub limit: f64,
}

impl Measure {
    /// The line `self <= limit`.
    pub(crate) fn at_most(self, limit: f64) -> Line {
        let measure = self;
        Line { measure, limit }
    }
}

/// Lines at a rate of updates, Hz.
pub type Lines = Box<dyn Fn(u32) -> Vec<Line> + Send + Sync>;

/// A length at a time, s, of a body at a pose.
pub type OverTime = Box<dyn Fn(f64, &Pose) -> f64 + Send + Sync>;

/// A number of a whole run.
pub type OfRun = Box<dyn Fn(&[Tick]) -> f64 + Send + Sync>;

/// A pose at a time, s.
pub type Motion = Box<dyn Fn(f64) -> Pose + Send + Sync>;

/// A number of one recipe alone, with its own limit.
pub struct Probe {
    /// Name in tables and files.
    pub key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Of a whole run.
    pub value: OfRun,
    /// Most that passes at a rate of updates, Hz; infinite where it is only shown.
    pub limit: Box<dyn Fn(u32) -> f64 + Send + Sync>,
}

impl Probe {
    /// A number with the same limit at every rate.
    pub fn at_most(
        key: &'static str,
        unit: &'static str,
        limit: f64,
        value: impl Fn(&[Tick]) -> f64 + Send + Sync + 'static,
    ) -> Self {
        Self {
            key,
            unit,
            value: Box::new(value),
            limit: Box::new(move |_| limit),
        }
    }
}

/// Where the right answer comes from.
pub enum Ideal {
    /// A formula: the wrench of the exact quasi-static problem at a time, s, in N and N m.
    Closed(Box<dyn Fn(f64) -> Vector6 + Send + Sync>),
    /// A table of the independent [`crate::oracle`]'s.
    Oracle,
    /// A run of this project's method with fine steps, which says how far it is from its own limit: see `reference`.
    Reference,
    /// None: the recipe is judged by what must hold of any answer.
    None,
}

impl Ideal {
    /// A formula.
    pub fn closed(formula: impl Fn(f64) -> Vector6 + Send + Sync + 'static) -> Self {
        Self::Closed(Box::new(formula))
    }
}

/// This project's method, with its settings fitted and not.
pub(crate) const OURS: &[Method] = &[Method::Ours, Method::OursByDefault];

/// Why a force that ends may miss a line of what is felt.
pub(crate) const STANDS_ASIDE: &str = "the force ends up to an update after the right answer's; the port lets both down at the same rate, so they stay apart while they fall";

/// The same lines for each of these methods at each of these rates, Hz.
pub(crate) fn open_for(
    methods: &[Method],
    rates: &[u32],
    measures: &[Measure],
    reason: &'static str,
) -> Vec<Open> {
    let mut open = Vec::new();
    for key in measures.iter().map(|measure| measure.key()) {
        for method in methods.iter().copied() {
            open.extend(rates.iter().map(|&rate| Open {
                key,
                method,
                rate,
                reason,
            }));
        }
    }
    open
}

/// A pass line that this project's method does not keep, said openly: it is shown with its figure and is not a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Open {
    /// Which line or probe, by its key.
    pub key: &'static str,
    /// By which of this project's.
    pub method: Method,
    /// At this rate of updates, Hz.
    pub rate: u32,
    /// Why, as far as it is known.
    pub reason: &'static str,
}

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
    pub device: Motion,
    /// How long it takes, s.
    pub duration: f64,
    /// The right answer.
    pub ideal: Ideal,
    /// How deep the body at a pose is in an obstacle, m; 0 where it is free.
    pub depth: Box<dyn Fn(&Pose) -> f64 + Send + Sync>,
    /// How far the body at a time and a pose is beyond the side that it belongs to, m; 0 where it is on it.
    pub astray: OverTime,
    /// How many start phases of the updates are run, evenly over a period.
    pub phases: u32,
    /// What passes at a rate of updates, Hz.
    pub lines: Lines,
    /// Numbers of this recipe alone.
    pub probes: Vec<Probe>,
    /// Why a method has no part in it; `None` where it has.
    pub out_of_scope: fn(Method) -> Option<&'static str>,
    /// Where obstacle 0 is at a time, s; `None` where it stands still.
    pub moving: Option<Motion>,
    /// One published pose in so many is given to the independent check for intersections.
    pub check_every: u32,
    /// Lines that this project's method is known not to keep.
    pub open: Vec<Open>,
    /// Name and case of the recipe that does the same work, where its costs are another's.
    pub costs_as: Option<(&'static str, String)>,
    pub(crate) answer: OnceLock<Answer>,
    pub(crate) checker: OnceLock<PenetrationChecker>,
}

impl Recipe {
    /// A recipe without a right answer, lines or probes yet: the rest is filled in by struct update.
    pub fn new(
        (name, case): (&'static str, String),
        about: &'static str,
        scene: Scene,
        duration: f64,
        device: impl Fn(f64) -> Pose + Send + Sync + 'static,
    ) -> Self {
        Self {
            name,
            case,
            about,
            scene,
            device: Box::new(device),
            duration,
            ideal: Ideal::None,
            depth: Box::new(|_| 0.0),
            astray: Box::new(|_, _| 0.0),
            phases: 1,
            lines: Box::new(|_| Vec::new()),
            probes: Vec::new(),
            out_of_scope: |_| None,
            moving: None,
            check_every: 1,
            open: Vec::new(),
            costs_as: None,
            answer: OnceLock::new(),
            checker: OnceLock::new(),
        }
    }

    /// How many ticks it takes.
    pub fn ticks(&self) -> u32 {
        (self.duration / TICK).round() as u32 + 1
    }

    /// The right answer at every tick; a reference run is made, or read from its cache, on the first call,
    /// and a table is read.
    pub fn answer(&self) -> &Answer {
        self.answer.get_or_init(|| match &self.ideal {
            Ideal::Closed(formula) => {
                Answer::exact((0..self.ticks()).map(|tick| formula(f64::from(tick) * TICK)))
            }
            Ideal::Oracle => oracle::of(self),
            Ideal::Reference => reference::of(self),
            Ideal::None => Answer::exact(std::iter::empty()),
        })
    }

    /// What every recipe with a right answer asks of what is felt: half a just-noticeable difference at the 95th percentile, and
    /// above one at most a hundredth of the time.
    pub fn felt_lines(&self) -> Vec<Line> {
        if matches!(self.ideal, Ideal::None) {
            return Vec::new();
        }
        vec![
            Measure::JndP95.at_most(JND_BUDGET),
            Measure::JndShare.at_most(JND_SHARE),
        ]
    }

    /// The independent check for intersections, made on the first call.
    pub fn checker(&self) -> &PenetrationChecker {
        self.checker
            .get_or_init(|| PenetrationChecker::new(&self.scene.world))
    }
}

impl std::fmt::Debug for Recipe {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.name, self.case)
    }
}
