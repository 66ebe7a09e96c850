//! A piece of the body on its way, and how far along a direction it may go: the bounds of [`advancement`](super::advancement).

use nalgebra::{Point3, Vector3};

use super::advancement::{PairSearch, PiecePair};
use super::fall::time_to_fall;
use super::motion::{Placement, RelativeMotion};
use crate::geometry::distance::closest_on_triangles;

/// A step in time that is safe along some direction, and the gap along it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SafeStep {
    pub(super) step: f64,
    pub(super) gap: f64,
    pub(super) direction: Vector3<f64>,
}

impl SafeStep {
    /// Where nothing is known along `direction`.
    pub(super) fn nowhere(direction: &Vector3<f64>) -> Self {
        Self {
            step: 0.0,
            gap: f64::NEG_INFINITY,
            direction: *direction,
        }
    }

    /// The longer step and the larger gap; `max` prefers any number to NaN.
    pub(super) fn or(self, other: Self) -> Self {
        Self {
            step: self.step.max(other.step),
            gap: self.gap.max(other.gap),
            ..self
        }
    }
}

/// The largest `n.y` over the corners of a piece, m.
#[inline(always)]
pub(super) fn support(n: &Vector3<f64>, [p, q, r]: &[Point3<f64>; 3]) -> f64 {
    n.dot(&p.coords).max(n.dot(&q.coords)).max(n.dot(&r.coords))
}

/// A piece of the body at one time, obstacle frame, with what bounds its path from there.
#[derive(Clone, Copy, Debug)]
pub(super) struct MovingPiece {
    pub(super) corners: [Point3<f64>; 3],
    pub(super) velocities: [Vector3<f64>; 3],
    /// Half of the accelerations.
    pub(super) bends: [Vector3<f64>; 3],
    /// `|w| |w x r_i| H / 6`, H the time that is left.
    remainders: [f64; 3],
    pub(super) spin: Vector3<f64>,
}

impl MovingPiece {
    #[inline]
    pub(super) fn at(
        motion: &RelativeMotion,
        placement: &Placement,
        on_body: &[Point3<f64>; 3],
        time_left: f64,
    ) -> Self {
        let cubic = motion.rate * time_left / 6.0;
        let mut moving = Self {
            corners: [Point3::origin(); 3],
            velocities: [Vector3::zeros(); 3],
            bends: [Vector3::zeros(); 3],
            remainders: [0.0; 3],
            spin: motion.spin,
        };
        // A plain loop: `map` on arrays is not always inlined.
        for (i, p) in on_body.iter().enumerate() {
            let corner = placement.point(p);
            let turn = motion.spin.cross(&(corner.coords - placement.center));
            moving.corners[i] = corner;
            moving.velocities[i] = motion.velocity + turn;
            moving.bends[i] = motion.spin.cross(&turn) * 0.5;
            moving.remainders[i] = turn.norm() * cubic;
        }
        moving
    }

    /// The longest of the safe steps along the closest points and the two face normals, the largest gap, and the first
    /// direction; the normals are not asked where the closest points allow all that is `wanted`.
    pub(super) fn best_step(
        &self,
        pair: &PiecePair,
        placement: &Placement,
        search: &PairSearch,
        wanted: f64,
    ) -> SafeStep {
        let gap_to_keep = search.gaps.stop;
        let closest = closest_on_triangles(&self.corners, &pair.on_obstacle);
        let along_points = (closest.on_first - closest.on_second) / closest.squared_distance.sqrt(); // NaN where they touch
        let along = |n: &Vector3<f64>| {
            let below = support(n, &pair.on_obstacle) + search.swept.round;
            self.safe_step(n, below, gap_to_keep)
        };
        let mut best = along(&along_points);
        // `max` prefers any number to NaN.
        best.step = best.step.max(0.0);
        if best.step >= wanted && best.gap >= gap_to_keep {
            return best;
        }
        best.or(along(&pair.obstacle_normal))
            .or(along(&-(placement.rotation * pair.body_normal)))
    }

    /// How far in time the piece may move so that it stays `gap_to_keep` above `below` along `direction`. NaN goes nowhere.
    #[inline]
    pub(super) fn safe_step(
        &self,
        direction: &Vector3<f64>,
        below: f64,
        gap_to_keep: f64,
    ) -> SafeStep {
        let sideways = direction.cross(&self.spin).norm();
        let mut step = f64::INFINITY;
        let mut gap = f64::INFINITY;
        for corner in 0..3 {
            let (along, speed, bend) = self.path(corner, direction, sideways);
            let height = along - below;
            gap = gap.min(height);
            step = step.min(time_to_fall(height - gap_to_keep, speed, bend));
        }
        if !below.is_finite() {
            return SafeStep::nowhere(direction);
        }
        SafeStep {
            step,
            gap,
            direction: *direction,
        }
    }

    /// Where a corner is along a direction, its speed, and the coefficient by which it may bend down.
    #[inline]
    pub(super) fn path(&self, corner: usize, n: &Vector3<f64>, sideways: f64) -> (f64, f64, f64) {
        (
            n.dot(&self.corners[corner].coords),
            n.dot(&self.velocities[corner]),
            self.remainders[corner] * sideways - n.dot(&self.bends[corner]),
        )
    }
}
