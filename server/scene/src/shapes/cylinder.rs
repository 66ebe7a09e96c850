//! The cylinder, as a prism.

use super::Axis;
use super::axis::direction;
use crate::mesh_file::RawMesh;

/// A prism with `facets` sides (at least 3) along `axis`: 4 · `facets` triangles, 288 for the paper's peg with 72.
///
/// `radius` is that of the vertices, so the prism fits into every hole that a true cylinder fits into. The caps are fans
/// around a vertex in their middle. Half its length, m, lies to either side of the origin.
pub fn cylinder(radius: f64, half_length: f64, facets: usize, axis: Axis) -> RawMesh {
    let mut mesh = RawMesh::default();
    for k in 0..facets {
        let (cos, sin) = direction(k, facets);
        mesh.vertices
            .push(axis.point(radius * cos, radius * sin, -half_length));
        mesh.vertices
            .push(axis.point(radius * cos, radius * sin, half_length));
    }
    mesh.vertices.push(axis.point(0.0, 0.0, -half_length));
    mesh.vertices.push(axis.point(0.0, 0.0, half_length));
    let n = facets as u32;
    let (low_centre, high_centre) = (2 * n, 2 * n + 1);
    for k in 0..n {
        let (low, next_low) = (2 * k, 2 * ((k + 1) % n));
        let (high, next_high) = (low + 1, next_low + 1);
        mesh.push_polygon(&[low, next_low, next_high, high]);
        mesh.triangles.push([low_centre, next_low, low]);
        mesh.triangles.push([high_centre, high, next_high]);
    }
    mesh
}
