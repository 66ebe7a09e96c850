//! Which side of a surface is outside: triangles that disagree with their neighbours are turned, then closed parts by their nesting.

use god_object::geometry::closed_parts;
use nalgebra::Point3;

use super::edges::{Side, by_edge, neighbours, sides};
use super::faces::middle;
use super::report::Places;
use crate::mesh_file::RawMesh;

/// A surface with one side only: no way to turn its triangles lets them agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OneSided {
    /// An edge where they do not agree.
    pub(super) place: Point3<f64>,
}

/// What was done so that triangles agree.
#[derive(Debug, Default)]
pub(super) struct Agreement {
    /// Middles of the triangles that were turned.
    pub(super) turned: Places,
    /// Places on open sheets of one side, which were left as they are.
    pub(super) one_sided: Places,
}

/// Lets the triangles of each connected surface agree about outside, turning the fewer of them. `sheets` may have one side only, if they are open.
pub(super) fn agree(mesh: &mut RawMesh, sheets: bool) -> Result<Agreement, OneSided> {
    let all = sides(&mesh.triangles);
    let mut beside: Vec<[Option<(u32, bool)>; 3]> = vec![[None; 3]; mesh.triangles.len()];
    for group in by_edge(&all) {
        if let [a, b] = group {
            let mut link = |from: &Side, to: &Side| {
                beside[from.triangle as usize][usize::from(from.corner)] =
                    Some((to.triangle, from.forward == to.forward));
            };
            link(a, b);
            link(b, a);
        }
    }
    let mut done = Agreement::default();
    let mut turned: Vec<Option<bool>> = vec![None; mesh.triangles.len()];
    for start in 0..mesh.triangles.len() {
        if turned[start].is_some() {
            continue;
        }
        turned[start] = Some(false);
        let (mut surface, mut next) = (vec![start], 0);
        let mut disagreement = None;
        while let Some(&t) = surface.get(next) {
            next += 1;
            for (corner, (other, same_way)) in beside[t]
                .iter()
                .enumerate()
                .filter_map(|(k, link)| Some((k, (*link)?)))
            {
                let wanted = turned[t].map(|way| way != same_way);
                let other = other as usize;
                if turned[other].is_none() {
                    turned[other] = wanted;
                    surface.push(other);
                } else if turned[other] != wanted {
                    let t = mesh.triangles[t];
                    let ends = [t[corner], t[(corner + 1) % 3]].map(|v| mesh.vertices[v as usize]);
                    disagreement.get_or_insert(nalgebra::center(&ends[0], &ends[1]));
                }
            }
        }
        if let Some(place) = disagreement {
            let is_open = surface.iter().any(|t| beside[*t].contains(&None));
            if !(sheets && is_open) {
                return Err(OneSided { place });
            }
            done.one_sided.add(place);
            surface.iter().for_each(|t| turned[*t] = Some(false));
        }
        let against = surface.iter().filter(|t| turned[**t] == Some(true)).count();
        if 2 * against > surface.len() {
            for t in surface {
                turned[t] = turned[t].map(|way| !way);
            }
        }
    }
    for (t, turned) in turned.iter().enumerate() {
        if *turned == Some(true) {
            done.turned.add(middle(mesh, mesh.triangles[t]));
            mesh.triangles[t].swap(1, 2);
        }
    }
    Ok(done)
}

/// What the nesting of closed parts came to.
#[derive(Debug, Default)]
pub(super) struct Nesting {
    pub(super) parts: usize,
    /// Middles of the parts that were turned, and their triangles.
    pub(super) turned: Places,
    pub(super) turned_triangles: Vec<u32>,
    /// Middles of the walls of cavities.
    pub(super) cavities: Places,
}

/// Turns each part of a closed surface outward; one that lies within an odd number of others is the wall of a cavity and looks inward.
pub(super) fn turn_outward(mesh: &mut RawMesh) -> Nesting {
    let adjacent = neighbours(&mesh.triangles);
    let parts = closed_parts(&mesh.vertices, &mesh.triangles, adjacent.into_iter());
    let mut nesting = Nesting {
        parts: parts.len(),
        ..Nesting::default()
    };
    for part in parts {
        let is_cavity = part.depth % 2 == 1;
        if is_cavity {
            nesting.cavities.add(part.center);
        }
        if (part.volume < 0.0) != is_cavity {
            nesting.turned.add(part.center);
            for t in &part.triangles {
                mesh.triangles[*t as usize].swap(1, 2);
            }
            nesting.turned_triangles.extend(part.triangles);
        }
    }
    nesting
}
