//! Meshes that the renderer makes itself: dots, arrows, and plain bodies for trying it out.

use std::f32::consts::{PI, TAU};

use crate::stage::TriangleMesh;

/// A sphere around the origin with `segments` meridians.
pub fn sphere(radius: f32, segments: u32) -> TriangleMesh {
    let rings = segments / 2;
    let ring = |i: u32| {
        let (sine, cosine) = (PI * i as f32 / rings as f32).sin_cos();
        [radius * sine, radius * cosine]
    };
    let mut profile: Vec<[f32; 2]> = (1..rings).rev().map(ring).collect();
    profile.insert(0, [0.0, -radius]);
    profile.push([0.0, radius]);
    revolve(&profile, segments)
}

/// A cylinder around the y axis.
pub fn cylinder(radius: f32, half_length: f32, facets: u32) -> TriangleMesh {
    let profile = [
        [0.0, -half_length],
        [radius, -half_length],
        [radius, half_length],
        [0.0, half_length],
    ];
    revolve(&profile, facets)
}

/// An arrow from the origin to (0, 1, 0); its head is as wide as three shafts.
pub fn arrow(shaft_radius: f32, head_length: f32, facets: u32) -> TriangleMesh {
    let neck = 1.0 - head_length;
    let profile = [
        [0.0, 0.0],
        [shaft_radius, 0.0],
        [shaft_radius, neck],
        [3.0 * shaft_radius, neck],
        [0.0, 1.0],
    ];
    revolve(&profile, facets)
}

/// A box around the origin.
pub fn cuboid(half_extents: [f32; 3]) -> TriangleMesh {
    let sign = |bit: u32| if bit == 0 { -1.0 } else { 1.0 };
    let corner = |i: u32| [0, 1, 2].map(|axis| sign(i >> axis & 1) * half_extents[axis as usize]);
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    TriangleMesh {
        vertices: (0..8).map(corner).collect(),
        triangles: faces
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
        looks: None,
        textures: None,
    }
}

/// Turns a profile (radius, height) around the y axis. It runs upwards and begins and ends on the
/// axis, so that the surface is closed and its normals point outwards.
fn revolve(profile: &[[f32; 2]], facets: u32) -> TriangleMesh {
    let mut vertices = Vec::new();
    let mut rings = Vec::new();
    for &[radius, height] in profile {
        let first = vertices.len() as u32;
        let count = if radius == 0.0 { 1 } else { facets };
        vertices.extend((0..count).map(|i| {
            let (sine, cosine) = (TAU * i as f32 / facets as f32).sin_cos();
            [radius * sine, height, radius * cosine]
        }));
        rings.push((first, count));
    }
    let mut triangles = Vec::new();
    for pair in rings.windows(2) {
        let ((low, low_count), (high, high_count)) = (pair[0], pair[1]);
        for i in 0..facets {
            let next = i + 1;
            let (a, b) = (low + i % low_count, low + next % low_count);
            let (c, d) = (high + i % high_count, high + next % high_count);
            if a != b {
                triangles.push([a, b, d]);
            }
            if c != d {
                triangles.push([a, d, c]);
            }
        }
    }
    TriangleMesh {
        vertices,
        triangles,
        looks: None,
        textures: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// Six times the volume that the triangles enclose, positive where they face outwards.
    fn volume(mesh: &TriangleMesh) -> f32 {
        let at = |i: u32| Vector3::from(mesh.vertices[i as usize]);
        let cone = |&[a, b, c]: &[u32; 3]| at(a).dot(&at(b).cross(&at(c)));
        mesh.triangles.iter().map(cone).sum::<f32>() / 6.0
    }

    #[test]
    fn shapes_are_closed_and_face_outwards() {
        assert!((volume(&sphere(1.0, 48)) / (4.0 / 3.0 * PI) - 1.0).abs() < 0.01);
        assert!((volume(&cylinder(1.0, 2.0, 72)) / (4.0 * PI) - 1.0).abs() < 0.01);
        assert!((volume(&cuboid([1.0, 2.0, 3.0])) - 48.0).abs() < 1e-4);
        let shaft_and_head = PI * 0.01 * 0.7 + PI * 0.09 * 0.3 / 3.0;
        assert!((volume(&arrow(0.1, 0.3, 72)) / shaft_and_head - 1.0).abs() < 0.01);
    }

    #[test]
    fn every_edge_of_a_shape_is_passed_once_each_way() {
        for mesh in [
            sphere(1.0, 16),
            cylinder(1.0, 1.0, 8),
            arrow(0.1, 0.3, 8),
            cuboid([1.0; 3]),
        ] {
            let edges = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)];
            let all: Vec<(u32, u32)> = mesh.triangles.iter().flat_map(edges).collect();
            for &(a, b) in &all {
                assert_eq!(all.iter().filter(|&&edge| edge == (b, a)).count(), 1);
            }
        }
    }
}
