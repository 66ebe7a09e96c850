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

use super::collect::for_bits;
use super::cones::LOOK_AHEAD_TILT;
use super::facing::{Facing, Pair};

/// An arc is left by less than this, as the sine of an angle, for the tolerance of the cones and for rounding.
const ARC_TOLERANCE: f64 = 2.0 * LOOK_AHEAD_TILT;

/// An edge that a triangle owns, obstacle frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
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
    /// The sides of the body's triangle that it owns, by their bits; what the others are is not said.
    #[inline]
    pub(super) fn arcs_of_body(&self, pair: &Pair, sides: u8) -> [Arc; 3] {
        let turned = |t: u32| self.placement.rotation * self.body.face_normal(t);
        let own = turned(pair.a);
        let mut arcs = [Arc {
            along: Vector3::zeros(),
            normals: [own; 2],
        }; 3];
        for_bits(sides, |i| {
            let edge = self.body.triangle_edges(pair.a)[i];
            arcs[i].along = pair.x[(i + 1) % 3] - pair.x[i];
            arcs[i].normals[1] = turned(self.body.edges()[edge as usize].faces[1]);
        });
        arcs
    }

    /// Side `j` of the obstacle's triangle, which owns it.
    #[inline]
    pub(super) fn arc_of_obstacle(&self, pair: &Pair, j: usize) -> Arc {
        let edge = self.obstacle.triangle_edges(pair.b)[j];
        // The first of an edge's faces is its owner.
        let other = self.obstacle.edges()[edge as usize].faces[1];
        Arc {
            along: pair.y[(j + 1) % 3] - pair.y[j],
            normals: [
                *self.obstacle.face_normal(pair.b),
                *self.obstacle.face_normal(other),
            ],
        }
    }
}
