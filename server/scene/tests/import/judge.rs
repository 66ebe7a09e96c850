//! What a surface is, found with nothing that the import uses but the reader of the files that it wrote.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::solids::{Point, Soup, Triangle, cross, dot, minus, six_volumes, soup_of};

/// A surface, judged.
#[derive(Debug)]
pub(crate) struct Verdict {
    /// Each directed edge has exactly one triangle, and the opposite one, too.
    pub closed: bool,
    /// Signed volume of each connected part, m^3, largest first.
    pub volumes: Vec<f64>,
    /// All corners of all triangles, m.
    pub soup: Soup,
}

pub(crate) fn judge(file: &Path) -> Verdict {
    let mesh = taut_scene::read_mesh(file).unwrap();
    let soup = soup_of(&mesh);

    let directed = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let edges: Vec<[u32; 2]> = mesh.triangles.iter().flat_map(directed).collect();
    let set: HashSet<[u32; 2]> = edges.iter().copied().collect();
    let closed = set.len() == edges.len() && set.iter().all(|[a, b]| set.contains(&[*b, *a]));

    // Parts: labels spread along edges until none changes.
    let mut label: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    loop {
        let mut changed = false;
        for [a, b] in &edges {
            let least = label[*a as usize].min(label[*b as usize]);
            for v in [*a, *b] {
                changed |= label[v as usize] != least;
                label[v as usize] = least;
            }
        }
        if !changed {
            break;
        }
    }
    let mut volumes: HashMap<u32, f64> = HashMap::new();
    for (triangle, corners) in mesh.triangles.iter().zip(&soup) {
        *volumes.entry(label[triangle[0] as usize]).or_default() += six_volumes(corners) / 6.0;
    }
    let mut volumes: Vec<f64> = volumes.into_values().collect();
    volumes.sort_by(|a, b| b.total_cmp(a));
    Verdict {
        closed,
        volumes,
        soup,
    }
}

/// How often the surface goes around a place: 1 in a solid, 0 outside.
///
/// Source: A. Van Oosterom, J. Strackee, *The Solid Angle of a Plane Triangle*, IEEE TBME 30, 1983.
pub(crate) fn winding(surface: &Soup, place: Point) -> f64 {
    let angle = |t: &Triangle| {
        let [a, b, c] = t.map(|p| minus(p, place));
        let [la, lb, lc] = [a, b, c].map(|v| dot(v, v).sqrt());
        let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
        2.0 * dot(a, cross(b, c)).atan2(below)
    };
    surface.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Largest distance of a set of points of `from` to the triangles of `to`, each with each: below the true one-sided distance, and equal to
/// it where a corner is the farthest point.
pub(crate) fn one_sided(from: &Soup, to: &Soup) -> f64 {
    let points = from.iter().flat_map(|[a, b, c]| {
        let middle = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
        let half = |p: &Point, q: &Point| [0, 1, 2].map(|k| (p[k] + q[k]) / 2.0);
        [*a, *b, *c, middle, half(a, b), half(b, c), half(c, a)]
    });
    let mut seen = HashSet::new();
    points
        .filter(|p| seen.insert(p.map(f64::to_bits)))
        .map(|p| {
            let nearest = to.iter().map(|t| distance(p, t));
            nearest.fold(f64::INFINITY, f64::min)
        })
        .fold(0.0, f64::max)
}

/// Distance of a point from a triangle: over its inside along the normal, else to the nearest side.
fn distance(p: Point, t: &Triangle) -> f64 {
    let normal = cross(minus(t[1], t[0]), minus(t[2], t[0]));
    let area = dot(normal, normal);
    let inside = area > 0.0
        && (0..3).all(|k| {
            let side = minus(t[(k + 1) % 3], t[k]);
            dot(cross(side, minus(p, t[k])), normal) >= 0.0
        });
    if inside {
        return dot(minus(p, t[0]), normal).abs() / area.sqrt();
    }
    let to_side = |k: usize| {
        let (way, side) = (minus(p, t[k]), minus(t[(k + 1) % 3], t[k]));
        let length = dot(side, side);
        let share = if length > 0.0 {
            (dot(way, side) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let rest = minus(way, side.map(|c| c * share));
        dot(rest, rest).sqrt()
    };
    (0..3).map(to_side).fold(f64::INFINITY, f64::min)
}
