//! How parts lie in the scene: which way is up in their files, and parts that are far from the origin.

use std::str::FromStr;

use nalgebra::{Point3, Vector3};

use super::ImportRequest;
use super::report::PartReport;
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
    let any_gltf = request.parts.iter().any(|path| is_gltf_path(path));
    let text = match request.up {
        Some(UpAxis::Y) => {
            "the parts were turned: +y of their files is +z of the scene; places above are those in the files"
        }
        None if any_gltf => {
            "up is +y in glTF and +z in a scene; nothing was turned: write --up y to set the parts upright, or --up z if they are"
        }
        _ => return,
    };
    notes.push(text.to_owned());
}

/// Parts keep their places to each other; only when all are far away, all are moved by the same way, which is given.
pub(super) fn move_to_origin(
    parts: &mut [(PartReport, RawMesh)],
    notes: &mut Vec<String>,
) -> Option<Vector3<f64>> {
    let boxes = parts.iter().filter_map(|(_, mesh)| mesh.bounds());
    let (low, high) = boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))?;
    let way: Vector3<f64> = -nalgebra::center(&low, &high).coords;
    if way.norm() <= FAR_AWAY * (high - low).norm() {
        return None;
    }
    for vertex in parts.iter_mut().flat_map(|(_, mesh)| &mut mesh.vertices) {
        *vertex += way;
    }
    notes.push(format!(
        "the parts lie far from the origin of their files; all were moved by the same {}, and places above are those before",
        place_text(&Point3::from(way))
    ));
    Some(way)
}
