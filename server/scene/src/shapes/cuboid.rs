//! The box.

use nalgebra::Point3;

use crate::mesh_file::RawMesh;

/// A box with these half extents, m: 8 vertices, 12 triangles.
pub fn cuboid(half_extents: [f64; 3]) -> RawMesh {
    let [x, y, z] = half_extents;
    let vertices = (0..8)
        .map(|i| Point3::new(sign(i, 1) * x, sign(i, 2) * y, sign(i, 4) * z))
        .collect();
    // Each face anticlockwise from outside; corner = 1 (x) + 2 (y) + 4 (z).
    const FACES: [[u32; 4]; 6] = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let mut mesh = RawMesh {
        vertices,
        triangles: Vec::with_capacity(12),
    };
    for face in &FACES {
        mesh.push_polygon(face);
    }
    mesh
}

fn sign(corner: usize, bit: usize) -> f64 {
    if corner & bit == 0 { -1.0 } else { 1.0 }
}
