//! An open sheet as a thin solid: the surface half the thickness outward, half inward, and a wall along its border.

use nalgebra::Vector3;

use super::edges::{Side, borders, by_edge, components, sides};
use super::faces::corners;
use super::manifold::Sets;
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
///
/// Which side of a triangle is outside does not count, and a sheet may have one side only: each triangle has two copies, and those of two neighbours are
/// joined that lie on the same side where they meet.
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
    let copies = Copies::of(mesh, &is_open);
    let ways = ways(mesh, &is_open, &copies, thickness / 2.0);
    let normals = (0..mesh.triangles.len()).filter(|t| is_open[*t]);
    done.thinnest = normals
        .flat_map(|t| {
            let (n, ways, copies) = (normal(mesh, &mesh.triangles[t]), &ways, &copies);
            (0..3).map(move |k| 2.0 * ways[copies.root(t, k, 0)].dot(&n))
        })
        .fold(thickness, f64::min);
    let mut place_of = vec![u32::MAX; ways.len()];
    let mut solid = RawMesh::default();
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        if !is_open[t] {
            solid.triangles.push(*triangle);
            continue;
        }
        let mut at = |k: usize, side: usize| {
            let root = copies.root(t, k, side);
            if place_of[root] == u32::MAX {
                place_of[root] = (mesh.vertices.len() + solid.vertices.len()) as u32;
                solid
                    .vertices
                    .push(mesh.vertices[triangle[k] as usize] + ways[root]);
                done.farthest = done.farthest.max(ways[root].norm());
            }
            place_of[root]
        };
        let upper = [0, 1, 2].map(|k| at(k, 0));
        let lower = [0, 2, 1].map(|k| at(k, 1));
        solid.triangles.extend([upper, lower]);
    }
    for side in &open {
        let (t, k) = (side.triangle as usize, usize::from(side.corner));
        let at = |k: usize, side: usize| place_of[copies.root(t, k % 3, side)];
        let [a, b] = [at(k, 0), at(k + 1, 0)];
        solid
            .triangles
            .extend([[b, a, at(k, 1)], [b, at(k, 1), at(k + 1, 1)]]);
    }
    mesh.vertices.append(&mut solid.vertices);
    mesh.triangles = solid.triangles;
    // The sheet itself is no part of the solid.
    *mesh = std::mem::take(mesh).without_unused();
    done
}

fn normal(mesh: &RawMesh, t: &[u32; 3]) -> Vector3<f64> {
    let [a, b, c] = corners(mesh, *t);
    god_object::geometry::face_normal(&[a, b, c]).unwrap_or_default()
}

/// The two copies of every corner of every triangle: 0 where the triangle is seen as it is, 1 on its back. Those that are one vertex have the same root.
struct Copies(Vec<usize>);

impl Copies {
    fn of(mesh: &RawMesh, is_open: &[bool]) -> Self {
        let mut sets = Sets::new(6 * mesh.triangles.len());
        let corner_at = |side: &Side, v: u32| {
            let triangle = mesh.triangles[side.triangle as usize];
            let k = triangle.iter().position(|corner| *corner == v);
            Self::number(side.triangle as usize, k.unwrap_or_default(), 0)
        };
        for pair in by_edge(&sides(&mesh.triangles)) {
            let [a, b] = pair else { continue };
            if !is_open[a.triangle as usize] {
                continue;
            }
            // Triangles that run along an edge the same way see each other's backs.
            let turned = usize::from(a.forward == b.forward);
            for end in a.ends {
                let (a, b) = (corner_at(a, end), corner_at(b, end));
                sets.join(a, b + turned);
                sets.join(a + 1, b + 1 - turned);
            }
        }
        let count = 6 * mesh.triangles.len();
        Self((0..count).map(|copy| sets.root(copy)).collect())
    }

    fn number(triangle: usize, corner: usize, side: usize) -> usize {
        2 * (3 * triangle + corner) + side
    }

    fn root(&self, triangle: usize, corner: usize, side: usize) -> usize {
        self.0[Self::number(triangle, corner, side)]
    }
}

/// Where each vertex of the solid is from its vertex of the sheet, m, by its root.
fn ways(mesh: &RawMesh, is_open: &[bool], copies: &Copies, half: f64) -> Vec<Vector3<f64>> {
    let sheet = || (0..mesh.triangles.len()).filter(|t| is_open[*t]);
    // Weighted by the angle at the vertex: how the sheet is cut into triangles does not count.
    let mut ways = vec![Vector3::zeros(); 6 * mesh.triangles.len()];
    for t in sheet() {
        let triangle = mesh.triangles[t];
        let (n, points) = (normal(mesh, &triangle), corners(mesh, triangle));
        for k in 0..3 {
            let (to, from) = (
                points[(k + 1) % 3] - points[k],
                points[(k + 2) % 3] - points[k],
            );
            let weighted = n * to.angle(&from);
            ways[copies.root(t, k, 0)] += weighted;
            ways[copies.root(t, k, 1)] -= weighted;
        }
    }
    for way in &mut ways {
        *way = way.try_normalize(0.0).unwrap_or_default();
    }
    let mut least_cosine = vec![1.0_f64; ways.len()];
    for t in sheet() {
        let n = normal(mesh, &mesh.triangles[t]);
        for (k, side) in (0..3).flat_map(|k| [(k, 0), (k, 1)]) {
            let root = copies.root(t, k, side);
            let outward = if side == 0 { n } else { -n };
            least_cosine[root] = least_cosine[root].min(ways[root].dot(&outward));
        }
    }
    ways.iter()
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
