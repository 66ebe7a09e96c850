//! Corners of one triangle that lie on the open side of another: the side is cut there, so that both share the corner.
//!
//! Exporters that mesh each face of a part by itself leave such corners along the common edges, and so does a triangle without area that was removed.

use std::collections::HashSet;

use god_object::geometry::face_normal;
use nalgebra::Point3;

use super::edges::{Side, borders};
use super::faces::corners;
use crate::mesh_file::RawMesh;

/// Most open edges that are looked at: each may be compared with each.
const MAX_OPEN_EDGES: usize = 20_000;
/// Each pass cuts one side of a triangle at most.
const MAX_PASSES: usize = 4;

/// What was stitched.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stitched {
    /// Sides that were cut.
    pub(super) sides: usize,
    /// Farthest that a point was moved, m: in each pass, as far as a corner was from the side.
    pub(super) moved: f64,
    /// The first of these corners.
    pub(super) place: Option<Point3<f64>>,
}

/// Cuts open sides at the corners that lie on them within `tolerance`, m, wherever that closes an edge.
pub(super) fn stitch(mesh: &mut RawMesh, tolerance: f64) -> Stitched {
    let mut done = Stitched::default();
    for _ in 0..MAX_PASSES {
        let open = borders(&mesh.triangles);
        if open.is_empty() || open.len() > MAX_OPEN_EDGES {
            break;
        }
        let mut now = Stitched {
            place: done.place,
            ..Stitched::default()
        };
        pass(mesh, &open, tolerance, &mut now);
        if now.sides == 0 {
            break;
        }
        // A point may be moved in each pass.
        done = Stitched {
            sides: done.sides + now.sides,
            moved: done.moved + now.moved,
            place: now.place,
        };
    }
    done
}

fn pass(mesh: &mut RawMesh, open: &[Side], tolerance: f64, done: &mut Stitched) {
    let mut points: Vec<u32> = open.iter().flat_map(|side| side.ends).collect();
    points.sort_unstable();
    points.dedup();
    points.sort_by(|a, b| x(mesh, *a).total_cmp(&x(mesh, *b)));
    let edges: HashSet<[u32; 2]> = open.iter().map(|side| side.ends).collect();
    let mut cut = HashSet::new();
    for side in open {
        if cut.contains(&side.triangle) {
            continue;
        }
        let on_side = points_on(mesh, &points, side, tolerance);
        let [from, to] = side.directed();
        let chain: Vec<u32> = std::iter::once(from)
            .chain(on_side.iter().map(|(_, v, _)| *v))
            .chain(std::iter::once(to))
            .collect();
        let closes = chain
            .windows(2)
            .any(|pair| edges.contains(&[pair[0].min(pair[1]), pair[0].max(pair[1])]));
        if on_side.is_empty() || !closes || !replace(mesh, side, &chain) {
            continue;
        }
        cut.insert(side.triangle);
        done.sides += 1;
        for (_, v, distance) in on_side {
            done.moved = done.moved.max(distance);
            done.place.get_or_insert(mesh.vertices[v as usize]);
        }
    }
}

fn x(mesh: &RawMesh, v: u32) -> f64 {
    mesh.vertices[v as usize].x
}

/// Vertices within the side, in its order: share of the way, vertex, distance. `points` ascend along x.
fn points_on(mesh: &RawMesh, points: &[u32], side: &Side, tolerance: f64) -> Vec<(f64, u32, f64)> {
    let [from, to] = side.directed();
    let apex = mesh.triangles[side.triangle as usize][(usize::from(side.corner) + 2) % 3];
    let [a, b] = [from, to].map(|v| mesh.vertices[v as usize]);
    let (low, high) = (a.x.min(b.x) - tolerance, a.x.max(b.x) + tolerance);
    let begin = points.partition_point(|v| x(mesh, *v) < low);
    let along = b - a;
    let length = along.norm();
    let mut found: Vec<(f64, u32, f64)> = points[begin..]
        .iter()
        .take_while(|v| x(mesh, **v) <= high)
        .filter(|v| ![from, to, apex].contains(v))
        .filter_map(|v| {
            let way = mesh.vertices[*v as usize] - a;
            let share = way.dot(&along) / (length * length);
            let distance = (way - along * share).norm();
            let within = share * length > tolerance && (1.0 - share) * length > tolerance;
            (within && distance <= tolerance).then_some((share, *v, distance))
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
}

/// Puts a fan in the triangle's place; `false` where a triangle of the fan had no area.
fn replace(mesh: &mut RawMesh, side: &Side, chain: &[u32]) -> bool {
    let t = side.triangle as usize;
    let apex = mesh.triangles[t][(usize::from(side.corner) + 2) % 3];
    let fan: Vec<[u32; 3]> = chain.windows(2).map(|p| [p[0], p[1], apex]).collect();
    if fan
        .iter()
        .any(|new| face_normal(&corners(mesh, *new)).is_none())
    {
        return false;
    }
    mesh.triangles[t] = fan[0];
    mesh.triangles.extend_from_slice(&fan[1..]);
    true
}
