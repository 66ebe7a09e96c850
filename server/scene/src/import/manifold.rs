//! Surfaces that touch at an edge or at a vertex, taken apart: each gets vertices of its own there.
//!
//! Where four or more triangles meet at an edge, those that bound the same wedge of material belong together: seen along the edge, a triangle
//! that runs along it looks toward larger angles, one that runs against it toward smaller ones.

use nalgebra::{Point3, Vector3};

use god_object::geometry::connected;

use super::edges::{Side, by_edge, sides};
use super::report::Places;
use crate::mesh_file::RawMesh;

/// Cosine between two sheets that go on around a right angle: 0, and rounding.
const RIGHT_ANGLE: f64 = 1e-6;

/// What was taken apart.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TakenApart {
    /// Middles of edges at which sheets were split.
    pub(super) split: Places,
    /// Vertices that were added, where others are.
    pub(super) vertices: usize,
    pub(super) place: Option<Point3<f64>>,
}

/// An edge at which it cannot be told which triangles belong together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crowded {
    pub(super) triangles: usize,
    /// Middle of the edge.
    pub(super) place: Point3<f64>,
}

/// Gives each surface its own vertices. Vertices without a triangle are gone after that. With `split`, sheets that meet at an edge are taken apart, too.
pub(super) fn take_apart(mesh: &mut RawMesh, split: bool) -> Result<TakenApart, Crowded> {
    let corner_count = 3 * mesh.triangles.len();
    let mut sets = Sets::new(corner_count);
    let all = sides(&mesh.triangles);
    let is_crowded = |group: &[Side]| group.len() > 2;
    let is_sheet = if split && by_edge(&all).any(is_crowded) {
        sheets(&mesh.triangles)
    } else {
        Vec::new()
    };
    let mut done = TakenApart::default();
    for group in by_edge(&all) {
        let has_sheet = |side: &Side| is_sheet.get(side.triangle as usize) == Some(&true);
        let pairs = if is_crowded(group) && group.iter().any(has_sheet) {
            let ends = group[0].ends.map(|v| mesh.vertices[v as usize]);
            done.split.add(nalgebra::center(&ends[0], &ends[1]));
            sheet_pairs(mesh, group, &is_sheet)
        } else {
            pairs(mesh, group)
        };
        let pairs = pairs.ok_or_else(|| Crowded {
            triangles: group.len(),
            place: nalgebra::center(
                &mesh.vertices[group[0].ends[0] as usize],
                &mesh.vertices[group[0].ends[1] as usize],
            ),
        })?;
        for [a, b] in pairs {
            for end in a.ends {
                sets.join(corner_at(mesh, &a, end), corner_at(mesh, &b, end));
            }
        }
    }
    let mut vertices = Vec::new();
    let mut place_of_root = vec![u32::MAX; corner_count];
    let mut used = vec![false; mesh.vertices.len()];
    let mut triangles = mesh.triangles.clone();
    for (t, triangle) in triangles.iter_mut().enumerate() {
        for (k, corner) in triangle.iter_mut().enumerate() {
            let place = &mut place_of_root[sets.root(3 * t + k)];
            let old = *corner as usize;
            if *place == u32::MAX {
                *place = vertices.len() as u32; // at most the number of corners, which 32 bits name
                vertices.push(mesh.vertices[old]);
                if used[old] {
                    done.vertices += 1;
                    done.place.get_or_insert(mesh.vertices[old]);
                }
                used[old] = true;
            }
            *corner = *place;
        }
    }
    *mesh = RawMesh {
        vertices,
        triangles,
    };
    Ok(done)
}

/// The number of the triangle's corner at vertex `v`.
fn corner_at(mesh: &RawMesh, side: &Side, v: u32) -> usize {
    let t = side.triangle as usize;
    let k = mesh.triangles[t].iter().position(|c| *c == v);
    3 * t + k.unwrap_or(0)
}

/// Which sides of an edge belong together; `None` where that cannot be told.
fn pairs(mesh: &RawMesh, group: &[Side]) -> Option<Vec<[Side; 2]>> {
    match *group {
        [_] => return Some(Vec::new()),
        [a, b] => return Some(vec![[a, b]]),
        _ if group.len() % 2 == 1 => return None,
        _ => {}
    }
    let [low, high] = group[0].ends.map(|v| mesh.vertices[v as usize]);
    let along = high - low;
    let arm = |side: &Side| {
        let apex = mesh.triangles[side.triangle as usize][(usize::from(side.corner) + 2) % 3];
        let arm = mesh.vertices[apex as usize] - low;
        arm - along * (arm.dot(&along) / along.norm_squared())
    };
    let first: Vector3<f64> = arm(&group[0]);
    let across = along.cross(&first) / along.norm();
    let mut around: Vec<(f64, Side)> = group
        .iter()
        .map(|side| {
            let arm = arm(side);
            (arm.dot(&across).atan2(arm.dot(&first)), *side)
        })
        .collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0));
    // A side that runs forward has its material before it.
    let begin = usize::from(around[0].1.forward);
    let count = around.len();
    let pair = |k: usize| {
        let [a, b] = [begin + k, begin + k + 1].map(|i| around[i % count].1);
        (!a.forward && b.forward).then_some([a, b])
    };
    (0..count).step_by(2).map(pair).collect()
}

/// Which sides of an edge of sheets belong together; `None` of one with other surfaces that cannot be told apart.
///
/// Sheets and fins end at a closed surface. Those that meet only each other go on where they are the straightest, at most around a right angle.
fn sheet_pairs(mesh: &RawMesh, group: &[Side], is_sheet: &[bool]) -> Option<Vec<[Side; 2]>> {
    let of_sheet = |side: &Side| is_sheet[side.triangle as usize];
    let (sheets, closed): (Vec<Side>, Vec<Side>) = group.iter().partition(|side| of_sheet(side));
    if !closed.is_empty() {
        return pairs(mesh, &closed);
    }
    let arm = |side: &Side| {
        let [low, high] = side.ends.map(|v| mesh.vertices[v as usize]);
        let apex = mesh.triangles[side.triangle as usize][(usize::from(side.corner) + 2) % 3];
        let (along, arm) = (high - low, mesh.vertices[apex as usize] - low);
        let arm: Vector3<f64> = arm - along * (arm.dot(&along) / along.norm_squared());
        arm.try_normalize(0.0).unwrap_or_default()
    };
    let arms: Vec<Vector3<f64>> = sheets.iter().map(arm).collect();
    let mut bends: Vec<(f64, usize, usize)> = Vec::new();
    for a in 0..sheets.len() {
        bends.extend((a + 1..sheets.len()).map(|b| (arms[a].dot(&arms[b]), a, b)));
    }
    // Right angles are not lost to rounding.
    bends.retain(|(cosine, ..)| *cosine <= RIGHT_ANGLE);
    bends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut is_free = vec![true; sheets.len()];
    let mut found = Vec::new();
    for (_, a, b) in bends {
        if is_free[a] && is_free[b] {
            (is_free[a], is_free[b]) = (false, false);
            found.push([sheets[a], sheets[b]]);
        }
    }
    Some(found)
}

/// Triangles of patches that have a border: connected through edges of two triangles, up to edges of one.
fn sheets(triangles: &[[u32; 3]]) -> Vec<bool> {
    let all = sides(triangles);
    let pairs = by_edge(&all).filter(|group| group.len() == 2);
    let pairs = pairs.map(|pair| [pair[0].triangle, pair[1].triangle]);
    let patches = connected(triangles.len(), pairs);
    let mut is_sheet = vec![false; triangles.len()];
    for side in by_edge(&all).filter(|group| group.len() == 1) {
        is_sheet[side[0].triangle as usize] = true;
    }
    for patch in patches {
        let is_open = patch.iter().any(|t| is_sheet[*t as usize]);
        patch.iter().for_each(|t| is_sheet[*t as usize] = is_open);
    }
    is_sheet
}

/// Sets of numbers.
pub(super) struct Sets(Vec<u32>);

impl Sets {
    pub(super) fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    pub(super) fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] as usize != i {
            self.0[i] = self.0[self.0[i] as usize];
            i = self.0[i] as usize;
        }
        i
    }

    pub(super) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b) as u32;
    }
}
