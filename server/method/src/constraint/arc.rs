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

use super::facing::{Facing, NORMAL_CONE_TOLERANCE, Pair};

/// An arc is left by less than this, as the sine of an angle, for the tolerance of the cones and for rounding.
const ARC_TOLERANCE: f64 = 2.0 * NORMAL_CONE_TOLERANCE;

/// An edge that a triangle owns, obstacle frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    /// Which side of the triangle it is.
    pub(super) side: usize,
    along: Vector3<f64>,
    normals: [Vector3<f64>; 2],
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

impl Facing<'_> {
    /// Side `i` of the body's triangle, which owns it.
    #[inline]
    pub(super) fn arc_of_body(&self, pair: &Pair, i: usize) -> Arc {
        let [left, right] = self.body.edges()[self.body.triangle_edges(pair.a)[i] as usize].faces;
        Arc {
            side: i,
            along: pair.x[(i + 1) % 3] - pair.x[i],
            normals: [left, right].map(|t| self.placement.rotation * self.body.face_normal(t)),
        }
    }

    /// Side `j` of the obstacle's triangle, which owns it.
    #[inline]
    pub(super) fn arc_of_obstacle(&self, pair: &Pair, j: usize) -> Arc {
        let edge = self.obstacle.triangle_edges(pair.b)[j];
        let [left, right] = self.obstacle.edges()[edge as usize].faces;
        Arc {
            side: j,
            along: pair.y[(j + 1) % 3] - pair.y[j],
            normals: [left, right].map(|t| *self.obstacle.face_normal(t)),
        }
    }
}
