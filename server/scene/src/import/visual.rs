//! What is drawn of a part whose triangles do not all look alike: the surface of its file, as it was, beside the one that is felt.

use std::fmt::Write as _;

use nalgebra::Vector3;

use crate::appearance::{Appearance, encoded};
use crate::mesh_file::{FileLook, RawMesh};

/// A surface with looks.
#[derive(Clone, Debug)]
pub(super) struct Visual {
    mesh: RawMesh,
    /// Lengths of runs of its triangles, with how each looks.
    parts: Vec<(Appearance, usize)>,
    /// Name of its files, without an ending.
    name: String,
}

impl Visual {
    /// Of a part's file, where that says more than one look; `placed` brings its mesh to where the part stands.
    pub(super) fn of(
        mesh: RawMesh,
        look: &FileLook,
        body_file: &str,
        placed: impl FnOnce(RawMesh) -> RawMesh,
    ) -> Option<Self> {
        let parts = look.drawn_parts(&Appearance::default(), &mesh);
        let stem = body_file
            .rsplit_once('.')
            .map_or(body_file, |(stem, _)| stem);
        (!parts.is_empty()).then(|| Self {
            mesh: placed(mesh),
            parts,
            name: format!("{stem}-visual"),
        })
    }

    pub(super) fn move_by(&mut self, way: &Vector3<f64>) {
        for vertex in &mut self.mesh.vertices {
            *vertex += way;
        }
    }

    /// The file that a scene names.
    pub(super) fn file(&self) -> String {
        format!("{}.obj", self.name)
    }

    /// Its files, by name: surface and materials.
    pub(super) fn files(&self) -> [(String, String); 2] {
        let mut materials = String::new();
        let mut looks: Vec<Appearance> = Vec::new();
        let library = format!("{}.mtl", self.name);
        let mut surface = format!("mtllib {library}\n");
        // Writing to a String cannot fail.
        for vertex in &self.mesh.vertices {
            let _ = writeln!(surface, "v {:?} {:?} {:?}", vertex.x, vertex.y, vertex.z);
        }
        let mut triangles = self.mesh.triangles.iter();
        for (look, count) in &self.parts {
            let known = looks.iter().position(|known| known == look);
            let number = known.unwrap_or_else(|| {
                looks.push(*look);
                write_material(&mut materials, looks.len() - 1, look);
                looks.len() - 1
            });
            let _ = writeln!(surface, "usemtl look-{number}");
            for [a, b, c] in triangles.by_ref().take(*count) {
                let _ = writeln!(surface, "f {} {} {}", a + 1, b + 1, c + 1);
            }
        }
        [(self.file(), surface), (library, materials)]
    }
}

fn write_material(text: &mut String, number: usize, look: &Appearance) {
    let _ = writeln!(text, "newmtl look-{number}");
    if let Some(colour) = look.color {
        let [red, green, blue] = colour.map(|part| encoded(f64::from(part)));
        let _ = writeln!(text, "Kd {red:.6} {green:.6} {blue:.6}");
    }
    for (key, value) in [("Pr", look.roughness), ("Pm", look.metallic)] {
        if let Some(value) = value {
            let _ = writeln!(text, "{key} {value:?}");
        }
    }
}
