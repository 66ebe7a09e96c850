//! The rotation between device and body as it pulls, past a half turn.
//!
//! | symbol | name in code | unit | meaning                                                        |
//! |--------|--------------|------|----------------------------------------------------------------|
//! | w      | `short`      | rad  | rotation vector of the shorter arc, at most pi                 |
//! | u      | `axis`       | –    | unit axis about which the device last passed the half turn     |
//!
//! Where the device turns past pi against a blocked body, w turns to its opposite, and the torque would jump by 2 pi K_r. The way
//! that the device went is kept instead: what w has along u pulls the other way, `w - 2 (w . u) u`. What it has across u pulls
//! as it is, or a body that comes free would tip over. Near the whole turn the pull goes over to the shorter arc, and the memory
//! ends: a whole turn is none. The pull is continuous throughout, and never longer than the shorter arc.
//! Beyond the paper, whose difference of rotations (Section 4.1) is the shorter arc.

use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, TAU};

use crate::spatial::{Pose, Vector6, rotation_vector, six};

/// A step across the half turn is known by the shorter arc turning to its opposite, when the way between is less than this, rad.
const LARGEST_STEP: f64 = FRAC_PI_2;
/// What is left to the whole turn where the shorter arc takes over, rad: more than a body's play between its stops, or one that stands
/// at the far stop would make a turn for it when it comes free.
const SHORT_WAY: f64 = 0.1;
/// What is left to the whole turn where the pull begins to go over, rad: its slope between is 1.4, beneath the 1.5 that a torque may
/// change by.
const LONG_WAY: f64 = 6.0 * SHORT_WAY;

/// Remembers the way past a half turn.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TurnMemory {
    /// The shorter arc of the last difference.
    last: Vector3<f64>,
    /// Between the half turn and the whole one.
    axis: Option<Vector3<f64>>,
}

impl TurnMemory {
    /// The difference `to - from` of two poses as it pulls: m, rad.
    #[inline]
    pub(crate) fn difference(&mut self, to: &Pose, from: &Pose) -> Vector6 {
        let turn = self.pull(&(to.rotation * from.rotation.inverse()));
        six(&(to.translation.vector - from.translation.vector), &turn)
    }

    #[inline]
    fn pull(&mut self, rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
        let short = rotation_vector(rotation);
        let last = std::mem::replace(&mut self.last, short);
        match self.axis {
            Some(axis) if short.dot(&axis) >= -SHORT_WAY => self.axis = None,
            Some(_) => {}
            None => {
                let (before, now) = (last.norm(), short.norm());
                let crossed = last.dot(&short) < 0.0 && before + now > TAU - LARGEST_STEP;
                self.axis = crossed.then(|| last / before);
            }
        }
        self.axis.map_or(short, |axis| {
            let left = -short.dot(&axis);
            short + axis * (left + kept(left))
        })
    }
}

/// The pull the way that the device went, `left` from the whole turn, rad.
fn kept(left: f64) -> f64 {
    if left >= LONG_WAY {
        left
    } else {
        (left - SHORT_WAY) * (LONG_WAY + SHORT_WAY) / (LONG_WAY - SHORT_WAY) - SHORT_WAY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn the_pull_is_continuous_through_half_and_whole_turns_and_back() {
        let steps = 4001;
        for (tilt, sense) in [(0.0, 1.0), (1e-3, 1.0), (0.0, -1.0)] {
            let mut memory = TurnMemory::default();
            let mut last: Option<Vector3<f64>> = None;
            let there = (0..=steps).chain((0..steps).rev());
            for (passed, i) in there.enumerate() {
                let angle = sense * 2.2 * TAU * f64::from(i) / f64::from(steps);
                let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * angle);
                let pull =
                    memory.pull(&(UnitQuaternion::from_scaled_axis(Vector3::x() * tilt) * turn));
                let step = 2.2 * TAU / f64::from(steps);
                assert!(pull.norm() < PI + 1e-9);
                if let Some(last) = last.replace(pull) {
                    assert!(
                        (pull - last).norm() < 1.5 * step + 2.0 * tilt,
                        "{angle} {pull} {last}"
                    );
                }
                if 3 * passed < steps as usize && tilt == 0.0 {
                    assert!(pull.z * sense >= 0.0);
                }
            }
        }
    }

    #[test]
    fn a_tilt_beyond_the_half_turn_is_taken_back() {
        let mut memory = TurnMemory::default();
        for degrees in 0..=300 {
            memory.pull(&UnitQuaternion::from_scaled_axis(
                Vector3::z() * f64::from(degrees).to_radians(),
            ));
        }
        let tilted = UnitQuaternion::from_scaled_axis(Vector3::x() * 0.1)
            * UnitQuaternion::from_scaled_axis(Vector3::z() * 300_f64.to_radians());
        let pull = memory.pull(&tilted);
        assert!(pull.x > 0.05, "towards the device's tilt: {pull}");
        assert!(pull.z > 0.9, "the way that the device went: {pull}");
    }

    #[test]
    fn a_leap_is_no_step_across_the_half_turn() {
        let mut memory = TurnMemory::default();
        memory.pull(&UnitQuaternion::from_scaled_axis(Vector3::z() * 1.5));
        let leapt = Vector3::z() * -2.0;
        let pull = memory.pull(&UnitQuaternion::from_scaled_axis(leapt));
        assert!((pull - leapt).norm() < 1e-12);
    }
}
