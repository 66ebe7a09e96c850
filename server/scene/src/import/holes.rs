//! Holes: loops of open edges, closed with triangles between the vertices that are there.
//!
//! The triangulation has the least area of all, found by dynamic programming over the loop.
//! Source: G. Barequet, M. Sharir, *Filling Gaps in the Boundary of a Polyhedron*, CAGD 12, 1995.

use std::collections::HashSet;

use god_object::geometry::face_normal;
use nalgebra::{Point3, Vector3};

use super::edges::{borders, components, sides};
use super::faces::corners;
use super::report::Places;
use crate::mesh_file::RawMesh;

/// Most edges of a hole that is closed unasked.
const SMALL_HOLE_EDGES: usize = 16;
/// Largest area of a hole that is closed unasked, as a share of its surface's: more may be the mouth of a cup.
const SMALL_HOLE_SHARE: f64 = 0.01;
/// Most edges of a hole that can be closed: the work grows with their cube.
pub const MAX_HOLE_EDGES: usize = 256;
/// A closed surface of the area A holds more than this share of A^1.5, or it is a sheet on which its own filling lies.
const LEAST_VOLUME_SHARE: f64 = 1e-6;

/// A loop of open edges.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Loop {
    /// Its vertices, in the order of the triangles that would fill it.
    pub(super) vertices: Vec<u32>,
    /// Middle of its vertices.
    pub(super) place: Point3<f64>,
    /// m.
    pub(super) length: f64,
    /// Which connected surface it bounds.
    component: usize,
}

/// The loops of a surface whose triangles agree about outside and whose parts share no vertex.
pub(super) fn loops(mesh: &RawMesh) -> Vec<Loop> {
    let open = borders(&mesh.triangles);
    if open.is_empty() {
        return Vec::new();
    }
    let mut component_of = vec![0; mesh.triangles.len()];
    for (index, triangles) in components(&mesh.triangles).iter().enumerate() {
        for t in triangles {
            component_of[*t as usize] = index;
        }
    }
    // Filling runs against the triangles that are there.
    let mut next = vec![u32::MAX; mesh.vertices.len()];
    let mut component_at = vec![0; mesh.vertices.len()];
    for side in &open {
        let [from, to] = side.directed();
        next[to as usize] = from;
        component_at[to as usize] = component_of[side.triangle as usize];
    }
    let mut found = Vec::new();
    for (start, component) in component_at.into_iter().enumerate() {
        let (mut vertices, mut at) = (Vec::new(), start as u32);
        while next[at as usize] != u32::MAX {
            vertices.push(at);
            at = std::mem::replace(&mut next[at as usize], u32::MAX);
        }
        if vertices.is_empty() {
            continue;
        }
        let points: Vec<Point3<f64>> = vertices
            .iter()
            .map(|v| mesh.vertices[*v as usize])
            .collect();
        let sum: Vector3<f64> = points.iter().map(|p| p.coords).sum();
        let around = points.iter().zip(points.iter().cycle().skip(1));
        found.push(Loop {
            place: Point3::from(sum / points.len() as f64),
            length: around.map(|(a, b)| (b - a).norm()).sum(),
            component,
            vertices,
        });
    }
    found
}

/// What was closed.
#[derive(Debug, Default)]
pub(super) struct Closed {
    pub(super) holes: Places,
    pub(super) triangles: usize,
    /// Length of the longest loop, m.
    pub(super) longest: f64,
}

/// Closes holes of at most `asked` edges; unasked, small ones only. A sheet is left open.
pub(super) fn close(mesh: &mut RawMesh, asked: Option<usize>) -> Closed {
    let mut closed = Closed::default();
    let all = loops(mesh);
    if all.is_empty() {
        return closed;
    }
    let parts = components(&mesh.triangles);
    let most = asked.unwrap_or(SMALL_HOLE_EDGES).min(MAX_HOLE_EDGES);
    let mut edges: HashSet<[u32; 2]> = sides(&mesh.triangles).iter().map(|s| s.ends).collect();
    let mut loops_of: Vec<Vec<&Loop>> = vec![Vec::new(); parts.len()];
    for hole in &all {
        loops_of[hole.component].push(hole);
    }
    for (triangles, own) in parts.iter().zip(&loops_of) {
        if own.is_empty() {
            continue;
        }
        let area: f64 = triangles
            .iter()
            .map(|t| area(mesh, mesh.triangles[*t as usize]))
            .sum();
        let filled: Vec<(&Loop, Vec<[u32; 3]>)> = own
            .iter()
            .filter(|hole| hole.vertices.len() <= most)
            .filter_map(|hole| Some((*hole, fill(mesh, &hole.vertices, &edges)?)))
            .filter(|(_, fill)| {
                let of_hole: f64 = fill.iter().map(|t| self::area(mesh, *t)).sum();
                asked.is_some() || of_hole <= SMALL_HOLE_SHARE * area
            })
            .collect();
        let fills = filled.iter().flat_map(|(_, fill)| fill);
        let surface = triangles.iter().map(|t| &mesh.triangles[*t as usize]);
        let volume = volume(mesh, surface.chain(fills.clone()));
        let is_whole = filled.len() == own.len();
        if is_whole && volume.abs() <= LEAST_VOLUME_SHARE * area.powf(1.5) {
            continue;
        }
        let new: Vec<[u32; 3]> = fills.copied().collect();
        edges.extend(sides(&new).iter().map(|s| s.ends));
        closed.triangles += new.len();
        for (hole, _) in &filled {
            closed.holes.add(hole.place);
            closed.longest = closed.longest.max(hole.length);
        }
        mesh.triangles.extend(new);
    }
    closed
}

fn area(mesh: &RawMesh, t: [u32; 3]) -> f64 {
    let [a, b, c] = corners(mesh, t);
    (b - a).cross(&(c - a)).norm() / 2.0
}

/// Signed volume about the first corner, m^3.
fn volume<'t>(mesh: &RawMesh, triangles: impl Iterator<Item = &'t [u32; 3]>) -> f64 {
    let mut origin = None;
    let six: f64 = triangles
        .map(|t| {
            let points = corners(mesh, *t);
            let origin = *origin.get_or_insert(points[0]);
            let [a, b, c] = points.map(|p| p - origin);
            a.dot(&b.cross(&c))
        })
        .sum();
    six / 6.0
}

/// The triangulation of the loop of least area that adds no third triangle to an edge and has no triangle without area.
fn fill(mesh: &RawMesh, outline: &[u32], edges: &HashSet<[u32; 2]>) -> Option<Vec<[u32; 3]>> {
    let n = outline.len();
    if n < 3 {
        return None;
    }
    let chord_is_free = |i: usize, j: usize| {
        let (a, b) = (outline[i], outline[j]);
        j == i + 1 || (i == 0 && j == n - 1) || !edges.contains(&[a.min(b), a.max(b)])
    };
    let mut least = vec![0.0_f64; n * n];
    let mut apex = vec![0_usize; n * n];
    for width in 2..n {
        for i in 0..n - width {
            let j = i + width;
            let mut best = (f64::INFINITY, 0);
            if chord_is_free(i, j) {
                for k in i + 1..j {
                    let t = [outline[i], outline[k], outline[j]];
                    if face_normal(&corners(mesh, t)).is_none() {
                        continue;
                    }
                    let sum = least[i * n + k] + least[k * n + j] + area(mesh, t);
                    if sum < best.0 {
                        best = (sum, k);
                    }
                }
            }
            (least[i * n + j], apex[i * n + j]) = best;
        }
    }
    if !least[n - 1].is_finite() {
        return None;
    }
    let (mut triangles, mut pending) = (Vec::with_capacity(n - 2), vec![(0, n - 1)]);
    while let Some((i, j)) = pending.pop() {
        if j > i + 1 {
            let k = apex[i * n + j];
            triangles.push([outline[i], outline[k], outline[j]]);
            pending.extend([(i, k), (k, j)]);
        }
    }
    Some(triangles)
}
