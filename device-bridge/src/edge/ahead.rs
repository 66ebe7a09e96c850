//! Where the hand is by the time at which a constraint set is used: likely, and at most.
//!
//! | symbol | name in code | unit  | meaning                                                            |
//! |--------|--------------|-------|--------------------------------------------------------------------|
//! | d      | `way`        | s     | reading to first use of the set that answers it: [`way_around`]      |
//! | t      | `horizon`    | s     | reading to last use of the set in full, however the network pauses   |
//! | v      | `velocity`   | m/s   | of the body's fastest point at the reading                         |
//! | a      | `HAND_ACCELERATION` | m/s² | most that a hand adds                                        |
//!
//! The server cannot see the way down. It stamps each set, and a reading brings the stamp of the set in use back: what has passed since then is
//! the way down and the way up, whichever of the two is slow, and no second clock is in it.
//!
//! That is long enough but for what the delay grows meanwhile. A reading of time r is here at s and names the set made at m; what is made at s
//! arrives at s + D(s), D being the way down, so `s - r + D(s)` is asked for. The set was there at r: `m + D(m) ≤ r`, so that
//! `s - m ≥ s - r + D(m)`. What is missing is at most `D(s) - D(m) ≤ g (s - m)` of a delay that grows by g seconds each second: a share g
//! of the way. A delay that jumps is known one way around later.
//!
//! A half-space is a plane: off its pose by s, on a surface of curvature κ, it is wrong by `κ s² / 2` in depth and `κ s` in direction. So the
//! god-object is sent to where the hand will be, [`device_predicted`], which leaves of `s = v t` what the hand's acceleration makes of it.
//! And the set must hold every row within [`device_ahead`], `v t + a t² / 2`, or a surface would be felt only when the hand is through it.

use std::time::Duration;

use god_object::Pose;
use god_object::spatial::{advance_pose, at_reference_point, from_reference_point};
use nalgebra::{Point3, Vector6};

use crate::port::Command;

/// A hand in contact tasks changes its speed by no more than this: assumption, m/s².
const HAND_ACCELERATION: f64 = 5.0;
/// Periods from a set to the next one that arrives: three in a row may be lost.
const PERIODS: u32 = 4;
/// Ways beyond this are not compensated: the look-ahead would hold the whole scene, and no force rests on what was so long on its way.
const OLDEST: Duration = Duration::from_millis(250);

/// Time from a reading to the first use of the set that answers it.
///
/// `age` is that of the reading, by both clocks; `set_age` that of the set that was in use at the reading, on the server's clock. Where no set is, or one
/// that says nothing (it is younger than the reading, or too old to be felt), the way back counts as long as the way up.
#[must_use]
pub fn way_around(age: Duration, set_age: Option<Duration>) -> Duration {
    set_age
        .filter(|set| (age..=OLDEST).contains(set))
        .unwrap_or(2 * age.min(OLDEST))
}

/// How much farther than at its reading, m, the body may be while the set that answers it is felt in full: until the next sets are there, or, where the
/// network pauses, until it is [`Command::SET_FULL_UNTIL`] old.
///
/// `velocity` is that of the reference point, then the angular one; `radius` is the body's about that point, m; `way` is [`way_around`];
/// `period` is the time from set to set. Zero for what is not finite.
#[must_use]
pub fn device_ahead(velocity: &Vector6<f64>, radius: f64, way: Duration, period: Duration) -> f64 {
    let replaced = way.min(OLDEST) + PERIODS * period;
    let horizon = replaced.max(Command::SET_FULL_UNTIL).as_secs_f64();
    let speed = velocity.fixed_rows::<3>(0).norm() + radius * velocity.fixed_rows::<3>(3).norm();
    let ahead = speed * horizon + 0.5 * HAND_ACCELERATION * horizon * horizon;
    if ahead.is_finite() { ahead } else { 0.0 }
}

/// The pose (world from body) at which the hand will be when the set that answers the reading is first used: [`way_around`] and a period on, at the
/// reading's velocity.
///
/// `pose` itself where the velocity is not finite.
#[must_use]
pub fn device_predicted(
    pose: &Pose,
    velocity: &Vector6<f64>,
    reference_point: &Point3<f64>,
    way: Duration,
    period: Duration,
) -> Pose {
    if !velocity.iter().all(|x| x.is_finite()) {
        return *pose;
    }
    let horizon = (way.min(OLDEST) + period).as_secs_f64();
    let start = at_reference_point(pose, reference_point);
    let there = advance_pose(&start, &(velocity * horizon), 1.0);
    from_reference_point(&there, reference_point)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_steady_hand_is_where_it_is_predicted_and_nan_predicts_nothing() {
        let point = Point3::new(0.0, 0.0, 0.1);
        let pose = Pose::translation(0.3, 0.0, 0.0);
        let velocity = Vector6::new(0.2, 0.0, 0.0, 0.0, 0.0, 2.0);
        let there = device_predicted(&pose, &velocity, &point, 40 * MS, 10 * MS);
        assert!((there * point - Point3::new(0.31, 0.0, 0.1)).norm() < 1e-15);
        assert!((there.rotation.scaled_axis().z - 0.1).abs() < 1e-15);
        let broken = Vector6::repeat(f64::NAN);
        assert_eq!(device_predicted(&pose, &broken, &point, MS, MS), pose);
    }

    #[test]
    fn the_way_down_counts_as_the_set_says_and_what_says_nothing_is_no_way() {
        for (age, set_age, way) in [
            (2, Some(70), 70),
            (40, Some(42), 42),
            (20, None, 40),
            (20, Some(19), 40),
            (20, Some(251), 40),
            (4000, None, 500),
        ] {
            let came = way_around(age * MS, set_age.map(|age| age * MS));
            assert_eq!(came, way * MS, "{age} {set_age:?}");
        }
    }

    #[test]
    fn the_way_grows_with_speed_turn_and_delay_and_nan_is_none() {
        let still = Vector6::zeros();
        let moving = Vector6::new(0.3, 0.0, 0.0, 0.0, 2.0, 0.0);
        // However near the server is, a set may be the last one for 75 ms: 0.4 m/s, and 14 mm.
        let near = device_ahead(&moving, 0.05, Duration::ZERO, MS);
        assert!((near - (0.4 * 75e-3 + 2.5 * 75e-3 * 75e-3)).abs() < 1e-12);
        let far = device_ahead(&moving, 0.05, 150 * MS, MS);
        assert!(far > 2.0 * near && far > device_ahead(&still, 0.05, 150 * MS, MS));
        let longest = device_ahead(&moving, 0.05, 250 * MS, MS);
        assert_eq!(device_ahead(&moving, 0.05, 3600 * 1000 * MS, MS), longest);
        assert_eq!(device_ahead(&Vector6::repeat(f64::NAN), 0.05, MS, MS), 0.0);
    }
}
