//! The sphere, as an icosphere.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};

use crate::mesh_file::RawMesh;

/// A sphere of this radius, m: an icosahedron each of whose faces is cut into four, `subdivisions` times, with all
/// vertices on the sphere. 20 · 4^subdivisions triangles: 20, 80, 320, 1,280, 5,120, 20,480, 81,920 ...
///
/// The faces lie inside the sphere by at most 0.3 r / 4^subdivisions.
pub fn sphere(radius: f64, subdivisions: u32) -> RawMesh {
    let mut directions = icosahedron_directions();
    let mut triangles = ICOSAHEDRON_FACES.to_vec();
    for _ in 0..subdivisions {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let sum = directions[a as usize] + directions[b as usize];
                directions.push(sum / sum.norm());
                directions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    RawMesh {
        vertices: directions
            .iter()
            .map(|d| Point3::from(d * radius))
            .collect(),
        triangles,
    }
}

fn icosahedron_directions() -> Vec<Vector3<f64>> {
    let golden = f64::midpoint(1.0, 5.0f64.sqrt());
    let mut corners = Vec::with_capacity(12);
    for (one, long) in [
        (-1.0, -golden),
        (1.0, -golden),
        (-1.0, golden),
        (1.0, golden),
    ] {
        corners.push(Vector3::new(0.0, one, long));
        corners.push(Vector3::new(one, long, 0.0));
        corners.push(Vector3::new(long, 0.0, one));
    }
    corners
        .iter()
        .map(|corner| corner / corner.norm())
        .collect()
}

/// Anticlockwise from outside; places in [`icosahedron_directions`].
const ICOSAHEDRON_FACES: [[u32; 3]; 20] = [
    [0, 1, 2],
    [0, 4, 1],
    [0, 2, 3],
    [0, 3, 8],
    [0, 8, 4],
    [1, 5, 2],
    [1, 4, 6],
    [1, 6, 5],
    [2, 7, 3],
    [2, 5, 7],
    [3, 7, 10],
    [3, 10, 8],
    [4, 11, 6],
    [4, 8, 11],
    [5, 6, 9],
    [5, 9, 7],
    [6, 11, 9],
    [7, 9, 10],
    [8, 10, 11],
    [9, 11, 10],
];
