//! The textures of a mesh file's materials, and the runs of triangles that have them.

use std::path::Path;

use taut_proto::mesh_blob::MAX_MESH_BYTES;

use super::RawMesh;
use super::body_textures::{BodyTextures, Pictures};
use super::laid_out::lay_out;
use super::material::{Material, Materials};
use crate::appearance::Appearance;

/// Bytes of a vertex, and of a triangle with its look and its place in a texture, of a mesh as it is sent; of all else, at most.
const SENT_BYTES: [usize; 3] = [24, 12 + 1 + 24, 16 << 10];

/// Textures that were read.
pub(super) struct ReadTextures {
    /// Place of each material's, if it has one.
    of_materials: Vec<Option<usize>>,
    /// Without its looks.
    body: BodyTextures,
}

impl Materials {
    /// Reads the pictures of the materials at `places`. Colours of materials become those of their pictures on the whole; what they were, as factors, and the
    /// textures with the place of each material's.
    pub(super) fn textures(
        &mut self,
        mesh: &RawMesh,
        places: &[usize],
        directory: Option<&Path>,
        lost: &mut Vec<String>,
    ) -> (Vec<Option<[f32; 3]>>, Option<ReadTextures>) {
        let factors: Vec<_> = self.list.iter().map(|of| of.appearance.color).collect();
        let pictures = Pictures::read(&self.list, places, directory, lost);
        let drawn = (mesh, &self.runs[..]);
        let laid_out = lay_out(drawn, &self.coordinates, (&self.list, &pictures), lost);
        for (place, material) in self.list.iter_mut().enumerate() {
            let colour = &mut material.appearance.color;
            match laid_out.means[place] {
                Some(mean) => {
                    let factor = colour.unwrap_or([1.0; 3]);
                    *colour = Some([0, 1, 2].map(|i| factor[i] * mean[i] as f32));
                }
                // White is the factor that says nothing of a picture that is not there.
                None if material.picture.is_some() && *colour == Some([1.0; 3]) => *colour = None,
                None => {}
            }
        }
        let [of_vertex, of_triangle, more] = SENT_BYTES;
        let sent = of_vertex * mesh.vertices.len() + of_triangle * mesh.triangles.len() + more;
        if pictures.is_empty() {
            return (factors, None);
        }
        if sent > MAX_MESH_BYTES {
            lost.push(format!(
                "its textures: {} triangles with places in them are more than the {MAX_MESH_BYTES} bytes that are sent; reduce the mesh",
                mesh.triangles.len()
            ));
            return (factors, None);
        }
        let of_materials = (0..self.list.len()).map(|place| pictures.of(place));
        let textures = ReadTextures {
            of_materials: of_materials.collect(),
            body: BodyTextures {
                list: pictures.into_list(),
                of_looks: Vec::new(),
                coordinates: laid_out.coordinates,
            },
        };
        (factors, Some(textures))
    }

    /// Runs of triangles that look alike, and their textures. One says its opacity where that is not the body's.
    pub(super) fn parts(
        &self,
        of: impl Fn(usize) -> Material,
        of_body: Option<f32>,
        factors: &[Option<[f32; 3]>],
        textures: Option<ReadTextures>,
    ) -> (Vec<(Appearance, usize)>, Option<BodyTextures>) {
        let mut parts: Vec<(Appearance, usize)> = Vec::new();
        let mut of_parts: Vec<Option<usize>> = Vec::new();
        for (material, count) in &self.runs {
            let place = material.unwrap_or(self.list.len());
            let mut look = of(place).appearance;
            let opacity = look.opacity.unwrap_or(1.0);
            look.opacity = (opacity != of_body.unwrap_or(1.0)).then_some(opacity);
            let texture = textures
                .as_ref()
                .and_then(|read| *read.of_materials.get(place)?);
            if texture.is_some() {
                look.color = Some(factors[place].unwrap_or([1.0; 3]));
            }
            match (parts.last_mut(), of_parts.last()) {
                (Some((last, triangles)), Some(known)) if *last == look && *known == texture => {
                    *triangles += count;
                }
                _ => {
                    parts.push((look, *count));
                    of_parts.push(texture);
                }
            }
        }
        let body = textures.map(|read| BodyTextures {
            of_looks: of_parts,
            ..read.body
        });
        (parts, body)
    }
}
