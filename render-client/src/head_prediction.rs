//! Where the viewer's head will be when a picture reaches the eye.
//!
//! | symbol | name in code       | unit   | meaning                                                  |
//! |--------|--------------------|--------|----------------------------------------------------------|
//! | X(t)   | `pose`             | –      | head in the workbench frame                              |
//! | ξ      | `twist`            | m, rad | body twist: per baseline in the estimate, as a screw     |
//! | b      | `baseline`         | ns     | time between the two samples that the twist is taken from |
//! | h      | `horizon`          | ns     | from the newest sample to the time asked for             |
//!
//! X(t₁ + h) = X(t₁) · exp(ξ h / b) with ξ = log(X(t₁ − b)⁻¹ X(t₁)): exact for a head that moves along
//! one screw. For a sway A sin ωt it is off by at most A ω² h (b + h) / 2.
//!
//! Only the head is predicted. The god-object and the bodies rest on surfaces, and one step further
//! along their last motion they would be drawn inside one.
//!
//! Source: Murray, Li, Sastry 1994, "A Mathematical Introduction to Robotic Manipulation", §2.3 and
//! appendix A (exponential and logarithm of a screw motion).

use std::collections::VecDeque;

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use crate::timeline::Head;

/// Farthest that a head is predicted, in nanoseconds. Trackers and displays lag by less, and past it an error
/// in the twist shows more than the lag does.
pub const MAX_HORIZON_NS: u64 = 30_000_000;

/// The twist is taken over this time, in nanoseconds, or the longest shorter one there is: two to four
/// reports of a common tracker. Longer would lag behind, shorter would amplify the tracker's noise.
const BASELINE_NS: u64 = 40_000_000;

/// A shorter baseline, in nanoseconds, says nothing about a twist.
const LEAST_BASELINE_NS: u64 = 4_000_000;

/// A tracker that has repeated its report for this long, in nanoseconds, says that the head rests.
const REST_AFTER_NS: u64 = 50_000_000;

/// Faster is a jump of the tracker, in metres per second: nobody's head is.
const MAX_SPEED: f64 = 4.0;

/// The same for a turn, in radians per second.
const MAX_TURN_RATE: f64 = 15.0;

/// Most samples kept: the baseline at 1 kHz, and some.
const CAPACITY: usize = 64;

/// Samples of the head, oldest first, and what follows from them.
#[derive(Clone, Debug, Default)]
pub struct HeadPredictor {
    samples: VecDeque<Sample>,
}

/// One report of the tracker.
#[derive(Clone, Copy, Debug)]
struct Sample {
    head: Head,
    /// When it was first said, session time in nanoseconds.
    first_ns: u64,
    /// When it was still said.
    last_ns: u64,
}

impl Sample {
    /// Whether it is the same report, whenever it was sent.
    fn says(&self, head: &Head) -> bool {
        self.head.pose == head.pose && self.head.eye_separation == head.eye_separation
    }
}

impl HeadPredictor {
    /// Takes a sample in, with its own time (session time in nanoseconds).
    ///
    /// `None` is an untracked head: nothing of before it is used again. Samples that are not newer
    /// than the newest are dropped; one with the same pose is the same report of the tracker,
    /// sent once more.
    pub fn push(&mut self, sample_ns: u64, head: Option<&Head>) {
        let newest = self.samples.back_mut();
        if newest.as_ref().is_some_and(|s| sample_ns <= s.last_ns) {
            return;
        }
        let Some(head) = head else {
            self.samples.clear();
            return;
        };
        if let Some(same) = newest.filter(|s| s.says(head)) {
            same.last_ns = sample_ns;
            return;
        }
        if self.samples.len() == CAPACITY {
            self.samples.pop_front();
        }
        self.samples.push_back(Sample {
            head: *head,
            first_ns: sample_ns,
            last_ns: sample_ns,
        });
    }

    /// The head at session time `at_ns`; `None` while it is not tracked.
    ///
    /// Never further than [`MAX_HORIZON_NS`] past the newest sample; a time before it gives the
    /// newest sample as it is. A head that rests, or whose tracker jumped, is not predicted.
    pub fn at(&self, at_ns: u64) -> Option<Head> {
        let newest = self.samples.back()?;
        let horizon = at_ns.saturating_sub(newest.first_ns).min(MAX_HORIZON_NS);
        let rests = newest.last_ns - newest.first_ns >= REST_AFTER_NS;
        let pose = match self.twist() {
            Some((twist, baseline)) if !rests => {
                newest.head.pose * exp(&twist, horizon as f64 / baseline as f64)
            }
            _ => newest.head.pose,
        };
        Some(Head {
            pose,
            ..newest.head
        })
    }

    /// Twist over a baseline (ns) before the newest sample; `None` where there is no believable one.
    fn twist(&self) -> Option<(Twist, u64)> {
        let newest = self.samples.back()?;
        let oldest_wanted = newest.first_ns.saturating_sub(BASELINE_NS);
        let from = self.samples.iter().find(|s| s.first_ns >= oldest_wanted)?;
        let baseline = newest.first_ns - from.first_ns;
        if baseline < LEAST_BASELINE_NS {
            return None;
        }
        let moved = from.head.pose.inv_mul(&newest.head.pose);
        let seconds = baseline as f64 * 1e-9;
        let believable = moved.translation.vector.norm() <= MAX_SPEED * seconds
            && moved.rotation.angle() <= MAX_TURN_RATE * seconds; // false for NaN
        believable.then(|| (log(&moved), baseline))
    }
}

/// A body twist over some time: (translation, rotation) of a screw motion.
#[derive(Clone, Copy, Debug)]
struct Twist {
    linear: Vector3<f64>,
    angular: Vector3<f64>,
}

/// The screw motion that `motion` is, at less than half a turn.
fn log(motion: &Isometry3<f64>) -> Twist {
    let angular = motion.rotation.scaled_axis();
    let v = left_jacobian(&angular);
    // Invertible for less than a full turn; a believable motion turns far less.
    let inverse = v.try_inverse().unwrap_or_else(Matrix3::identity);
    Twist {
        linear: inverse * motion.translation.vector,
        angular,
    }
}

/// `share` of the screw motion.
fn exp(twist: &Twist, share: f64) -> Isometry3<f64> {
    let angular = twist.angular * share;
    let linear = left_jacobian(&angular) * (twist.linear * share);
    Isometry3::from_parts(
        Translation3::from(linear),
        UnitQuaternion::from_scaled_axis(angular),
    )
}

/// V(ω) = I + (1 − cos θ)/θ² [ω]× + (θ − sin θ)/θ³ [ω]×², with θ = |ω|.
fn left_jacobian(angular: &Vector3<f64>) -> Matrix3<f64> {
    let square = angular.norm_squared();
    let cross = angular.cross_matrix();
    let (a, b) = if square < 1e-8 {
        // Two terms of the series: the next is below rounding.
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        let angle = square.sqrt();
        (
            (1.0 - angle.cos()) / square,
            (angle - angle.sin()) / (square * angle),
        )
    };
    Matrix3::identity() + cross * a + cross * cross * b
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    fn head(pose: Isometry3<f64>) -> Head {
        Head {
            pose,
            eye_separation: 0.064,
            sample_ns: 0,
        }
    }

    /// Farthest apart that the two put a point of the head: 0.1 m from its origin.
    fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
        let points = [
            Point3::origin(),
            Point3::new(0.1, 0.0, 0.0),
            Point3::new(0.0, 0.1, 0.0),
        ];
        let gaps = points.iter().map(|p| (a * p - b * p).norm());
        gaps.fold(0.0, f64::max)
    }

    /// A predictor that was told poses of a head after these gaps, and the time of the last one, ns.
    fn tracked(gaps: Vec<u64>, pose: impl Fn(u64) -> Isometry3<f64>) -> (HeadPredictor, u64) {
        let mut predictor = HeadPredictor::default();
        let mut now = 0;
        for gap in gaps {
            now += gap;
            predictor.push(now, Some(&head(pose(now))));
        }
        (predictor, now)
    }

    /// Gaps between samples of a tracker that is not regular, in nanoseconds.
    fn gaps() -> impl Strategy<Value = Vec<u64>> {
        proptest::collection::vec(200_000u64..20 * MS, 12..80)
    }

    proptest! {
        #[test]
        fn a_constant_twist_is_predicted_exactly(
            gaps in gaps(),
            linear in proptest::array::uniform3(-1.0..1.0f64),
            angular in proptest::array::uniform3(-3.0..3.0f64),
            ahead in 0u64..MAX_HORIZON_NS,
        ) {
            let twist = Twist { linear: linear.into(), angular: angular.into() };
            let start = Isometry3::new(Vector3::new(0.1, -1.1, 0.8), Vector3::new(1.2, 0.1, 0.0));
            let truth = |ns: u64| start * exp(&twist, ns as f64 * 1e-9);
            let (predictor, now) = tracked(gaps, truth);
            let found = predictor.at(now + ahead).expect("tracked").pose;
            prop_assert!(apart(&found, &truth(now + ahead)) < 1e-9);
        }

        #[test]
        fn the_error_of_a_sway_is_bounded_and_beats_the_newest_sample(
            gaps in gaps(),
            amplitude in 0.01..0.15f64, period in 0.8..8.0f64,
            ahead in 5 * MS..MAX_HORIZON_NS,
        ) {
            let omega = std::f64::consts::TAU / period;
            let truth = |ns: u64| {
                Isometry3::translation(amplitude * (omega * ns as f64 * 1e-9).sin(), 0.0, 0.0)
            };
            let (predictor, now) = tracked(gaps, truth);
            let found = predictor.at(now + ahead).expect("tracked").pose;
            let (h, b) = (ahead as f64 * 1e-9, BASELINE_NS as f64 * 1e-9);
            let bound = amplitude * omega * omega * h * (b + h) / 2.0;
            prop_assert!(apart(&found, &truth(now + ahead)) <= bound + 1e-12);
        }

        #[test]
        fn no_prediction_goes_past_the_cap(
            gaps in gaps(), speed in -3.0..3.0f64, ahead in MAX_HORIZON_NS..100_000 * MS,
        ) {
            let moves = |ns: u64| Isometry3::translation(speed * ns as f64 * 1e-9, 0.0, 0.0);
            let (predictor, now) = tracked(gaps, moves);
            let newest = predictor.at(now).expect("tracked").pose;
            let capped = predictor.at(now + MAX_HORIZON_NS).expect("tracked").pose;
            let later = predictor.at(now + ahead).expect("tracked").pose;
            prop_assert_eq!(later, capped);
            let moved = (capped.translation.x - newest.translation.x).abs();
            prop_assert!(moved <= speed.abs() * 0.030 + 1e-9);
        }

        #[test]
        fn whatever_comes_in_whatever_order_the_answer_is_near_the_newest_sample(
            samples in proptest::collection::vec((0u64..400, proptest::array::uniform3(-5.0..5.0f64), any::<bool>()), 1..60),
            ask in 0u64..500,
        ) {
            let mut predictor = HeadPredictor::default();
            let mut newest: Option<(u64, Option<Isometry3<f64>>)> = None;
            for (ms, place, tracked) in samples {
                let pose = Isometry3::new(place.into(), Vector3::from(place) * 0.3);
                predictor.push(ms * MS, tracked.then(|| head(pose)).as_ref());
                // An untracked head forgets everything, its own time as well.
                let known = newest.and_then(|(at, pose)| pose.map(|_| at));
                if known.is_none_or(|at| ms > at) {
                    newest = Some((ms, tracked.then_some(pose)));
                }
            }
            let found = predictor.at(ask * MS).map(|head| head.pose);
            let (_, expected) = newest.expect("at least one");
            prop_assert_eq!(found.is_some(), expected.is_some());
            if let (Some(found), Some(expected)) = (found, expected) {
                // At the largest believable speed over the cap, with the turn's own share.
                let reach = (MAX_SPEED + MAX_TURN_RATE * 0.1) * 0.030 * 1.2;
                prop_assert!(apart(&found, &expected) <= reach);
            }
        }
    }

    #[test]
    fn an_untracked_head_is_nowhere_and_its_past_is_forgotten() {
        let mut predictor = HeadPredictor::default();
        assert_eq!(predictor.at(0), None);
        for k in 0..20 {
            let pose = Isometry3::translation(k as f64 * 0.01, 0.0, 0.0);
            predictor.push(k * 10 * MS, Some(&head(pose)));
        }
        predictor.push(200 * MS, None);
        assert_eq!(predictor.at(210 * MS), None);
        let back = Isometry3::translation(0.5, 0.0, 0.0);
        predictor.push(210 * MS, Some(&head(back)));
        assert_eq!(predictor.at(230 * MS).map(|h| h.pose), Some(back));
    }

    #[test]
    fn a_head_that_comes_to_rest_is_drawn_where_it_rests() {
        // Reports at 60 Hz, each repeated at 1 kHz: first it moves, then it stands.
        let mut predictor = HeadPredictor::default();
        for ms in 0..500u64 {
            let reported = (ms / 16 * 16).min(240);
            let pose = Isometry3::translation(reported as f64 * 1e-3, 0.0, 0.0);
            predictor.push(ms * MS, Some(&head(pose)));
            let x = predictor.at(ms * MS).expect("tracked").pose.translation.x;
            if (64..240).contains(&ms) {
                // At 1 m/s a report of up to 16 ms ago is made up for.
                assert!((x - ms as f64 * 1e-3).abs() < 1e-3, "{ms}: {x}");
            }
            if ms >= 300 {
                assert_eq!(x, 0.240);
            }
        }
    }

    #[test]
    fn a_jump_of_the_tracker_is_not_carried_on() {
        let mut predictor = HeadPredictor::default();
        predictor.push(0, Some(&head(Isometry3::identity())));
        let there = Isometry3::translation(1.0, 0.0, 0.0);
        predictor.push(10 * MS, Some(&head(there)));
        assert_eq!(predictor.at(30 * MS).map(|h| h.pose), Some(there));
    }
}
