//! How a body of several files looks: what each file says, and what of it cannot be drawn.

use std::sync::Arc;

use taut_proto::mesh_blob::MAX_LOOKS;

use super::body::Member;
use super::visual::Visual;
use crate::appearance::Appearance;
use crate::mesh_file::{BodyTextures, RawMesh};

/// What a body looks like.
pub(super) struct BodyLook {
    /// Of the file of the largest area.
    pub(super) appearance: Appearance,
    /// What is drawn instead, where its triangles do not all look alike.
    pub(super) visual: Option<Visual>,
    /// What of the files' looks is not drawn.
    pub(super) lost: Option<String>,
}

/// The look of the body whose mesh is written into `body_file`.
pub(super) fn look_of(members: &[Member], body_file: &str) -> BodyLook {
    // The first of several equal ones.
    let largest = members
        .iter()
        .reduce(|a, b| if b.area() > a.area() { b } else { a });
    let appearance = largest.map_or_else(Appearance::default, |member| member.look.appearance);
    let mut lost = Vec::new();
    for member in members {
        let none = RawMesh::default();
        let drawn = member.as_read.as_ref().unwrap_or(&none);
        if let Some(of_file) = member.look.not_drawn(&Appearance::default(), drawn) {
            let name = &member.name;
            lost.push(match members {
                [_] => of_file,
                _ => format!("of {name}: {of_file}"),
            });
        }
    }
    let name = largest.map_or("", |member| &member.name);
    let runs: Vec<Vec<(Appearance, usize)>> = members.iter().map(runs).collect();
    let mut looks: Vec<Appearance> = Vec::new();
    for (look, _) in runs.iter().flatten() {
        if looks.len() <= MAX_LOOKS && !looks.contains(look) {
            looks.push(*look);
        }
    }
    let textures = textures(members, &runs);
    let visual = match looks.len() {
        0 | 1 if textures.is_none() => None,
        0..=MAX_LOOKS => Some(drawn(members, &runs, textures, body_file)),
        _ => {
            lost.push(format!(
                "more than {MAX_LOOKS} looks: all of the body has that of {name}"
            ));
            None
        }
    };
    BodyLook {
        appearance,
        visual,
        lost: (!lost.is_empty()).then(|| lost.join(", ")),
    }
}

/// Lengths of runs of its triangles, with how each looks; one that is opaque says nothing of it.
fn runs(member: &Member) -> Vec<(Appearance, usize)> {
    let own = member.look.appearance.opacity;
    let opacity = |of_part: Option<f32>| of_part.or(own).filter(|opacity| *opacity < 1.0);
    let of_file = |mesh| member.look.drawn_parts(&Appearance::default(), mesh);
    let of_file = member.as_read.as_ref().map(of_file).unwrap_or_default();
    let all = match of_file.is_empty() {
        true => vec![(member.look.appearance, member.felt.triangles.len())],
        false => of_file,
    };
    let with_opacity = |(look, count): (Appearance, usize)| {
        let opacity = opacity(look.opacity);
        (Appearance { opacity, ..look }, count)
    };
    all.into_iter().map(with_opacity).collect()
}

/// The textures of these runs; `None` where there are none.
fn textures(members: &[Member], runs: &[Vec<(Appearance, usize)>]) -> Option<BodyTextures> {
    let mut all = BodyTextures {
        list: Vec::new(),
        of_looks: Vec::new(),
        coordinates: Vec::new(),
    };
    for (member, runs) in members.iter().zip(runs) {
        let of_file = |mesh| member.look.drawn_textures(&Appearance::default(), mesh);
        match member.as_read.as_ref().and_then(of_file) {
            Some(own) => {
                let first = all.list.len();
                let of_looks = own.of_looks.iter();
                all.of_looks
                    .extend(of_looks.map(|place| place.map(|place| first + place)));
                all.list.extend(own.list.iter().cloned());
                all.coordinates.extend(&own.coordinates);
            }
            None => {
                let triangles: usize = runs.iter().map(|(_, count)| count).sum();
                all.of_looks.extend(runs.iter().map(|_| None));
                all.coordinates
                    .resize(all.coordinates.len() + triangles, Default::default());
            }
        }
    }
    (!all.list.is_empty()).then_some(all)
}

/// The surfaces of the files as they were, and what is felt of those that are no more as they were or look the same all over.
fn drawn(
    members: &[Member],
    runs: &[Vec<(Appearance, usize)>],
    textures: Option<BodyTextures>,
    body_file: &str,
) -> Visual {
    let mut all = RawMesh::default();
    for member in members {
        all.append(member.as_read.as_ref().unwrap_or(&member.felt));
    }
    Visual::new(all, runs.concat(), textures.map(Arc::new), body_file)
}
