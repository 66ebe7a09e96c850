//! Boxes of a mesh against a primitive, over an interval of their relative motion.
//!
//! The plane through the primitive's nearest point to the box's centre, across the line between them, has the convex primitive on one
//! side. The box stays on the other while its centre's distance exceeds its extent along that line and all that the interval can add:
//! the first-order displacement of the centre along the line, what the corners turn more, and the second order.

use nalgebra::{Matrix3, Point3, Vector3};

use super::Primitive;
use crate::collision::{Placement, RelativeMotion};
use crate::geometry::{Mesh, Node};

/// Tests boxes of a mesh against a primitive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound<'a> {
    primitive: &'a Primitive,
    /// Primitive's frame from the mesh's, at the middle of the interval.
    rotation: Matrix3<f64>,
    origin: Vector3<f64>,
    /// G, d and w in half the interval, primitive's frame.
    center: Vector3<f64>,
    half_path: Vector3<f64>,
    half_turn: Vector3<f64>,
    path: f64,
    angle: f64,
    margin: f64,
}

impl<'a> Bound<'a> {
    /// Over `[from, to]`, with the mesh on the body or on the obstacle.
    pub(super) fn over(
        primitive: &'a Primitive,
        mesh_moves: bool,
        motion: &RelativeMotion,
        [from, to]: [f64; 2],
        margin: f64,
    ) -> Self {
        let half = 0.5 * (to - from);
        let placement = motion.at(0.5 * (from + to));
        let still = Self::still(primitive, mesh_moves, &placement, margin);
        let (half_path, half_turn) = (motion.velocity * half, motion.spin * half);
        // Obstacle axes are the primitive's when the mesh moves.
        let turned = |v: &Vector3<f64>| {
            if mesh_moves {
                *v
            } else {
                placement.rotation.tr_mul(v)
            }
        };
        let center = if mesh_moves {
            placement.center
        } else {
            placement
                .rotation
                .tr_mul(&(placement.center - placement.origin))
        };
        Self {
            center,
            half_path: turned(&half_path),
            half_turn: turned(&half_turn),
            path: half_path.norm(),
            angle: motion.rate * half,
            ..still
        }
    }

    /// At rest: `placement` is obstacle from body.
    pub(super) fn still(
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
            center: Vector3::zeros(),
            half_path: Vector3::zeros(),
            half_turn: Vector3::zeros(),
            path: 0.0,
            angle: 0.0,
            margin,
        }
    }

    /// Whether the box may come within the margin of the primitive at some time. True for NaN.
    #[inline]
    pub(super) fn may_meet(&self, node: &Node) -> bool {
        let center = self.rotation * node.center.coords + self.origin;
        let nearest = self.primitive.nearest(&Point3::from(center));
        let n = nearest.normal;
        let in_mesh = self.rotation.tr_mul(&n);
        let extent = in_mesh.x.abs() * node.half.x
            + in_mesh.y.abs() * node.half.y
            + in_mesh.z.abs() * node.half.z;
        let arm = center - self.center;
        let sweep = n.dot(&(self.half_path + self.half_turn.cross(&arm))).abs();
        let stray = self.angle
            * (node.radius + self.path + 0.5 * self.angle * (arm.norm() + node.radius + self.path));
        let apart = nearest.distance > extent + sweep + stray + self.margin; // false for NaN
        !apart
    }
}

/// Calls `visit` for every triangle of the mesh whose boxes `keep` accepts all the way down; stops when it returns false.
///
/// `keep` is asked with a node's index. `stack` is scratch memory of pairs; only the first is used.
pub(super) fn for_triangles(
    mesh: &Mesh,
    stack: &mut Vec<(u32, u32)>,
    mut keep: impl FnMut(u32) -> bool,
    mut visit: impl FnMut(u32) -> bool,
) {
    let nodes = mesh.tree().nodes();
    stack.clear();
    stack.push((0, 0));
    while let Some((i, _)) = stack.pop() {
        if !keep(i) {
            continue;
        }
        let node = &nodes[i as usize];
        if node.is_leaf() {
            if !visit(node.triangle) {
                return;
            }
        } else {
            stack.push((node.second, 0));
            stack.push((i + 1, 0));
        }
    }
}
