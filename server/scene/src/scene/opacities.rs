//! A body whose looks have several opacities, as several bodies: what is translucent is drawn after all that is not, body by body.

use std::sync::Arc;

use super::built::BuiltBody;
use crate::appearance::Appearance;
use crate::mesh_file::{BodyTextures, RawMesh};

/// Most bodies that one is drawn as: those beside it that move count among those that a state tells of.
const MOST: usize = 4;

/// What one body has alike all over: the renderer draws a body as opaque or as translucent.
#[derive(Clone, Copy, PartialEq)]
struct Transparency {
    opacity: f32,
    /// Its texture has an opacity of its own.
    by_texture: bool,
}

/// The body by the opacities of its looks, that of the largest area first and of the body's name. One with more than [`MOST`] of them keeps those of the
/// largest areas; what has another has the nearest of these.
pub(super) fn by_opacity(body: BuiltBody) -> Vec<BuiltBody> {
    let usual = body.appearance.opacity.unwrap_or(1.0);
    let textures = body.textures.iter().flat_map(|textures| &textures.list);
    let see_through: Vec<bool> = textures.map(|one| !one.texture.is_opaque()).collect();
    let kind = |(place, (look, _)): (usize, &(Appearance, usize))| Transparency {
        opacity: look.opacity.unwrap_or(usual),
        by_texture: texture_of(&body, place).is_some_and(|texture| see_through[texture]),
    };
    let of_parts: Vec<Transparency> = body.looks.iter().enumerate().map(kind).collect();
    let mut kinds: Vec<(Transparency, f64)> = Vec::new();
    for (kind, area) in of_parts.iter().zip(areas(&body)) {
        match kinds.iter_mut().find(|(known, _)| known == kind) {
            Some((_, sum)) => *sum += area,
            None => kinds.push((*kind, area)),
        }
    }
    // Stable: the first of equal ones stays before.
    kinds.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    kinds.truncate(MOST);
    let nearest = |of: &Transparency| {
        let apart = |(kind, _): &(Transparency, f64)| {
            f32::from(u8::from(kind.by_texture != of.by_texture))
                + (kind.opacity - of.opacity).abs()
        };
        let places = 0..kinds.len();
        places.min_by(|a, b| apart(&kinds[*a]).total_cmp(&apart(&kinds[*b])))
    };
    let of_parts: Vec<Option<usize>> = of_parts.iter().map(nearest).collect();
    match kinds.as_slice() {
        [] => vec![body],
        [(only, _)] => vec![BuiltBody {
            appearance: with_opacity(&body, *only),
            ..body
        }],
        several => (0..several.len())
            .map(|number| part(&body, several[number].0, number, &of_parts))
            .collect(),
    }
}

fn with_opacity(body: &BuiltBody, kind: Transparency) -> Appearance {
    // What nobody has said stays so.
    let is_usual = body.appearance.opacity.is_none() && kind.opacity >= 1.0;
    Appearance {
        opacity: (!is_usual).then_some(kind.opacity),
        ..body.appearance
    }
}

/// Place of the texture of a run of triangles in the body's list.
fn texture_of(body: &BuiltBody, part: usize) -> Option<usize> {
    *body.textures.as_ref()?.of_looks.get(part)?
}

/// Of each run of triangles, m^2.
fn areas(body: &BuiltBody) -> Vec<f64> {
    let mut triangles = body.mesh.triangles.iter();
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| body.mesh.vertices[v as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let runs = body.looks.iter();
    runs.map(|(_, count)| triangles.by_ref().take(*count).map(area).sum())
        .collect()
}

/// What of a body has its looks at place `number`.
fn part(
    body: &BuiltBody,
    kind: Transparency,
    number: usize,
    of_parts: &[Option<usize>],
) -> BuiltBody {
    let is_in = |part: usize| of_parts[part] == Some(number);
    let of_triangles = body.looks.iter().enumerate();
    let of_triangles =
        of_triangles.flat_map(|(part, (_, count))| std::iter::repeat_n(part, *count));
    let of_triangles: Vec<usize> = of_triangles.collect();
    let triangles = body.mesh.triangles.iter().zip(&of_triangles);
    let triangles = triangles.filter(|(_, part)| is_in(**part)).map(|(t, _)| *t);
    let mesh = RawMesh {
        vertices: body.mesh.vertices.clone(),
        triangles: triangles.collect(),
    };
    let parts: Vec<usize> = (0..body.looks.len()).filter(|part| is_in(*part)).collect();
    let name = match number {
        0 => body.name.clone(),
        _ => format!("{} = {}", body.name, number + 1), // of no other: `=` is in no name of a scene
    };
    BuiltBody {
        name,
        mesh: mesh.without_unused(),
        pose: body.pose,
        appearance: with_opacity(body, kind),
        looks: parts.iter().map(|part| body.looks[*part]).collect(),
        textures: textures(body, &parts, |triangle| is_in(of_triangles[triangle])),
    }
}

/// The textures of some looks, and where the triangles that are theirs lie in them.
fn textures(
    body: &BuiltBody,
    parts: &[usize],
    is_theirs: impl Fn(usize) -> bool,
) -> Option<Arc<BodyTextures>> {
    let all = body.textures.as_ref()?;
    let of_looks: Vec<Option<usize>> = parts.iter().map(|part| texture_of(body, *part)).collect();
    let mut used: Vec<usize> = of_looks.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let new = |place: usize| used.iter().position(|used| *used == place);
    let coordinates = all.coordinates.iter().enumerate();
    let coordinates = coordinates.filter(|(triangle, _)| is_theirs(*triangle));
    (!used.is_empty()).then(|| {
        Arc::new(BodyTextures {
            list: used.iter().map(|place| all.list[*place].clone()).collect(),
            of_looks: of_looks.iter().map(|place| place.and_then(new)).collect(),
            coordinates: coordinates.map(|(_, corners)| *corners).collect(),
        })
    })
}
