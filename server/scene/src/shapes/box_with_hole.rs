//! The box with a round hole right through it, for the peg.

use std::f64::consts::PI;

use super::Axis;
use crate::mesh_file::RawMesh;

/// A box with a prismatic hole of `facets` sides along `axis`, through the whole box: 4 · `facets` + 16 triangles, 280
/// for the paper's box with 66.
///
/// `radius` is the hole's apothem (centre to flat), so that a round peg of radius r has a clearance of exactly
/// `radius - r`. The middle of the first flat lies in the first direction across the axis (z for a hole along y). Each
/// end face is one triangle per side of the hole, to the nearest corner, and four more between corners; every hole vertex
/// lies inside the box if `radius / cos(pi / facets)` is below both half extents across the axis.
pub fn box_with_hole(half_extents: [f64; 3], radius: f64, facets: usize, axis: Axis) -> RawMesh {
    let [half_u, half_v, half_along] = axis.split(half_extents);
    let circumradius = hole_circumradius(radius, facets);
    let n = facets as u32;
    let mut mesh = RawMesh::default();
    let angle = |k: usize| PI * (2.0 * k as f64 - 1.0) / facets as f64;
    for side in [-1.0, 1.0] {
        for k in 0..facets {
            let (sin, cos) = angle(k).sin_cos();
            mesh.vertices.push(axis.point(
                circumradius * cos,
                circumradius * sin,
                side * half_along,
            ));
        }
    }
    for side in [-1.0, 1.0] {
        for (u, v) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
            mesh.vertices
                .push(axis.point(u * half_u, v * half_v, side * half_along));
        }
    }
    let low = |k: u32| k % n;
    let high = |k: u32| n + k % n;
    let low_corner = |q: u32| 2 * n + q % 4;
    let high_corner = |q: u32| 2 * n + 4 + q % 4;

    for k in 0..n {
        // The wall of the hole looks inwards.
        mesh.push_polygon(&[low(k + 1), low(k), high(k), high(k + 1)]);
        // The flat from vertex k to k + 1 has its middle at 2 pi k / n: its corner is that of the middle's quadrant.
        let quadrant = 4 * k / n;
        mesh.triangles
            .push([high(k), high_corner(quadrant), high(k + 1)]);
        mesh.triangles
            .push([low(k + 1), low_corner(quadrant), low(k)]);
        let next_quadrant = 4 * (k + 1) / n;
        if next_quadrant != quadrant {
            mesh.triangles.push([
                high(k + 1),
                high_corner(quadrant),
                high_corner(next_quadrant),
            ]);
            mesh.triangles
                .push([low(k + 1), low_corner(next_quadrant), low_corner(quadrant)]);
        }
    }
    for q in 0..4 {
        mesh.push_polygon(&[
            low_corner(q),
            low_corner(q + 1),
            high_corner(q + 1),
            high_corner(q),
        ]);
    }
    mesh
}

/// Distance of the hole's vertices from its axis, m.
pub(crate) fn hole_circumradius(apothem: f64, facets: usize) -> f64 {
    apothem / (PI / facets as f64).cos()
}
