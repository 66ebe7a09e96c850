//! A scripted minimum-jerk path through via points: where a hand intends to go.
//!
//! | symbol | name in code | unit | meaning |
//! |--------|--------------|------|---------|
//! | tau    | `fraction`   | –    | time passed in a segment over its duration, in [0, 1] |
//! | s(tau) | `progress`   | –    | `10 tau^3 - 15 tau^4 + 6 tau^5`: from 0 to 1, at rest at both ends |
//!
//! Between two via points the reference point moves on a straight line and the rotation about one axis by
//! the shorter arc, both by s; the hand is at rest at every via point.
//!
//! Source: Flash & Hogan 1985, minimum-jerk model of reaching.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector6};

use crate::spatial::{Pose, is_finite, stack};

/// s at `fraction`, and ds/dtau; at rest outside [0, 1].
fn min_jerk(fraction: f64) -> (f64, f64) {
    let t = fraction.clamp(0.0, 1.0);
    let progress = t * t * t * (10.0 + t * (-15.0 + 6.0 * t));
    (progress, 30.0 * t * t * (1.0 - t) * (1.0 - t))
}

/// A pose to be passed, at rest, at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViaPoint {
    /// Seconds since the path began.
    pub time_s: f64,
    /// World from body, in the body's own frame.
    pub pose: Pose,
}

/// Why a list of via points is no path.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// No via point.
    #[error("the path has no via point; give at least one row")]
    Empty,
    /// A time or a pose that is not finite: which, from 0.
    #[error("via point {0} of the path is not finite; correct that row")]
    NotFinite(usize),
    /// A time that is not after the one before it: which, from 0.
    #[error("via point {0} of the path is not later than the one before it; sort the rows")]
    TimeNotIncreasing(usize),
    /// A path that loops must end where it starts.
    #[error(
        "the looping path ends {distance_m} m and {angle_rad} rad from its start; repeat the first pose as the last row"
    )]
    LoopDoesNotClose {
        /// Distance of the last position from the first, in m.
        distance_m: f64,
        /// Angle of the last rotation from the first, in rad.
        angle_rad: f64,
    },
}

/// A minimum-jerk path through via points. No allocation after `new`.
#[derive(Clone, Debug)]
pub struct MinJerkPath {
    via_points: Vec<ViaPoint>,
    looping: bool,
}

impl MinJerkPath {
    /// How far a looping path may be from closing, in m and rad: rounding of a written file.
    const LOOP_TOLERANCE: f64 = 1e-6;

    /// A path through `via_points`; holds its last pose at the end, or starts again if `looping`.
    ///
    /// # Errors
    /// [`PathError`] names the first via point that is wrong.
    pub fn new(via_points: Vec<ViaPoint>, looping: bool) -> Result<Self, PathError> {
        let (Some(first), Some(last)) = (via_points.first(), via_points.last()) else {
            return Err(PathError::Empty);
        };
        for (index, point) in via_points.iter().enumerate() {
            if !(point.time_s.is_finite() && is_finite(&point.pose)) {
                return Err(PathError::NotFinite(index));
            }
            if index > 0 && point.time_s <= via_points[index - 1].time_s {
                return Err(PathError::TimeNotIncreasing(index));
            }
        }
        if looping {
            let distance_m = (last.pose.translation.vector - first.pose.translation.vector).norm();
            let angle_rad = last.pose.rotation.angle_to(&first.pose.rotation);
            if distance_m > Self::LOOP_TOLERANCE || angle_rad > Self::LOOP_TOLERANCE {
                return Err(PathError::LoopDoesNotClose {
                    distance_m,
                    angle_rad,
                });
            }
        }
        Ok(Self {
            via_points,
            looping,
        })
    }

    /// Stays at `pose` for ever.
    #[must_use]
    pub fn hold(pose: Pose) -> Self {
        Self {
            via_points: vec![ViaPoint { time_s: 0.0, pose }],
            looping: false,
        }
    }

    /// Sways for ever by `amplitude` (m) to either side of `pose` along world x, one cycle per `period_s`.
    #[must_use]
    pub fn sway(pose: Pose, amplitude: f64, period_s: f64) -> Self {
        let aside = |time_s: f64, offset: f64| ViaPoint {
            time_s,
            pose: Translation3::new(offset, 0.0, 0.0) * pose,
        };
        Self {
            via_points: vec![
                aside(0.0, 0.0),
                aside(0.25 * period_s, amplitude),
                aside(0.75 * period_s, -amplitude),
                aside(period_s, 0.0),
            ],
            looping: true,
        }
    }

    /// When the last via point is reached, in s.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.via_points.last().map_or(0.0, |point| point.time_s)
    }

    /// The same path with every pose mapped by `map`, such as to another point of the body.
    #[must_use]
    pub fn map(mut self, map: impl Fn(&Pose) -> Pose) -> Self {
        for point in &mut self.via_points {
            point.pose = map(&point.pose);
        }
        self
    }

    /// Pose and velocity (m/s, rad/s, world axes) at `time_s` since the path began.
    #[must_use]
    pub fn at(&self, time_s: f64) -> (Pose, Vector6<f64>) {
        let (first, last) = (
            &self.via_points[0],
            &self.via_points[self.via_points.len() - 1],
        );
        let period = last.time_s - first.time_s;
        let time = if self.looping && period > 0.0 {
            first.time_s + (time_s - first.time_s).rem_euclid(period)
        } else {
            time_s
        };

        // The first via point that lies after `time` ends the segment.
        let next = self
            .via_points
            .partition_point(|point| point.time_s <= time);
        if next == 0 {
            return (first.pose, Vector6::zeros());
        }
        let Some(to) = self.via_points.get(next) else {
            return (last.pose, Vector6::zeros());
        };
        between(&self.via_points[next - 1], to, time)
    }
}

/// Pose and velocity at `time` on the movement `from` -> `to`.
fn between(from: &ViaPoint, to: &ViaPoint, time: f64) -> (Pose, Vector6<f64>) {
    let duration = to.time_s - from.time_s;
    let (progress, rate) = min_jerk((time - from.time_s) / duration);
    let travel = to.pose.translation.vector - from.pose.translation.vector;
    let turn = (to.pose.rotation * from.pose.rotation.inverse()).scaled_axis();

    let position = from.pose.translation.vector + travel * progress;
    let rotation = UnitQuaternion::from_scaled_axis(turn * progress) * from.pose.rotation;
    let rate = rate / duration;
    let velocity = stack(&(travel * rate), &(turn * rate));
    (Isometry3::from_parts(position.into(), rotation), velocity)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn pose(x: f64, y: f64, angle: f64) -> Pose {
        Pose::new(Vector3::new(x, y, 0.0), Vector3::z() * angle)
    }

    fn reach() -> MinJerkPath {
        let via_points = vec![
            ViaPoint {
                time_s: 1.0,
                pose: pose(0.0, 0.0, 0.0),
            },
            ViaPoint {
                time_s: 3.0,
                pose: pose(0.2, -0.1, 1.0),
            },
        ];
        MinJerkPath::new(via_points, false).expect("a valid path")
    }

    #[test]
    fn the_profile_is_the_closed_form_and_rests_at_both_ends() {
        for end in [0.0, 1.0] {
            assert_eq!(min_jerk(end), (end, 0.0));
        }
        // Half way: half the travel at 15/8 of the mean speed.
        assert_eq!(min_jerk(0.5), (0.5, 1.875));
        assert!((min_jerk(0.25).0 - 0.103_515_625).abs() < 1e-15);
    }

    #[test]
    fn the_rate_is_the_derivative_of_the_profile() {
        let step = 1e-5;
        for fraction in [0.1, 0.3, 0.77] {
            let (before, after) = (min_jerk(fraction - step), min_jerk(fraction + step));
            let rate = (after.0 - before.0) / (2.0 * step);
            assert!((rate - min_jerk(fraction).1).abs() < 1e-8);
        }
    }

    #[test]
    fn position_and_rotation_share_one_profile() {
        let (middle, velocity) = reach().at(2.0);
        assert!((middle.translation.vector - Vector3::new(0.1, -0.05, 0.0)).norm() < 1e-15);
        assert!((middle.rotation.angle() - 0.5).abs() < 1e-12);
        assert!((velocity[0] - 0.2 / 2.0 * 1.875).abs() < 1e-12);
        assert!((velocity[5] - 1.0 / 2.0 * 1.875).abs() < 1e-12);
    }

    #[test]
    fn the_path_rests_before_its_start_and_after_its_end() {
        let path = reach();
        assert_eq!(path.at(-5.0), (pose(0.0, 0.0, 0.0), Vector6::zeros()));
        let (end, velocity) = path.at(100.0);
        assert_eq!(velocity, Vector6::zeros());
        assert!((end.translation.vector.x - 0.2).abs() < 1e-15);
    }

    #[test]
    fn a_looping_path_repeats_and_must_close() {
        let sway = MinJerkPath::sway(pose(0.3, 0.0, 0.2), 0.02, 4.0);
        let (early, _) = sway.at(0.7);
        let (late, _) = sway.at(0.7 + 3.0 * 4.0);
        assert!((early.translation.vector - late.translation.vector).norm() < 1e-12);
        assert!((sway.at(1.0).0.translation.vector.x - 0.32).abs() < 1e-12);

        let open = vec![
            ViaPoint {
                time_s: 0.0,
                pose: pose(0.0, 0.0, 0.0),
            },
            ViaPoint {
                time_s: 1.0,
                pose: pose(0.5, 0.0, 0.0),
            },
        ];
        assert!(matches!(
            MinJerkPath::new(open, true),
            Err(PathError::LoopDoesNotClose { distance_m, .. }) if distance_m == 0.5
        ));
    }

    #[test]
    fn bad_via_points_are_named() {
        assert!(matches!(
            MinJerkPath::new(vec![], false),
            Err(PathError::Empty)
        ));
        let at = |time_s, x| ViaPoint {
            time_s,
            pose: pose(x, 0.0, 0.0),
        };
        assert!(matches!(
            MinJerkPath::new(vec![at(0.0, 0.0), at(0.0, 1.0)], false),
            Err(PathError::TimeNotIncreasing(1))
        ));
        assert!(matches!(
            MinJerkPath::new(vec![at(0.0, 0.0), at(1.0, f64::NAN)], false),
            Err(PathError::NotFinite(1))
        ));
    }
}
