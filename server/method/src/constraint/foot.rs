//! Where the foot of a point falls on a triangle and its sides.

use nalgebra::{Point3, Vector3};

use super::cones::NORMAL_CONE_TOLERANCE;

/// How far outside a face a foot may lie: per gap (rad), it covers the wedges over flat edges and then some; per side, rounding.
const FOOT_TOLERANCE_PER_GAP: f64 = NORMAL_CONE_TOLERANCE;
const FOOT_TOLERANCE_PER_SIDE: f64 = 1e-9;

/// Whether the foot of a point lies in the triangle, to tolerance.
#[inline]
pub(super) fn is_over(
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
