//! Where the foot of a point falls on a triangle and its sides.

use nalgebra::{Point3, Vector3};

use super::cones::NORMAL_CONE_TOLERANCE;

/// How far outside a face a foot may lie: per gap (rad), it covers the wedges over flat edges and then some; per side, rounding.
const FOOT_TOLERANCE_PER_GAP: f64 = NORMAL_CONE_TOLERANCE;
const FOOT_TOLERANCE_PER_SIDE: f64 = 1e-9;

/// Whether the foot of a point lies in the triangle, to tolerance.
#[inline]
pub(crate) fn is_over(
    p: &Point3<f64>,
    t: &[Point3<f64>; 3],
    normal: &Vector3<f64>,
    gap: f64,
) -> bool {
    (0..3).all(|k| {
        let side = t[(k + 1) % 3] - t[k];
        let inside = normal.cross(&side).dot(&(p - t[k]));
        inside >= 0.0 || {
            let length = side.norm();
            inside >= -length * (FOOT_TOLERANCE_PER_GAP * gap + FOOT_TOLERANCE_PER_SIDE * length)
        }
    })
}

/// How far past the nearer end of a side a place is, in sides; signed along it.
#[inline]
pub(super) fn past_end(at: f64) -> f64 {
    at - at.clamp(0.0, 1.0)
}

/// The foot of a point on a side and its fraction there, when it lies on the side.
#[inline]
pub(super) fn foot_on_side(
    p: &Point3<f64>,
    t: &[Point3<f64>; 3],
    side: usize,
) -> Option<(Point3<f64>, f64)> {
    let along = t[(side + 1) % 3] - t[side];
    let fraction = along.dot(&(p - t[side])) / along.norm_squared();
    (0.0..=1.0)
        .contains(&fraction)
        .then(|| (t[side] + along * fraction, fraction))
}

pub(super) fn at_corner(k: usize) -> [f64; 3] {
    let mut weights = [0.0; 3];
    weights[k] = 1.0;
    weights
}

pub(super) fn on_side(side: usize, fraction: f64) -> [f64; 3] {
    let mut weights = [0.0; 3];
    weights[side] = 1.0 - fraction;
    weights[(side + 1) % 3] = fraction;
    weights
}
