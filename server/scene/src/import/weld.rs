//! Vertices that are one in the part and several in the file, because each triangle was rounded by itself.
//!
//! Only vertices on open edges are merged: a surface that is closed already is left as it is. Each joins the nearest vertex that was kept before
//! it within the tolerance, so none moves farther than that, and chains of near vertices do not collapse.

use std::collections::HashMap;

use nalgebra::Point3;

use super::edges::borders;
use crate::mesh_file::RawMesh;

/// Tolerances that are tried after rounding alone, as shares of the part's diagonal. The last, 1 um of 100 mm, is below what tessellation leaves of any feature.
const SHARES: [f64; 2] = [1e-6, WIDEST_SHARE];
/// The widest tolerance, as a share of the part's diagonal.
pub(super) const WIDEST_SHARE: f64 = 1e-5;
/// Units in the last place of the largest coordinate by which two copies of a vertex may differ: each was rounded once, and computed from others.
const ROUNDING_UNITS: f64 = 4.0;

/// What was merged.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Welded {
    pub(super) merged: usize,
    /// Farthest that a vertex went, m.
    pub(super) moved: f64,
    /// One that was merged.
    pub(super) place: Option<Point3<f64>>,
}

/// How far apart rounding may put two copies of a vertex, m. `single` says that the file holds single precision.
pub(super) fn rounding(mesh: &RawMesh, single: bool) -> f64 {
    let unit = if single {
        f64::from(f32::EPSILON)
    } else {
        f64::EPSILON
    };
    let largest = mesh.vertices.iter().map(|v| v.coords.amax());
    ROUNDING_UNITS * unit * largest.fold(0.0, f64::max)
}

/// Diagonal of the box around a mesh, m.
pub(super) fn diagonal(mesh: &RawMesh) -> f64 {
    mesh.bounds().map_or(0.0, |(low, high)| (high - low).norm())
}

/// Merges vertices on open edges, within the least tolerance that leaves the fewest of them.
pub(super) fn weld_borders(mesh: &mut RawMesh, rounding: f64) -> Welded {
    let open = borders(&mesh.triangles);
    if open.is_empty() {
        return Welded::default();
    }
    let mut on_border: Vec<u32> = open.iter().flat_map(|side| side.ends).collect();
    on_border.sort_unstable();
    on_border.dedup();
    let size = diagonal(mesh);
    let wider = SHARES
        .map(|share| share * size)
        .into_iter()
        .filter(|t| *t > rounding);
    let (mut fewest, mut best) = (open.len(), None);
    for tolerance in std::iter::once(rounding).chain(wider) {
        let (target, welded) = clusters(mesh, &on_border, tolerance);
        let left = borders(&renamed(&mesh.triangles, &target)).len();
        if left < fewest {
            (fewest, best) = (left, Some((target, welded)));
        }
        if left == 0 {
            break;
        }
    }
    let Some((target, welded)) = best else {
        return Welded::default();
    };
    mesh.triangles = renamed(&mesh.triangles, &target);
    welded
}

/// The triangles that keep three different corners.
fn renamed(triangles: &[[u32; 3]], target: &[u32]) -> Vec<[u32; 3]> {
    triangles
        .iter()
        .map(|t| t.map(|v| target[v as usize]))
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect()
}

/// For each vertex, the one that it becomes.
fn clusters(mesh: &RawMesh, on_border: &[u32], tolerance: f64) -> (Vec<u32>, Welded) {
    let mut target: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    let mut welded = Welded::default();
    if tolerance <= 0.0 {
        return (target, welded);
    }
    let cell_of = |p: &Point3<f64>| [p.x, p.y, p.z].map(|c| (c / tolerance).floor() as i64);
    let mut kept: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for &v in on_border {
        let point = mesh.vertices[v as usize];
        let cell = cell_of(&point);
        let around = (0..27_i64).filter_map(|k| {
            let step = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
            kept.get(&[0, 1, 2].map(|a| cell[a].saturating_add(step[a])))
        });
        let nearest = around
            .flatten()
            .map(|&other| ((mesh.vertices[other as usize] - point).norm(), other))
            .filter(|(distance, _)| *distance <= tolerance)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match nearest {
            Some((distance, other)) => {
                target[v as usize] = other;
                welded.merged += 1;
                welded.moved = welded.moved.max(distance);
                welded.place.get_or_insert(point);
            }
            None => kept.entry(cell).or_default().push(v),
        }
    }
    (target, welded)
}
