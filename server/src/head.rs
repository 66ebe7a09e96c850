//! The viewer's head: still, or swaying as people do who stand and look.
//!
//! | symbol | name in code | unit | meaning                                              |
//! |--------|--------------|------|------------------------------------------------------|
//! | A      | `amplitude`  | m    | largest displacement to either side                  |
//! | T      | `period`     | s    | time of one sway from side to side and back          |
//!
//! A pure function of session time, so that every reader at the same time sees the same head.

use std::f64::consts::TAU;
use std::time::Duration;

use god_object::nalgebra::Vector3;
use god_object::spatial::Pose;

/// Sway fore and aft takes this much longer than from side to side: the path does not repeat at once.
const FORE_AFT_PERIODS: f64 = 1.618;
/// Sway fore and aft is this share of that from side to side.
const FORE_AFT_SHARE: f64 = 0.5;

/// Where the viewer's head is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Head {
    /// The head at rest, workbench frame: between the eyes, x to the right ear, y up, -z ahead.
    pub rest: Pose,
    /// Distance between the pupils, m.
    pub eye_separation: f64,
    /// Simulated movement; `None` is a still head.
    pub sway: Option<Sway>,
}

/// Simulated movement of a head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sway {
    /// Largest displacement to either side, m.
    pub amplitude: f64,
    /// Time of one sway, s.
    pub period: f64,
}

impl Head {
    /// The head at session time `now`, workbench frame.
    pub fn pose(&self, now: Duration) -> Pose {
        let Some(sway) = self.sway else {
            return self.rest;
        };
        let turn = TAU * now.as_secs_f64() / sway.period;
        let in_head = Vector3::new(
            sway.amplitude * turn.sin(),
            0.0,
            sway.amplitude * FORE_AFT_SHARE * (turn / FORE_AFT_PERIODS).sin(),
        );
        self.rest * Pose::translation(in_head.x, in_head.y, in_head.z)
    }

    /// Whether its pose changes.
    pub fn moves(&self) -> bool {
        self.sway.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swaying_head_starts_at_rest_and_stays_within_its_amplitude() {
        let rest = Pose::new(Vector3::new(0.0, -0.6, 0.7), Vector3::x() * 0.8);
        let head = Head {
            rest,
            eye_separation: 0.064,
            sway: Some(Sway {
                amplitude: 0.05,
                period: 6.0,
            }),
        };
        assert_eq!(head.pose(Duration::ZERO), rest);
        let mut farthest: f64 = 0.0;
        for tick in 0..10_000 {
            let pose = head.pose(Duration::from_millis(tick));
            assert_eq!(pose.rotation, rest.rotation);
            let offset =
                rest.inverse_transform_vector(&(pose.translation.vector - rest.translation.vector));
            assert!(offset.y.abs() < 1e-12);
            farthest = farthest.max(offset.x.abs());
        }
        assert!((farthest - 0.05).abs() < 1e-4);
    }

    #[test]
    fn a_still_head_stays() {
        let head = Head {
            rest: Pose::identity(),
            eye_separation: 0.064,
            sway: None,
        };
        assert_eq!(head.pose(Duration::from_secs(3)), Pose::identity());
        assert!(!head.moves());
    }
}
