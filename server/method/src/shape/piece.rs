//! Convex pieces: what the directional bound of conservative advancement needs of a triangle or a primitive.
//!
//! | symbol | name in code | unit | meaning                                                                          |
//! |--------|--------------|------|----------------------------------------------------------------------------------|
//! | x_i    | `points`     | m    | a point, the ends of an axis, or the corners of a triangle                       |
//! | rho    | `round`      | m    | radius of the ball swept over the points' hull: sphere and capsule               |
//! | R, a   | `disc`, `axis` | m, – | radius and axis of the disc swept along the axis: cylinder                     |
//!
//! The support of a piece along n is exact: `max_i n.x_i + rho + R |n x a|`.

use nalgebra::{Point3, Vector3};

use super::Primitive;
use super::primitive::unit_axis;
use crate::collision::Placement;

/// A convex piece of a body, in some frame. Points that are not used repeat the last.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) points: [Point3<f64>; 3],
    pub(super) count: usize,
    pub(super) round: f64,
    pub(super) disc: f64,
    pub(super) axis: Vector3<f64>,
    /// Outward normal of a triangle.
    pub(super) face: Option<Vector3<f64>>,
}

impl Piece {
    pub(super) fn triangle(points: [Point3<f64>; 3], normal: &Vector3<f64>) -> Self {
        Self {
            points,
            count: 3,
            round: 0.0,
            disc: 0.0,
            axis: Vector3::zeros(),
            face: Some(*normal),
        }
    }

    /// `None` for a half-space, which has no points.
    pub(super) fn of(primitive: &Primitive) -> Option<Self> {
        let piece = |[p, q]: [Point3<f64>; 2], count, round, disc, axis| Self {
            points: [p, q, q],
            count,
            round,
            disc,
            axis,
            face: None,
        };
        match primitive {
            Primitive::Sphere { center, radius } => {
                Some(piece([*center; 2], 1, *radius, 0.0, Vector3::zeros()))
            }
            Primitive::Capsule { ends, radius } => {
                Some(piece(*ends, 2, *radius, 0.0, Vector3::zeros()))
            }
            Primitive::Cylinder { ends, radius } => {
                Some(piece(*ends, 2, 0.0, *radius, unit_axis(ends)))
            }
            Primitive::Plane { .. } => None,
        }
    }

    /// The piece of a body at `placement`.
    pub(super) fn placed(&self, placement: &Placement) -> Self {
        Self {
            points: self.points.map(|p| placement.point(&p)),
            axis: placement.rotation * self.axis,
            face: self.face.map(|n| placement.rotation * n),
            ..*self
        }
    }

    /// The largest `n.x` over the piece, m.
    #[inline]
    pub(super) fn support(&self, n: &Vector3<f64>) -> f64 {
        let heights = self.points.map(|p| n.dot(&p.coords));
        let sideways = if self.disc > 0.0 {
            self.disc * n.cross(&self.axis).norm()
        } else {
            0.0
        };
        heights[0].max(heights[1]).max(heights[2]) + self.round + sideways
    }

    /// The point of the core (without the ball) that is farthest along `n`.
    #[inline]
    pub(super) fn farthest(&self, n: &Vector3<f64>) -> Point3<f64> {
        let mut best = self.points[0];
        for p in &self.points[1..self.count] {
            if n.dot(&(p - best)) > 0.0 {
                best = *p;
            }
        }
        if self.disc > 0.0 {
            let sideways = n - self.axis * self.axis.dot(n);
            let length = sideways.norm();
            if length > 0.0 {
                best += sideways * (self.disc / length);
            }
        }
        best
    }
}
