//! Textures on the triangles of a drawn body, and how they are made of the pictures that its materials name.

use std::path::Path;
use std::sync::Arc;

use taut_proto::mesh_textures::{MAX_MESH_TEXELS, MAX_TEXTURES};
use taut_proto::{MeshHash, Texture, Wrap};

use super::material::Material;
use super::picture_use::{PictureSource, PictureUse};
use crate::picture::{ReadPicture, decode};

/// u and v of the corners of a triangle in its picture: u along its rows, v from the first down, the picture from 0 to 1.
pub(crate) type Corners = [[f32; 2]; 3];

/// Textures on the triangles of a drawn body.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyTextures {
    /// The textures, in no order.
    pub list: Vec<BodyTexture>,
    /// Place in the list, for each of the body's looks. The colour of a look that has one is a factor on it.
    pub of_looks: Vec<Option<usize>>,
    /// u and v of the corners of each triangle, in its order: u along the rows of the picture, v from the first down, the picture from 0 to 1.
    pub coordinates: Vec<[[f32; 2]; 3]>,
}

impl BodyTextures {
    /// One picture that no file holds, of the first of two looks.
    pub(super) fn of_one(texture: Texture, coordinates: Vec<Corners>) -> Self {
        let hash = MeshHash::of(&texture.encode());
        let one = BodyTexture {
            texture: Arc::new(texture),
            hash,
            wrap: [Wrap::Clamp; 2],
            file: (Arc::default(), "png"),
        };
        Self {
            list: vec![one],
            of_looks: vec![Some(0), None],
            coordinates,
        }
    }
}

/// A texture.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyTexture {
    /// Its texels.
    pub texture: Arc<Texture>,
    /// Hash of its encoded form.
    pub hash: MeshHash,
    /// How it goes on beyond its edges, along u and along v.
    pub wrap: [Wrap; 2],
    /// The picture as it was in the file, and how names of such files end.
    pub(crate) file: (Arc<[u8]>, &'static str),
}

/// A picture that was read, once for all materials that have it.
struct Picture {
    source: PictureSource,
    with_opacity: bool,
    file: (Arc<[u8]>, &'static str),
    texture: Texture,
    size: (u32, u32),
}

/// The pictures of the materials that are seen.
#[derive(Default)]
pub(super) struct Pictures {
    read: Vec<Picture>,
    /// Sources that could not be.
    unread: Vec<PictureSource>,
    /// Pictures with how they go on.
    textures: Vec<(usize, [Wrap; 2])>,
    /// Place in `textures`, for each material.
    of_materials: Vec<Option<usize>>,
}

impl Pictures {
    /// Reads those of the materials at `places` of the list. What is lost goes to `lost`.
    pub(super) fn read(
        list: &[Material],
        places: &[usize],
        directory: Option<&Path>,
        lost: &mut Vec<String>,
    ) -> Self {
        let mut all = Self {
            of_materials: vec![None; list.len()],
            ..Self::default()
        };
        let mut too_many = 0;
        for place in places.iter().copied().filter(|place| *place < list.len()) {
            let Some(used) = &list[place].picture else {
                continue;
            };
            let Some(picture) = all.picture(used, used.is_opacity, directory, lost) else {
                continue;
            };
            let texture = (picture, used.wrap);
            let known = all.textures.iter().position(|known| *known == texture);
            if known.is_none() && all.textures.len() == MAX_TEXTURES {
                too_many += 1;
                continue;
            }
            all.of_materials[place] = Some(known.unwrap_or_else(|| {
                all.textures.push(texture);
                all.textures.len() - 1
            }));
        }
        if too_many > 0 {
            lost.push(format!(
                "{too_many} of its textures: a body has at most {MAX_TEXTURES}"
            ));
        }
        all.fit(lost);
        all
    }

    /// Place of a picture among those that were read; `None`, said once, of one that cannot be.
    fn picture(
        &mut self,
        used: &PictureUse,
        with_opacity: bool,
        directory: Option<&Path>,
        lost: &mut Vec<String>,
    ) -> Option<usize> {
        let is_same =
            |known: &Picture| known.source == used.source && known.with_opacity == with_opacity;
        if let Some(known) = self.read.iter().position(is_same) {
            return Some(known);
        }
        if self.unread.contains(&used.source) {
            return None;
        }
        let bytes = used.source.read(directory);
        let read = bytes.and_then(|bytes| decode(&bytes).map(|picture| (bytes, picture)));
        let (bytes, picture) = match read {
            Ok(read) => read,
            Err(why) => {
                lost.push(format!(
                    "its texture \"{}\", which {why}",
                    used.source.name()
                ));
                self.unread.push(used.source.clone());
                return None;
            }
        };
        let ReadPicture {
            mut texture,
            size,
            ending,
        } = picture;
        if !with_opacity && !texture.is_opaque() {
            texture = opaque(&texture);
        }
        self.read.push(Picture {
            source: used.source.clone(),
            with_opacity,
            file: (bytes, ending),
            texture,
            size,
        });
        Some(self.read.len() - 1)
    }

    /// Halves the largest until all of them are what a mesh may have, and says which are smaller than their files.
    fn fit(&mut self, lost: &mut Vec<String>) {
        let texels = |picture: &Picture| picture.texture.texels().len() as u64;
        while self.read.iter().map(texels).sum::<u64>() > MAX_MESH_TEXELS {
            let Some(largest) = self.read.iter_mut().max_by_key(|picture| texels(picture)) else {
                return;
            };
            largest.texture = largest.texture.halved();
        }
        for picture in &self.read {
            let (size, (width, height)) = (picture.size, picture.texture.size());
            if size != (width, height) {
                lost.push(format!(
                    "the full resolution of its texture \"{}\": {width} x {height} of {} x {} pixels are kept",
                    picture.source.name(),
                    size.0,
                    size.1
                ));
            }
        }
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.textures.is_empty()
    }

    /// The texture of a material, if it has one that was read.
    pub(super) fn of(&self, material: usize) -> Option<usize> {
        self.of_materials.get(material).copied().flatten()
    }

    /// The light at a place of a texture, linear red, green and blue.
    pub(super) fn light(&self, texture: usize, at: [f64; 2]) -> [f64; 3] {
        let (picture, wrap) = self.textures[texture];
        let texture = &self.read[picture].texture;
        let (width, height) = texture.size();
        let within = |i: usize, side: u32| {
            let place = wrap[i].within(at[i]) * f64::from(side);
            (place as u32).min(side - 1) // NaN is 0
        };
        let (x, y) = (within(0, width), within(1, height));
        let [red, green, blue, _] = texture.texels()[(y * width + x) as usize];
        [red, green, blue]
            .map(|value| f64::from(taut_proto::texture::light_table()[usize::from(value)]))
    }

    /// The textures themselves.
    pub(super) fn into_list(self) -> Vec<BodyTexture> {
        let made = self.read.into_iter().map(|picture| {
            let hash = MeshHash::of(&picture.texture.encode());
            (Arc::new(picture.texture), hash, picture.file)
        });
        let made: Vec<_> = made.collect();
        let textures = self.textures.into_iter();
        textures
            .map(|(picture, wrap)| {
                let (texture, hash, file) = made[picture].clone();
                BodyTexture {
                    texture,
                    hash,
                    wrap,
                    file,
                }
            })
            .collect()
    }
}

fn opaque(texture: &Texture) -> Texture {
    let texels = texture.texels().iter();
    let texels = texels.map(|[red, green, blue, _]| [*red, *green, *blue, u8::MAX]);
    Texture::new(texture.size(), texels.collect()).unwrap_or_else(|_| texture.clone()) // of the same size
}
