//! Boxes of a mesh against a primitive.
//!
//! The plane through the primitive's nearest point to the box's centre, across the line between them, has the convex primitive on one
//! side. The box is on the other while its centre's distance exceeds its extent along that line.

use nalgebra::{Matrix3, Point3, Vector3};

use super::Primitive;
use crate::collision::Placement;
use crate::geometry::Node;

/// Tests boxes of a mesh against a primitive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound<'a> {
    primitive: &'a Primitive,
    /// Primitive's frame from the mesh's.
    rotation: Matrix3<f64>,
    origin: Vector3<f64>,
    margin: f64,
}

impl<'a> Bound<'a> {
    /// With the mesh on the body or on the obstacle; `placement` is obstacle from body.
    pub(super) fn new(
        primitive: &'a Primitive,
        mesh_moves: bool,
        placement: &Placement,
        margin: f64,
    ) -> Self {
        let (rotation, origin) = if mesh_moves {
            (placement.rotation, placement.origin)
        } else {
            let back = placement.rotation.transpose();
            (back, -(back * placement.origin))
        };
        Self {
            primitive,
            rotation,
            origin,
            margin,
        }
    }

    /// Whether the box may come within the margin of the primitive. True for NaN.
    #[inline]
    pub(super) fn may_meet(&self, node: &Node) -> bool {
        let center = self.rotation * node.center.coords + self.origin;
        let nearest = self.primitive.nearest(&Point3::from(center));
        let in_mesh = self.rotation.tr_mul(&nearest.normal);
        let extent = in_mesh.x.abs() * node.half.x
            + in_mesh.y.abs() * node.half.y
            + in_mesh.z.abs() * node.half.z;
        let apart = nearest.distance > extent + self.margin; // false for NaN
        !apart
    }
}
