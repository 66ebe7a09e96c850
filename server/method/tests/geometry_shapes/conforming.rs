//! A peg and a hole cut finely along their length: conforming contact of dense meshes.

use god_object::nalgebra::{Point3, Vector3};

use super::Soup;

/// Rings of `around` vertices about the z axis; two rings of quads' corners become triangles by [`band`].
fn ring(vertices: &mut Vec<Point3<f64>>, radius: f64, z: f64, around: u32) -> u32 {
    let first = vertices.len() as u32;
    vertices.extend((0..around).map(|k| {
        let u = std::f64::consts::TAU * f64::from(k) / f64::from(around);
        Point3::new(radius * u.cos(), radius * u.sin(), z)
    }));
    first
}

/// The band between two rings, seen from outside when the second lies above the first on a convex surface.
fn band(triangles: &mut Vec<[u32; 3]>, low: u32, high: u32, around: u32) {
    for k in 0..around {
        let next = (k + 1) % around;
        triangles.extend([
            [low + k, low + next, high + next],
            [low + k, high + next, high + k],
        ]);
    }
}

/// Prism with `around` sides, cut into `along` rings: 2 around (along + 1) triangles.
pub(crate) fn fine_peg(radius: f64, half_length: f64, around: u32, along: u32) -> Soup {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let at = |k: u32| half_length * (2.0 * f64::from(k) / f64::from(along) - 1.0);
    let rings: Vec<u32> = (0..=along)
        .map(|k| ring(&mut vertices, radius, at(k), around))
        .collect();
    for two in rings.windows(2) {
        band(&mut triangles, two[0], two[1], around);
    }
    let (bottom, top) = (vertices.len() as u32, vertices.len() as u32 + 1);
    vertices.extend([-half_length, half_length].map(|z| Point3::new(0.0, 0.0, z)));
    let last = rings[rings.len() - 1];
    for k in 0..around {
        let next = (k + 1) % around;
        triangles.extend([
            [bottom, rings[0] + next, rings[0] + k],
            [top, last + k, last + next],
        ]);
    }
    (vertices, triangles)
}

/// Ring-shaped block with a hole of `around` sides, its wall cut into `along` rings: 2 around (along + 3) triangles.
pub(crate) fn fine_hole(inner: f64, outer: f64, half_length: f64, around: u32, along: u32) -> Soup {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    // Once around the section: down the wall, across the bottom, up the outside, across the top.
    let at = |k: u32| half_length * (1.0 - 2.0 * f64::from(k) / f64::from(along));
    let mut rings: Vec<u32> = (0..=along)
        .map(|k| ring(&mut vertices, inner, at(k), around))
        .collect();
    rings.extend([-half_length, half_length].map(|z| ring(&mut vertices, outer, z, around)));
    for k in 0..rings.len() {
        band(
            &mut triangles,
            rings[k],
            rings[(k + 1) % rings.len()],
            around,
        );
    }
    (vertices, triangles)
}

/// Moves every vertex by up to `noise` (m) along each axis.
pub(crate) fn roughened((vertices, triangles): Soup, noise: f64, seed: u64) -> Soup {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut signed = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let moved = vertices
        .iter()
        .map(|p| p + Vector3::new(signed(), signed(), signed()) * noise)
        .collect();
    (moved, triangles)
}
