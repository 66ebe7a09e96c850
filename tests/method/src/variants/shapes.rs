//! Solids that fit each other: turned ones and plates, cut as finely as is asked for, crowned and rough.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};
use taut_scene::RawMesh;

use crate::hand::Random;
use crate::solids::cells;

/// How a surface is cut: facets around (or twelve for each cell of a plate's side), and bands along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tessellation {
    /// At least 3.
    pub facets: u32,
    /// At least 1, which is none.
    pub bands: u32,
}

/// A shaft about the z axis whose corners lie on its radius; crowned by `crown` (m) in the middle of its length.
pub fn shaft(radius: f64, half: f64, cut: Tessellation, crown: f64) -> RawMesh {
    let profile: Vec<[f64; 2]> = (0..=cut.bands)
        .map(|k| {
            let z = 2.0 * f64::from(k) / f64::from(cut.bands) - 1.0;
            [radius - crown * z * z, half * z]
        })
        .collect();
    let mut raw = RawMesh::default();
    let rings = turned(&mut raw, &profile, cut.facets, 0.0);
    let ends = [-half, half].map(|z| {
        raw.vertices.push(Point3::new(0.0, 0.0, z));
        raw.vertices.len() as u32 - 1
    });
    let last = rings[rings.len() - 1];
    for k in 0..cut.facets {
        let next = (k + 1) % cut.facets;
        raw.triangles.extend([
            [ends[0], rings[0] + next, rings[0] + k],
            [ends[1], last + k, last + next],
        ]);
    }
    raw
}

/// A ring-shaped block whose bore leaves a shaft of `radius` this clearance (m) whatever the facets, `turn` facets turned about z.
pub fn bore(radius: f64, clearance: f64, half: f64, cut: Tessellation, turn: f64) -> RawMesh {
    let inner = (radius + clearance) / (PI / f64::from(cut.facets)).cos();
    let outer = 3.0 * radius;
    let mut profile: Vec<[f64; 2]> = (0..=cut.bands)
        .map(|k| {
            let z = half * (1.0 - 2.0 * f64::from(k) / f64::from(cut.bands));
            [inner, z]
        })
        .collect();
    profile.extend([[outer, -half], [outer, half]]);
    let mut raw = RawMesh::default();
    let rings = turned(&mut raw, &profile, cut.facets, turn);
    band(&mut raw, [rings[rings.len() - 1], rings[0]], cut.facets);
    raw
}

/// A plate with its underside at z = 0 and the given half sides, its underside crowned by `crown` (m): the middle stands out.
pub fn plate(half: [f64; 3], cut: Tessellation, crown: f64) -> RawMesh {
    let across = (cut.facets / 12).max(1);
    let planes = |half: f64, count: u32| -> Vec<f64> {
        let at = |k: u32| half * (2.0 * f64::from(k) / f64::from(count) - 1.0);
        (0..=count).map(at).collect()
    };
    let along = (across * cut.bands.min(2)).max(1);
    let (xs, ys) = (planes(half[0], across), planes(half[1], along));
    let mut raw = cells([&xs, &ys, &[0.0, 2.0 * half[2]]], |_| true);
    for v in raw.vertices.iter_mut().filter(|v| v.z == 0.0) {
        let (x, y) = (v.x / half[0], v.y / half[1]);
        v.z = crown * 0.5 * (x * x + y * y);
    }
    raw
}

/// Every vertex moved by up to `noise` (m) along each axis.
pub fn rough(mut raw: RawMesh, noise: f64, seed: u64) -> RawMesh {
    let mut random = Random(seed);
    if noise > 0.0 {
        for vertex in &mut raw.vertices {
            *vertex += Vector3::from_fn(|_, _| (2.0 * random.unit() - 1.0) * noise);
        }
    }
    raw
}

/// Rings of vertices about z for each (radius, z) of a profile, bands between them; where each ring begins.
fn turned(raw: &mut RawMesh, profile: &[[f64; 2]], facets: u32, turn: f64) -> Vec<u32> {
    let rings: Vec<u32> = profile
        .iter()
        .map(|[radius, z]| {
            let first = raw.vertices.len() as u32;
            raw.vertices.extend((0..facets).map(|k| {
                let u = TAU * (f64::from(k) + turn) / f64::from(facets);
                Point3::new(radius * u.cos(), radius * u.sin(), *z)
            }));
            first
        })
        .collect();
    for two in rings.windows(2) {
        band(raw, [two[0], two[1]], facets);
    }
    rings
}

/// The band between two rings, seen from outside when the second lies above the first on a shaft.
fn band(raw: &mut RawMesh, [low, high]: [u32; 2], facets: u32) {
    for k in 0..facets {
        let next = (k + 1) % facets;
        raw.triangles.extend([
            [low + k, low + next, high + next],
            [low + k, high + next, high + k],
        ]);
    }
}
