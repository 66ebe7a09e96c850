//! An open sheet as a thin solid: the surface half the thickness outward, half inward, and a wall along its border.

use nalgebra::Vector3;

use super::edges::{borders, components};
use super::faces::corners;
use super::report::Places;
use crate::mesh_file::RawMesh;

/// At a crease a vertex goes farther than half the thickness, so that both faces go half of it; at sharp ones at most so many times as far.
const MOST_MITER: f64 = 2.0;

/// What became a solid.
#[derive(Debug, Default)]
pub(super) struct Thickened {
    /// A vertex of each sheet.
    pub(super) sheets: Places,
    /// Farthest that a vertex is from the sheet, m.
    pub(super) farthest: f64,
}

/// Makes each open sheet a solid of this thickness, m. Parts that are closed stay.
pub(super) fn thicken(mesh: &mut RawMesh, thickness: f64) -> Thickened {
    let mut done = Thickened::default();
    let open = borders(&mesh.triangles);
    let mut is_open = vec![false; mesh.triangles.len()];
    let borders_of: std::collections::HashSet<u32> = open.iter().map(|s| s.triangle).collect();
    for part in components(&mesh.triangles) {
        if part.iter().any(|t| borders_of.contains(t)) {
            done.sheets
                .add(corners(mesh, mesh.triangles[part[0] as usize])[0]);
            part.iter().for_each(|t| is_open[*t as usize] = true);
        }
    }
    let sheet: Vec<[u32; 3]> = mesh
        .triangles
        .iter()
        .zip(&is_open)
        .filter(|(_, open)| **open)
        .map(|(t, _)| *t)
        .collect();
    let ways = ways(mesh, &sheet, thickness / 2.0);
    // The outer copy of a vertex takes its place, the inner copy a new one.
    let mut inner = vec![u32::MAX; mesh.vertices.len()];
    for v in sheet.iter().flatten() {
        let v = *v as usize;
        if inner[v] == u32::MAX {
            inner[v] = mesh.vertices.len() as u32;
            let point = mesh.vertices[v];
            mesh.vertices[v] = point + ways[v];
            mesh.vertices.push(point - ways[v]);
            done.farthest = done.farthest.max(ways[v].norm());
        }
    }
    let at = |v: u32| inner[v as usize];
    let mut new: Vec<[u32; 3]> = sheet
        .iter()
        .map(|t| [at(t[0]), at(t[2]), at(t[1])])
        .collect();
    for side in &open {
        let [a, b] = side.directed();
        new.extend([[b, a, at(a)], [b, at(a), at(b)]]);
    }
    mesh.triangles.extend(new);
    done
}

/// Where each vertex of the sheet goes, m.
fn ways(mesh: &RawMesh, sheet: &[[u32; 3]], half: f64) -> Vec<Vector3<f64>> {
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = corners(mesh, *t);
        god_object::geometry::face_normal(&[a, b, c]).unwrap_or_default()
    };
    // Weighted by the angle at the vertex: how the sheet is cut into triangles does not count.
    let mut sums = vec![Vector3::zeros(); mesh.vertices.len()];
    for t in sheet {
        let (n, points) = (normal(t), corners(mesh, *t));
        for k in 0..3 {
            let (to, from) = (
                points[(k + 1) % 3] - points[k],
                points[(k + 2) % 3] - points[k],
            );
            sums[t[k] as usize] += n * to.angle(&from);
        }
    }
    let unit: Vec<Vector3<f64>> = sums
        .iter()
        .map(|sum| {
            let length = sum.norm();
            if length > 0.0 {
                sum / length
            } else {
                Vector3::zeros()
            }
        })
        .collect();
    let mut least_cosine = vec![1.0_f64; mesh.vertices.len()];
    for t in sheet {
        let n = normal(t);
        for v in t {
            let cosine = unit[*v as usize].dot(&n);
            least_cosine[*v as usize] = least_cosine[*v as usize].min(cosine);
        }
    }
    unit.iter()
        .zip(&least_cosine)
        .map(|(way, cosine)| way * (half / cosine.max(1.0 / MOST_MITER)))
        .collect()
}
