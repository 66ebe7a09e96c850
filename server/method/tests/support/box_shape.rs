//! A box as a mesh.

use god_object::Mesh;
use god_object::nalgebra::{Point3, Vector3};

/// A box with the given half extents, 12 triangles, outward.
pub(crate) fn box_mesh(half: Vector3<f64>) -> Mesh {
    let corner = |i: u32| {
        let sign = |bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
        Point3::new(sign(1) * half.x, sign(2) * half.y, sign(4) * half.z)
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads
        .iter()
        .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
        .collect();
    Mesh::new((0..8).map(corner).collect(), triangles).expect("a box is closed")
}
