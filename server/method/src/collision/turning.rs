//! A separating direction that turns: where the side of a cylinder lies on an edge, a corner or another cylinder, the ends of its axis are equally far along
//! the direction from the one to the other. Along one that stays, the end that comes down bounds the step, though the bodies come no nearer. Along
//! one that stays square to the axis, and to the edge, both ends and both of the edge's corners are as far as the contact.
//!
//! | symbol | name in code | unit  | meaning                                                        |
//! |--------|--------------|-------|----------------------------------------------------------------|
//! | n, o   | `n`, `spin`  | –, rad | unit direction, and its rotation over the motion: `n(h) = exp(o h) n` |
//! | p      | `p`          | m     | from a corner of the obstacle's piece to one of the body's        |
//! | f      |              | m     | `n.p`, the height of the one over the other                      |
//! | H      | `left`       | –     | the time that is left                                           |
//!
//! For any rotation of n the pieces stay apart while all f do. `f(h) >= f + f' h + f'' h^2 / 2 - M h^3 / 6` with the derivatives at the start,
//! and M a bound of the third, `|n'''||p| + 3 |n''||p'| + 3 |n'||p''| + |p'''|`: derivatives of n have the lengths `|o x n|`, `|o||o x n|` and
//! `|o|^2 |o x n|`, of p `|v + w x r|`, `|w||w x r|` and `|w|^2 |w x r|`, and p grows by no more than H times its speed.

use nalgebra::{Point3, Vector3};

use super::fall::time_to_fall;
use super::moving_piece::{MovingPiece, SafeStep};

/// A line whose part square to the other and to the direction is shorter than this, as its square, is parallel to the other.
const PARALLEL: f64 = 1e-9;

/// A piece on its way and one at rest.
pub(super) struct Turning<'a> {
    pub(super) moving: &'a MovingPiece,
    pub(super) still: &'a [Point3<f64>; 3],
    /// What does not turn of the body's motion, m.
    pub(super) velocity: &'a Vector3<f64>,
    /// Angle of it, rad.
    pub(super) rate: f64,
    pub(super) left: f64,
}

impl Turning<'_> {
    /// The rotation that keeps n square to a line of the body and to one of the other, if there is one; `None` where they are parallel.
    pub(super) fn spin(
        &self,
        n: &Vector3<f64>,
        of_body: &Vector3<f64>,
        still: Option<Vector3<f64>>,
    ) -> Option<Vector3<f64>> {
        let line = of_body.try_normalize(0.0)?;
        let tilt = n.dot(&self.moving.spin.cross(&line));
        let mut way = line - n * line.dot(n);
        if let Some(still) = still {
            let along = still.try_normalize(0.0)?;
            way -= along * way.dot(&along);
        }
        let share = way.dot(&line);
        (share > PARALLEL).then(|| n.cross(&way) * (-tilt / share))
    }

    /// How far in time the body's piece may move so that it stays `kept` above the other along n, which turns by `spin`.
    pub(super) fn safe_step(&self, n: &Vector3<f64>, spin: &Vector3<f64>, kept: f64) -> SafeStep {
        let first = spin.cross(n);
        let second = spin.cross(&first);
        let (rate, slant) = (spin.norm(), first.norm());
        let mut best = SafeStep {
            step: f64::INFINITY,
            gap: f64::INFINITY,
            direction: *n,
        };
        let mut finite = true;
        for corner in 0..3 {
            let (velocity, bend) = (self.moving.velocities[corner], self.moving.bends[corner]);
            let turn = (velocity - self.velocity).norm();
            let speed = self.velocity.norm() + turn;
            for y in self.still {
                let p = self.moving.corners[corner] - y;
                let height = n.dot(&p);
                let closing = first.dot(&p) + n.dot(&velocity);
                let curve = 0.5 * second.dot(&p) + first.dot(&velocity) + n.dot(&bend);
                let farthest = p.norm() + self.left * speed;
                let third = slant
                    * (rate * (rate * farthest + 3.0 * speed) + 3.0 * self.rate * turn)
                    + self.rate * self.rate * turn;
                let drop = third * self.left / 6.0 - curve;
                finite &= height.is_finite();
                best.gap = best.gap.min(height);
                best.step = best.step.min(time_to_fall(height - kept, closing, drop));
            }
        }
        if finite { best } else { SafeStep::nowhere(n) }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    use super::*;
    use crate::collision::motion::{Motion, RelativeMotion};
    use crate::spatial::{Pose, six};

    fn motion(path: Vector3<f64>, turn: Vector3<f64>) -> RelativeMotion {
        let start = Pose::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.2, 0.1, -0.3));
        let motion = Motion {
            start,
            displacement: six(&path, &turn),
            reference_point: Point3::origin(),
        };
        RelativeMotion::new(&motion, &Pose::identity())
    }

    fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
        [-size..size, -size..size, -size..size].prop_map(Vector3::from)
    }

    fn piece() -> impl Strategy<Value = [Point3<f64>; 3]> {
        [vector(0.1), vector(0.1), vector(0.1)].prop_map(|corners| corners.map(Point3::from))
    }

    proptest! {
        /// At any time of the step every corner is as high over every other as is promised, along the direction turned as far as it is by then.
        #[test]
        fn what_is_kept_along_a_direction_that_turns_is_kept_all_the_way(
            (path, turn, spin) in (vector(0.2), vector(1.5), vector(3.0)),
            (on_body, still, n) in (piece(), piece(), vector(1.0)),
        ) {
            prop_assume!(n.norm() > 0.1);
            let (motion, n) = (motion(path, turn), n.normalize());
            let placement = motion.at(0.0);
            let moving = MovingPiece::at(&motion, &placement, &on_body, 1.0);
            // Beyond the lowest corner, so that there is something to keep.
            let above = moving.corners.map(|x| n.dot(&x.coords)).into_iter().fold(f64::INFINITY, f64::min);
            let highest = still.map(|y| n.dot(&y.coords)).into_iter().fold(f64::NEG_INFINITY, f64::max);
            let still = still.map(|y| y + n * (above - highest - 0.02));
            let turning = Turning {
                moving: &moving,
                still: &still,
                velocity: &motion.velocity,
                rate: motion.rate,
                left: 1.0,
            };
            let kept = 0.01;
            let safe = turning.safe_step(&n, &spin, kept);
            prop_assert!((safe.gap - 0.02).abs() < 1e-12);
            prop_assert!(safe.step > 0.0);
            for k in 0..=50 {
                let time = safe.step.min(1.0) * f64::from(k) / 50.0;
                let (there, along) = (motion.at(time), Rotation3::new(spin * time) * n);
                for x in on_body.map(|p| there.point(&p)) {
                    for y in &still {
                        prop_assert!(along.dot(&(x - y)) >= kept - 1e-12, "{time}");
                    }
                }
            }
        }
    }

    /// A rod on an edge across it turns about that: nothing comes nearer, but the ends are a thousand gaps apart by the end of the motion.
    #[test]
    fn a_rod_that_tilts_over_an_edge_goes_all_the_way_in_one_step() {
        let (gap, length) = (1e-6, 0.05);
        let motion = motion(Vector3::zeros(), Vector3::x() * 0.02);
        let placement = motion.at(0.0);
        let n = Vector3::z();
        let middle = Point3::from(placement.center);
        let rod = [-length, length, length].map(|y| middle + Vector3::y() * y);
        let to_body = placement.inverse();
        let on_body = rod.map(|p| to_body.point(&p));
        let moving = MovingPiece::at(&motion, &placement, &on_body, 1.0);
        let edge = middle - n * gap;
        let still = [-0.01, 0.01, 0.01].map(|x| edge + Vector3::x() * x);
        let turning = Turning {
            moving: &moving,
            still: &still,
            velocity: &motion.velocity,
            rate: motion.rate,
            left: 1.0,
        };
        let kept = 0.1 * gap;
        let fixed = turning.safe_step(&n, &Vector3::zeros(), kept);
        assert!(fixed.step < 1e-3, "{fixed:?}");
        let spin = turning
            .spin(&n, &(rod[1] - rod[0]), Some(Vector3::x()))
            .expect("they cross");
        let turned = turning.safe_step(&n, &spin, kept);
        assert!(turned.step >= 1.0, "{turned:?}");
        assert!(
            turning
                .spin(&n, &Vector3::x(), Some(Vector3::x()))
                .is_none()
        );
    }
}
