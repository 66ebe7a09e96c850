//! What is drawn of a part whose triangles do not all look alike, or have pictures on them: the surface of its file, as it was, beside the one that is felt.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::sync::Arc;

use nalgebra::Vector3;
use taut_proto::Wrap;

use crate::appearance::{Appearance, encoded};
use crate::mesh_file::{BodyTexture, BodyTextures, RawMesh};

/// A surface with looks.
#[derive(Clone, Debug)]
pub(super) struct Visual {
    mesh: RawMesh,
    /// Lengths of runs of its triangles, with how each looks.
    parts: Vec<(Appearance, usize)>,
    /// Textures of these.
    textures: Option<Arc<BodyTextures>>,
    /// Name of its files, without an ending.
    name: String,
}

impl Visual {
    /// Of a body that is written into `body_file`; all triangles are in the runs.
    pub(super) fn new(
        mesh: RawMesh,
        parts: Vec<(Appearance, usize)>,
        textures: Option<Arc<BodyTextures>>,
        body_file: &str,
    ) -> Self {
        let stem = body_file
            .rsplit_once('.')
            .map_or(body_file, |(stem, _)| stem);
        Self {
            mesh,
            parts,
            textures,
            name: format!("{stem}-visual"),
        }
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

    /// Its files, by name: surface, materials and pictures.
    pub(super) fn files(&self) -> Vec<(String, Vec<u8>)> {
        let mut materials = String::new();
        let mut looks: Vec<(Appearance, Option<usize>)> = Vec::new();
        let library = format!("{}.mtl", self.name);
        let mut surface = format!("mtllib {library}\n");
        // Writing to a String cannot fail.
        for vertex in &self.mesh.vertices {
            let _ = writeln!(surface, "v {:?} {:?} {:?}", vertex.x, vertex.y, vertex.z);
        }
        let (mut places, mut coordinates) = (HashMap::new(), self.corners());
        let mut triangles = self.mesh.triangles.iter();
        for (part, (look, count)) in self.parts.iter().enumerate() {
            let texture = self.textures.as_ref();
            let texture = texture.and_then(|all| Some((all, (*all.of_looks.get(part)?)?)));
            let look = (*look, texture.map(|(_, texture)| texture));
            let known = looks.iter().position(|known| *known == look);
            let number = known.unwrap_or_else(|| {
                looks.push(look);
                write_material(&mut materials, looks.len() - 1, &look.0);
                if let Some((all, texture)) = texture {
                    let picture = self.picture(texture, &all.list);
                    write_map(&mut materials, &picture, &all.list[texture]);
                }
                looks.len() - 1
            });
            let _ = writeln!(surface, "usemtl look-{number}");
            for triangle in triangles.by_ref().take(*count) {
                let placed = coordinates.next().filter(|_| texture.is_some());
                let Some(placed) = placed else {
                    let [a, b, c] = triangle.map(|vertex| vertex + 1);
                    let _ = writeln!(surface, "f {a} {b} {c}");
                    continue;
                };
                // Each place once, before the face that names it.
                let [p, q, r] = placed.map(|place| {
                    let next = places.len() + 1;
                    *places.entry(place.map(f32::to_bits)).or_insert_with(|| {
                        let [u, v] = place.map(f64::from);
                        let _ = writeln!(surface, "vt {u:?} {:?}", 1.0 - v);
                        next
                    })
                });
                let [a, b, c] = triangle.map(|vertex| vertex + 1);
                let _ = writeln!(surface, "f {a}/{p} {b}/{q} {c}/{r}");
            }
        }
        let texts = [(self.file(), surface), (library, materials)];
        let texts = texts.map(|(name, text)| (name, text.into_bytes()));
        texts.into_iter().chain(self.pictures()).collect()
    }

    fn corners(&self) -> impl Iterator<Item = [[f32; 2]; 3]> {
        let textures = self.textures.iter();
        textures.flat_map(|textures| textures.coordinates.iter().copied())
    }

    /// The pictures, as they were in the part's file; one that goes on in two ways is one.
    fn pictures(&self) -> impl Iterator<Item = (String, Vec<u8>)> {
        let list = self.textures.iter().flat_map(|textures| &textures.list);
        let list: Vec<&BodyTexture> = list.collect();
        let is_first = |place: usize| {
            let before = &list[..place];
            before
                .iter()
                .all(|other| other.file.0 != list[place].file.0)
        };
        let named = (0..list.len()).filter(|place| is_first(*place));
        let named = named.map(|place| {
            let (bytes, ending) = &list[place].file;
            let name = format!("{}-{}.{ending}", self.name, place + 1);
            (name, bytes.to_vec())
        });
        named.collect::<Vec<_>>().into_iter()
    }

    /// Name of the picture of a texture.
    fn picture(&self, texture: usize, list: &[BodyTexture]) -> String {
        let (bytes, ending) = &list[texture].file;
        let first = list.iter().position(|other| other.file.0 == *bytes);
        format!("{}-{}.{ending}", self.name, first.unwrap_or(texture) + 1)
    }
}

/// The keys of a material's picture.
fn write_map(text: &mut String, picture: &str, texture: &BodyTexture) {
    let _ = writeln!(text, "map_Kd {picture}");
    if !texture.texture.is_opaque() {
        let _ = writeln!(text, "map_d {picture}");
    }
    if texture.wrap != [Wrap::Repeat; 2] {
        let [u, v] = texture.wrap.map(|wrap| match wrap {
            Wrap::Repeat => "repeat",
            Wrap::Mirror => "mirror",
            Wrap::Clamp => "clamp",
        });
        let _ = writeln!(text, "wrap_Kd {u} {v}");
    }
}

fn write_material(text: &mut String, number: usize, look: &Appearance) {
    let _ = writeln!(text, "newmtl look-{number}");
    if let Some(colour) = look.color {
        let [red, green, blue] = colour.map(|part| encoded(f64::from(part)));
        let _ = writeln!(text, "Kd {red:.6} {green:.6} {blue:.6}");
    }
    for (key, value) in [
        ("d", look.opacity),
        ("Pr", look.roughness),
        ("Pm", look.metallic),
    ] {
        if let Some(value) = value {
            let _ = writeln!(text, "{key} {value:?}");
        }
    }
}
