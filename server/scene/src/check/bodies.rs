//! What is worth a look in the bodies of a scene: their surfaces and sizes.

use std::collections::{HashMap, HashSet};

use god_object::Mesh;

use super::lengths::length_text;
use super::surface::judge_mesh;
use crate::document::At;
use crate::import::LengthUnit;
use crate::problem::Problem;
use crate::scene::{BuiltScene, GOD_OBJECT_NAME, Scene, Shape, unusable};

/// A body longer than this, m, is probably in millimetres; a shorter one was probably scaled twice.
pub(crate) const SUSPICIOUS_SIZES: [f64; 2] = [5e-4, 5.0];

/// What was found about the bodies whose form is from mesh files.
#[derive(Debug, Default)]
pub(super) struct Bodies {
    pub(super) problems: Vec<Problem>,
    pub(super) notes: Vec<String>,
    /// Name and longest side of each.
    pub(super) sizes: Vec<String>,
}

/// Looks at the meshes that are felt: scaled, simplified.
pub(super) fn look_at(scene: &Scene, built: &BuiltScene) -> Bodies {
    let mut found = Bodies::default();
    let meshes: HashMap<&str, &Mesh> = felt(built).collect();
    // A form that several bodies have is judged once.
    let mut judged = HashSet::new();
    for (name, shape, at) in scene.bodies_from_files() {
        let Some(mesh) = meshes.get(name) else {
            continue;
        };
        let [low, high] = mesh.bounding_box();
        let longest = (high - low).max();
        found.sizes.push(format!("{name} {}", length_text(longest)));
        found.notes.extend(doubt_in_scene(name, shape, longest));
        if judged.insert(format!("{shape:?}")) {
            judge_body(shape, at, mesh, &mut found);
        }
    }
    found
}

/// What is felt of each body, by its name: the god-object first.
pub(super) fn felt(built: &BuiltScene) -> impl Iterator<Item = (&str, &Mesh)> {
    let obstacles = built.world.obstacles.iter();
    let obstacles = obstacles.map(|obstacle| (obstacle.name.as_str(), &obstacle.mesh));
    std::iter::once((GOD_OBJECT_NAME, &built.world.body.mesh)).chain(obstacles)
}

fn judge_body(shape: &Shape, at: &At, mesh: &Mesh, found: &mut Bodies) {
    let file = shape.file().unwrap_or_default();
    let judged = judge_mesh(mesh, file);
    let faults = judged.faults.iter();
    found
        .problems
        .extend(faults.map(|fault| unusable(at, file, fault)));
    let notes = judged.notes.iter();
    found
        .notes
        .extend(notes.map(|note| format!("\"{file}\": {note}")));
}

/// Whether a longest side, m, is none that a hand can hold.
fn is_doubtful(longest: f64) -> bool {
    let [least, most] = SUSPICIOUS_SIZES;
    let usual = (least..=most).contains(&longest);
    !usual
}

/// What to ask about the longest side of a body, m, where it is none that a hand can hold.
fn doubt_in_scene(body: &str, shape: &Shape, longest: f64) -> Option<String> {
    let Shape::Mesh {
        scale, is_scaled, ..
    } = shape
    else {
        return None;
    };
    if !is_doubtful(longest) {
        return None;
    }
    let advice = match (is_scaled, longest > 1.0) {
        (false, true) => {
            "if the file is in millimetres, write unit = \"mm\" beside mesh in the scene".to_owned()
        }
        (false, false) => {
            "if that is not what is meant, name the file's unit or a scale beside mesh in the scene"
                .to_owned()
        }
        (true, true) => format!(
            "`unit` and `scale` beside mesh in the scene multiply the file's {} by {scale}; check both",
            short(longest / scale)
        ),
        (true, false) => format!(
            "`unit` and `scale` beside mesh in the scene multiply the file's {} by {scale}; if the file is in metres, write no unit and no scale",
            short(longest / scale)
        ),
    };
    Some(format!(
        "the longest side of {body} is {}; {advice}",
        length_text(longest)
    ))
}

/// What to say of the unit of a mesh file that names none, and of its longest side, m. `named` is what the user said.
pub(super) fn doubt_in_file(
    is_gltf: bool,
    named: Option<LengthUnit>,
    longest: f64,
) -> Option<String> {
    let size = length_text(longest);
    let millimetres = longest > 1.0;
    Some(match (is_gltf, named, is_doubtful(longest)) {
        (true, _, false) | (false, Some(_), false) => return None,
        (true, _, true) => format!(
            "the longest side of the mesh is {size}: glTF is in metres; if that is not what is meant, export it in metres, or write unit or scale beside mesh in the scene"
        ),
        (false, None, false) => format!(
            "the file names no unit: taken as m, which makes its longest side {size}; --unit says another"
        ),
        (false, None, true) if millimetres => format!(
            "the file names no unit: taken as m, which makes its longest side {size}; if it is in millimetres, check it with --unit mm, and write unit = \"mm\" beside mesh in the scene"
        ),
        (false, None, true) => format!(
            "the file names no unit: taken as m, which makes its longest side {size}; if it is in another, check it with --unit, and write unit beside mesh in the scene"
        ),
        (false, Some(unit), true) => format!(
            "in {} the longest side of the mesh is {size}, which no hand holds; check the unit",
            unit.name
        ),
    })
}

/// At most seven digits.
fn short(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}
