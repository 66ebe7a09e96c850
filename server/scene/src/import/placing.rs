//! How parts lie in the scene: which way is up in their files, and parts that are far from the origin.

use std::str::FromStr;

use nalgebra::{Point3, Vector3};

use super::body::Body;
use super::request::{ImportPart, ImportRequest};
use crate::check::place_text;
use crate::mesh_file::{RawMesh, is_gltf_path};

/// Parts whose middle is farther from the origin than so many of their diagonals are moved there together.
const FAR_AWAY: f64 = 2.0;

/// Which way is up in a part's file. In a scene it is +z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpAxis {
    /// +y, as in glTF.
    Y,
    /// +z.
    Z,
}

impl FromStr for UpAxis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "y" => Ok(Self::Y),
            "z" => Ok(Self::Z),
            _ => Err("write y or z".to_owned()),
        }
    }
}

/// The part as it stands in the scene. A quarter of a turn about x: no digit changes.
pub(super) fn upright(mut mesh: RawMesh, up: Option<UpAxis>) -> RawMesh {
    if up == Some(UpAxis::Y) {
        for vertex in &mut mesh.vertices {
            *vertex = Point3::new(vertex.x, -vertex.z, vertex.y);
        }
    }
    mesh
}

/// Says that parts were turned, or that they may have to be.
pub(super) fn note_up(request: &ImportRequest, notes: &mut Vec<String>) {
    let up_of = |part: &&ImportPart| request.up_of(part);
    let turned: Vec<&ImportPart> = request
        .parts
        .iter()
        .filter(|part| up_of(part) == Some(UpAxis::Y))
        .collect();
    if turned.len() == request.parts.len() {
        notes.push("the parts were turned: +y of their files is +z of the scene; places above are those in the files".to_owned());
    } else if !turned.is_empty() {
        let names: Vec<String> = turned
            .iter()
            .map(|part| part.path.display().to_string())
            .collect();
        notes.push(format!(
            "{} turned: +y of these files is +z of the scene; places above are those in the files, and of a body of files with both those in the scene",
            names.join(", ")
        ));
    }
    let doubtful = |part: &ImportPart| is_gltf_path(&part.path) && up_of(&part).is_none();
    if request.parts.iter().any(doubtful) {
        notes.push("up is +y in glTF and +z in a scene; nothing was turned: write --up y to set the parts upright, or --up z if they are".to_owned());
    }
}

/// Bodies keep their places to each other; only when all are far away, all are moved by the same way.
pub(super) fn move_to_origin(bodies: &mut [Body], notes: &mut Vec<String>) {
    let boxes = bodies.iter().filter_map(|body| body.mesh.bounds());
    let Some((low, high)) = boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1))) else {
        return;
    };
    let way: Vector3<f64> = -nalgebra::center(&low, &high).coords;
    if way.norm() <= FAR_AWAY * (high - low).norm() {
        return;
    }
    for body in bodies {
        for vertex in &mut body.mesh.vertices {
            *vertex += way;
        }
        if let Some(visual) = &mut body.visual {
            visual.move_by(&way);
        }
    }
    notes.push(format!(
        "the parts lie far from the origin of their files; all were moved by the same {}, and places above are those before",
        place_text(&Point3::from(way))
    ));
}
