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
    /// Least thickness of the wall at a vertex, m: less than what was asked for at creases that are sharper than the miter reaches.
    pub(super) thinnest: f64,
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
    done.thinnest = sheet
        .iter()
        .flat_map(|t| {
            let n = normal(mesh, t);
            let ways = &ways;
            t.iter().map(move |v| 2.0 * ways[*v as usize].dot(&n))
        })
        .fold(thickness, f64::min);
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

fn normal(mesh: &RawMesh, t: &[u32; 3]) -> Vector3<f64> {
    let [a, b, c] = corners(mesh, *t);
    god_object::geometry::face_normal(&[a, b, c]).unwrap_or_default()
}

/// Where each vertex of the sheet goes, m.
fn ways(mesh: &RawMesh, sheet: &[[u32; 3]], half: f64) -> Vec<Vector3<f64>> {
    // Weighted by the angle at the vertex: how the sheet is cut into triangles does not count.
    let mut sums = vec![Vector3::zeros(); mesh.vertices.len()];
    for t in sheet {
        let (n, points) = (normal(mesh, t), corners(mesh, *t));
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
        let n = normal(mesh, t);
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

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// Two flaps of 30 mm that meet at this angle.
    fn fold(degrees: f64) -> RawMesh {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let across = |x: f64, z: f64| [Point3::new(x, 0.0, z), Point3::new(x, 0.03, z)];
        let vertices = [
            across(0.03, 0.0),
            across(0.0, 0.0),
            across(0.03 * cos, 0.03 * sin),
        ];
        RawMesh {
            vertices: vertices.concat(),
            triangles: vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]],
        }
    }

    #[test]
    fn a_crease_too_sharp_for_the_miter_is_told_as_thin() {
        for (degrees, thinnest) in [
            (90.0, 2e-3),
            (61.0, 2e-3),
            (10.0, 4e-3 * 5_f64.to_radians().sin()),
        ] {
            let done = thicken(&mut fold(degrees), 2e-3);
            assert!(
                (done.thinnest - thinnest).abs() < 1e-9,
                "{degrees}: {} m",
                done.thinnest
            );
            assert!(done.farthest <= 2e-3 + 1e-12);
        }
    }
}
