//! Textures on the meshes of a stage, at all the sizes at which they are drawn.

use std::collections::HashMap;
use std::sync::Arc;

use taut_proto::mesh_textures::MAX_MESH_TEXELS;
use taut_proto::{MeshBlob, MeshHash, Texture, Wrap};

use crate::error::RenderError;

/// The textures that the meshes of a scene name, by their hashes.
pub type KnownTextures = HashMap<MeshHash, Arc<Texture>>;

/// A texture, and the same at half its size and so on down to one texel.
#[derive(Debug, PartialEq)]
pub struct SizedTexture {
    /// The largest first.
    pub levels: Vec<Texture>,
    /// Something is seen through it.
    pub is_see_through: bool,
}

/// Textures on a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshTextures {
    /// Each with how it goes on beyond its edges, along u and along v.
    pub list: Vec<(Arc<SizedTexture>, [Wrap; 2])>,
    /// Place in the list, for each of the mesh's looks, whose colours are factors on them.
    pub of_looks: Vec<Option<u8>>,
    /// u and v of the corners of each triangle: u along the rows of the picture, v from the first down, the picture from 0 to 1.
    pub coordinates: Vec<[[f32; 2]; 3]>,
}

impl SizedTexture {
    /// All sizes of a texture.
    pub fn of(texture: &Texture) -> Self {
        let mut levels = vec![texture.clone()];
        while let Some(last) = levels.last().filter(|last| last.size() != (1, 1)) {
            let half = last.halved();
            levels.push(half);
        }
        Self {
            is_see_through: !texture.is_opaque(),
            levels,
        }
    }
}

impl MeshTextures {
    /// Those of a mesh, out of the `known`; what was `made` is used again. `None` of a mesh without.
    pub(crate) fn of(
        blob: &MeshBlob,
        known: &KnownTextures,
        made: &mut HashMap<MeshHash, Arc<SizedTexture>>,
    ) -> Result<Option<Arc<Self>>, RenderError> {
        let Some(textures) = blob.textures() else {
            return Ok(None);
        };
        let mut list = Vec::with_capacity(textures.list.len());
        for used in &textures.list {
            let hash = used.texture;
            let texture = known.get(&hash).ok_or_else(|| RenderError::BadScene {
                what: format!("a mesh names the texture {hash}, which is not there"),
            })?;
            let sized = made.entry(hash);
            let sized = sized.or_insert_with(|| Arc::new(SizedTexture::of(texture)));
            list.push((sized.clone(), used.wrap));
        }
        Ok(Some(Arc::new(Self {
            list,
            of_looks: textures.of_looks.clone(),
            coordinates: textures.coordinates.clone(),
        })))
    }

    /// The texture of a look, if it has one.
    pub(crate) fn of_look(&self, look: u32) -> Option<u8> {
        self.of_looks.get(look as usize).copied().flatten()
    }

    /// Something is seen through one of them.
    pub(crate) fn are_see_through(&self) -> bool {
        self.list.iter().any(|(texture, _)| texture.is_see_through)
    }
}

/// Refuses a mesh whose textures are more than one has, before they are all fetched.
pub(crate) fn check_texels(so_far: u64) -> Result<(), RenderError> {
    if so_far <= MAX_MESH_TEXELS {
        return Ok(());
    }
    Err(RenderError::BadScene {
        what: format!("a mesh has textures of {so_far} texels, more than {MAX_MESH_TEXELS}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texture_has_all_sizes_down_to_one_texel() {
        let texels = (0..5 * 2).map(|place| [place as u8, 0, 0, 255]).collect();
        let sized = SizedTexture::of(&Texture::new((5, 2), texels).expect("a texture"));
        let sizes: Vec<_> = sized.levels.iter().map(Texture::size).collect();
        assert_eq!(sizes, [(5, 2), (2, 1), (1, 1)]);
        assert!(!sized.is_see_through);
    }
}
