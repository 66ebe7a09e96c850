//! Triangles that are no part of a surface: those without area, and copies of others.

use std::collections::HashMap;

use god_object::geometry::face_normal;
use nalgebra::Point3;

use super::edges::{by_edge, components, sides};
use super::report::Places;
use crate::mesh_file::RawMesh;

/// The corners of a triangle.
pub(super) fn corners(mesh: &RawMesh, t: [u32; 3]) -> [Point3<f64>; 3] {
    t.map(|v| mesh.vertices[v as usize])
}

/// The middle of a triangle.
pub(super) fn middle(mesh: &RawMesh, t: [u32; 3]) -> Point3<f64> {
    let [a, b, c] = corners(mesh, t).map(|p| p.coords);
    Point3::from((a + b + c) / 3.0)
}

/// Removes triangles without area, to rounding. Where such a triangle had three corners it leaves a corner on another's side, for
/// [`stitch`](super::stitch).
pub(super) fn remove_without_area(mesh: &mut RawMesh) -> Places {
    let mut places = Places::default();
    let all = std::mem::take(&mut mesh.triangles);
    let kept = all.into_iter().filter(|t| {
        let sound = face_normal(&corners(mesh, *t)).is_some();
        if !sound {
            places.add(middle(mesh, *t));
        }
        sound
    });
    let kept: Vec<[u32; 3]> = kept.collect();
    mesh.triangles = kept;
    places
}

/// What was removed of triangles that lie on each other.
#[derive(Debug, Default)]
pub(super) struct Duplicates {
    /// Copies that look the same way as another.
    pub(super) copies: Places,
    /// Pairs of triangles back to back between two bodies that touch: with both gone, the bodies are one.
    pub(super) walls: Places,
    /// Copies that look the other way than a triangle of a sheet, or one with a neighbour too many.
    pub(super) backs: Places,
}

/// Removes triangles with the same three corners as another.
///
/// Two that lie back to back are an inner wall where all their edges are even without them; both go. Where nothing but such pairs hangs
/// together, it is a sheet that was written twice; one of each pair stays.
pub(super) fn remove_duplicates(mesh: &mut RawMesh) -> Duplicates {
    let mut found = Duplicates::default();
    // The first triangle of each kind: by corners, and by the way it looks.
    let mut first: HashMap<[u32; 3], [Option<u32>; 2]> = HashMap::new();
    let mut keep = vec![true; mesh.triangles.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let (key, odd) = sorted(*triangle);
        let place = &mut first.entry(key).or_default()[usize::from(odd)];
        if place.is_some() {
            keep[t] = false;
            found.copies.add(middle(mesh, *triangle));
        } else {
            *place = Some(t as u32);
        }
    }
    retain(mesh, &keep);
    if first.values().all(|both| both.contains(&None)) {
        return found;
    }
    remove_opposite_pairs(mesh, &mut found);
    found
}

fn remove_opposite_pairs(mesh: &mut RawMesh, found: &mut Duplicates) {
    let mut partner: HashMap<[u32; 3], u32> = HashMap::new();
    let mut pair_of = vec![None; mesh.triangles.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let (key, _) = sorted(*triangle);
        match partner.get(&key) {
            None => {
                partner.insert(key, t as u32);
            }
            Some(&other) => {
                pair_of[t] = Some(other);
                pair_of[other as usize] = Some(t as u32);
            }
        }
    }
    let mut crowded_oddly = vec![false; mesh.triangles.len()];
    for group in by_edge(&sides(&mesh.triangles)).filter(|group| group.len() % 2 == 1) {
        for side in group {
            crowded_oddly[side.triangle as usize] = true;
        }
    }
    let mut is_sheet = vec![false; mesh.triangles.len()];
    for component in components(&mesh.triangles) {
        if component.iter().all(|t| pair_of[*t as usize].is_some()) {
            component.iter().for_each(|t| is_sheet[*t as usize] = true);
        }
    }
    let mut keep = vec![true; mesh.triangles.len()];
    for (t, other) in pair_of.iter().enumerate() {
        let Some(other) = *other else { continue };
        let is_second = other < t as u32;
        let one_stays = is_sheet[t] || crowded_oddly[t];
        keep[t] = one_stays && !is_second;
        if is_second {
            let place = middle(mesh, mesh.triangles[t]);
            let kind = if one_stays {
                &mut found.backs
            } else {
                &mut found.walls
            };
            kind.add(place);
        }
    }
    retain(mesh, &keep);
}

/// The corners, ascending, and whether an odd permutation led there.
fn sorted([a, b, c]: [u32; 3]) -> ([u32; 3], bool) {
    let mut key = [a, b, c];
    key.sort_unstable();
    let turned = [[a, b, c], [b, c, a], [c, a, b]].contains(&key);
    (key, !turned)
}

fn retain(mesh: &mut RawMesh, keep: &[bool]) {
    let mut keep = keep.iter();
    mesh.triangles
        .retain(|_| keep.next().copied().unwrap_or(true));
}
