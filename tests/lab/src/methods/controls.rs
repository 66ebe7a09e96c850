//! Controls: methods that do not render anything. A recipe that one of them passes judges nothing.

use god_object::{Pose, Vector6};

use crate::method::{HapticMethod, Scene};

/// Largest random force along an axis, N, and torque about one, N m.
const FORCE: f64 = 1.0;
const TORQUE: f64 = 0.05;

/// A body that stays where it started, with a wrench that has nothing to do with the scene.
#[derive(Debug)]
pub(crate) struct Control {
    pose: Pose,
    /// State of the generator.
    random: Option<u64>,
}

impl Control {
    /// Never moves. With a seed another force and torque every millisecond, the same in every run; else none.
    pub(crate) fn new(scene: &Scene, random: Option<u64>) -> Self {
        Self {
            pose: scene.start,
            random,
        }
    }
}

impl HapticMethod for Control {
    fn update(&mut self, _time: f64, _device: &Pose) {}

    fn publish(&mut self, _time: f64) {}

    fn force(&mut self, _time: f64, _device: &Pose) -> Vector6 {
        let Some(state) = &mut self.random else {
            return Vector6::zeros();
        };
        Vector6::from_fn(|row, _| {
            let largest = if row < 3 { FORCE } else { TORQUE };
            largest * (2.0 * crate::costs::uniform(state) - 1.0)
        })
    }

    fn pose(&self) -> Pose {
        self.pose
    }
}
