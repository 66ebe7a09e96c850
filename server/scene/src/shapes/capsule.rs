//! The capsule.

use std::f64::consts::FRAC_PI_2;

use super::Axis;
use super::axis::direction;
use crate::mesh_file::RawMesh;

/// Two half spheres of this radius around the points `half_length` from the origin on `axis`, and the cylinder between.
///
/// `facets` meridians (at least 4) and `facets / 4` rings in each half sphere, all vertices on the capsule. With r rings,
/// 4 · facets · r triangles: 2,304 for 48 facets.
pub fn capsule(radius: f64, half_length: f64, facets: usize, axis: Axis) -> RawMesh {
    let rings = (facets / 4).max(1);
    let mut mesh = RawMesh::default();
    mesh.vertices
        .push(axis.point(0.0, 0.0, -half_length - radius));
    // Rings from the low pole to the high one; the two at latitude zero bound the cylinder.
    let low = (1..=rings).map(|i| (-1.0, rings - i));
    let high = (0..rings).map(|i| (1.0, i));
    for (side, step) in low.chain(high) {
        let latitude = FRAC_PI_2 * step as f64 / rings as f64;
        let (across, along) = (
            radius * latitude.cos(),
            side * (half_length + radius * latitude.sin()),
        );
        for k in 0..facets {
            let (cos, sin) = direction(k, facets);
            mesh.vertices
                .push(axis.point(across * cos, across * sin, along));
        }
    }
    mesh.vertices
        .push(axis.point(0.0, 0.0, half_length + radius));

    let n = facets as u32;
    let ring_count = 2 * rings as u32;
    let at = |ring: u32, k: u32| 1 + ring * n + k % n;
    let high_pole = 1 + ring_count * n;
    for k in 0..n {
        mesh.triangles.push([0, at(0, k + 1), at(0, k)]);
        for ring in 0..ring_count - 1 {
            mesh.push_polygon(&[
                at(ring, k),
                at(ring, k + 1),
                at(ring + 1, k + 1),
                at(ring + 1, k),
            ]);
        }
        mesh.triangles
            .push([high_pole, at(ring_count - 1, k), at(ring_count - 1, k + 1)]);
    }
    mesh
}
