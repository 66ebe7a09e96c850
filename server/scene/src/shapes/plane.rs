//! The bounded plane.

use super::{Axis, cuboid};
use crate::mesh_file::RawMesh;

/// Side and thickness of the plate that is drawn for a half-space and that a plane is in the hand, m.
pub(crate) const PLATE: [f64; 2] = [1.0, 0.1];

/// A square of this `size` (m) with normal `axis` through the origin, as the upper face of a box of this `thickness`:
/// 12 triangles. It is bounded: what goes over its rim falls off.
pub fn plane(size: f64, thickness: f64, axis: Axis) -> RawMesh {
    let normal = axis.unit();
    let half =
        normal * (thickness / 2.0) + (nalgebra::Vector3::repeat(1.0) - normal) * (size / 2.0);
    let mut mesh = cuboid([half.x, half.y, half.z]);
    for vertex in &mut mesh.vertices {
        *vertex -= normal * (thickness / 2.0);
    }
    mesh
}
