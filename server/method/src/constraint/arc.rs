//! The normals of an edge as an arc between those of its faces: two edges can touch only where their arcs cross.
//!
//! | symbol | name in code | unit | meaning                                                              |
//! |--------|--------------|------|----------------------------------------------------------------------|
//! | u      | `along`      | m    | the edge                                                             |
//! | m, m'  | `normals`    | –    | normals of its two faces                                             |
//!
//! The direction in which edges u and v separate is across both: n = +-(u x v) / |u x v|. It lies between m and m' only if v has one of
//! them on either side, since `n.(m x u) = +-(v.m) |u|^2 / |u x v|`, and so for the other edge. Four products instead of closest points.
//! Source: the test of Gauss arcs for edges of polyhedra, Gregorius 2013.

use nalgebra::Vector3;

use super::cones::LOOK_AHEAD_TILT;

/// An arc is left by less than this, as the sine of an angle, for the tolerance of the cones and for rounding.
const ARC_TOLERANCE: f64 = 2.0 * LOOK_AHEAD_TILT;

/// An edge that a triangle owns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    pub(super) along: Vector3<f64>,
    pub(super) normals: [Vector3<f64>; 2],
}

impl Arc {
    /// Whether the edges may face each other. True for NaN.
    #[inline]
    pub(super) fn may_cross(&self, other: &Self) -> bool {
        !(self.has_on_one_side(&other.normals) || other.has_on_one_side(&self.normals))
    }

    #[inline]
    fn has_on_one_side(&self, [m, n]: &[Vector3<f64>; 2]) -> bool {
        let (s, t) = (self.along.dot(m), self.along.dot(n));
        let least = (s * s).min(t * t);
        s * t > 0.0 && least > ARC_TOLERANCE * ARC_TOLERANCE * self.along.norm_squared()
    }
}
