//! Smooth motion through poses that come more slowly than the loop runs, and not evenly.
//!
//! | symbol | name in code | unit | meaning                                          |
//! |--------|--------------|------|--------------------------------------------------|
//! | h      | `interval`   | s    | smoothed time between two poses                  |
//!
//! A tracker that reports 100 times a second would move a body in steps of 10 ms, each a jump for a loop of 1 kHz.
//! When a pose arrives, the glide sets out from wherever it is to reach the pose one and a half intervals later, on a
//! straight line and by the shorter arc at constant rates; then it rests. The price is one and a half intervals of delay, and a pose that comes half an interval late stops nothing. The path
//! is continuous and its speed at most what the poses imply.

use std::time::Duration;

use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};
use taut_plant::stack;

use crate::device::Pose;

/// Weight of a new interval in the smoothed one.
const SMOOTHING: f64 = 0.1;
/// Intervals that are believed: no shorter than a tick of the loop, no longer than that of a slow tracker.
const INTERVALS_S: (f64, f64) = (1e-3, 0.1);
/// Intervals from the arrival of a pose to the glide's.
const LEG: f64 = 1.5;
/// The interval until two poses have come: that of a tracker of 60 Hz.
const FIRST_INTERVAL_S: f64 = 1.0 / 60.0;

/// A glide through poses. No allocation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Glide {
    from: Pose,
    to: Pose,
    /// Rotation vector from `from` to `to`, world axes.
    turn: Vector3<f64>,
    since: Duration,
    /// How long this leg takes, s.
    leg: f64,
    /// h.
    interval: f64,
    last_arrival: Option<Duration>,
}

impl Glide {
    pub(super) fn at_rest(pose: Pose) -> Self {
        Self {
            from: pose,
            to: pose,
            turn: Vector3::zeros(),
            since: Duration::ZERO,
            leg: FIRST_INTERVAL_S,
            interval: FIRST_INTERVAL_S,
            last_arrival: None,
        }
    }

    /// `pose` arrived at `now`; it is finite.
    pub(super) fn arrive(&mut self, now: Duration, pose: &Pose) {
        if let Some(last) = self.last_arrival.replace(now) {
            let passed = now.saturating_sub(last).as_secs_f64();
            let believed = passed.clamp(INTERVALS_S.0, INTERVALS_S.1);
            self.interval += SMOOTHING * (believed - self.interval);
        }
        self.from = self.at(now).0;
        self.to = *pose;
        self.turn = (pose.rotation * self.from.rotation.inverse()).scaled_axis();
        self.since = now;
        self.leg = LEG * self.interval;
    }

    /// Pose at `now`, and velocity of its origin (m/s) then angular velocity (rad/s), world axes.
    pub(super) fn at(&self, now: Duration) -> (Pose, Vector6<f64>) {
        let passed = now.saturating_sub(self.since).as_secs_f64();
        let is_under_way = passed < self.leg; // false for NaN: it rests
        if !is_under_way {
            return (self.to, Vector6::zeros());
        }
        let fraction = passed / self.leg;
        let travel = self.to.translation.vector - self.from.translation.vector;
        let position = self.from.translation.vector + travel * fraction;
        let rotation = UnitQuaternion::from_scaled_axis(self.turn * fraction) * self.from.rotation;
        let velocity = stack(&(travel / self.leg), &(self.turn / self.leg));
        (Isometry3::from_parts(position.into(), rotation), velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ms;
    use proptest::prelude::*;

    #[test]
    fn an_even_motion_comes_out_even_one_and_a_half_intervals_late() {
        let speed = 0.3;
        let pose_at = |t: f64| Pose::new(Vector3::x() * (speed * t), Vector3::z() * t);
        let mut glide = Glide::at_rest(pose_at(0.0));
        for now in 0..3000_u64 {
            if now % 10 == 0 {
                glide.arrive(ms(now), &pose_at(now as f64 * 1e-3));
            }
            if now > 2000 {
                let (pose, velocity) = glide.at(ms(now));
                let late = now as f64 * 1e-3 - pose.translation.vector.x / speed;
                assert!((late - 0.015).abs() < 3e-4, "{late}");
                assert!((velocity[0] - speed).abs() < 0.02 * speed);
                assert!((velocity[5] - 1.0).abs() < 0.02);
            }
        }
    }

    proptest! {
        /// However the poses come, each millisecond moves no farther than the velocity says, and the end is the last pose.
        #[test]
        fn the_path_is_continuous_and_arrives(
            arrivals in proptest::collection::vec((1_u64..60, -0.1..0.1_f64, -0.5..0.5_f64), 1..30),
        ) {
            let mut glide = Glide::at_rest(Pose::identity());
            let (mut now, mut last) = (0, glide.at(ms(0)).0);
            let mut target = Pose::identity();
            for (pause, x, angle) in arrivals {
                for _ in 0..pause {
                    now += 1;
                    let before = glide.at(ms(now - 1)).1;
                    let (pose, _) = glide.at(ms(now));
                    let step = (pose.translation.vector - last.translation.vector).norm();
                    prop_assert!(step <= before.fixed_rows::<3>(0).norm() * 1e-3 + 1e-12);
                    last = pose;
                }
                target = Pose::new(Vector3::x() * x, Vector3::y() * angle);
                glide.arrive(ms(now), &target);
                let (pose, _) = glide.at(ms(now));
                prop_assert!((pose.translation.vector - last.translation.vector).norm() < 1e-12, "no jump");
            }
            prop_assert_eq!(glide.at(ms(now + 200)), (target, Vector6::zeros()));
        }
    }
}
