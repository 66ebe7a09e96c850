//! Textures on a mesh: which of its looks have one, and where its triangles lie in them. A part of [`MeshBlob`](crate::MeshBlob), behind its looks.
//!
//! | field       | bytes  | meaning                                                              |
//! |-------------|--------|----------------------------------------------------------------------|
//! | count       | 4      | t, from 1 to 64                                                      |
//! | textures    | t × 34 | hash of its [`Texture`](crate::Texture); how u and v go on beyond it |
//! | of looks    | k × 1  | which texture each look has; 255 is none                             |
//! | coordinates | m × 24 | u and v of the three corners of each triangle                        |
//!
//! u runs along the rows of the picture from 0 to 1, v from its first row down from 0 to 1.

use crate::DecodeError;
use crate::mesh_blob::MeshHash;

/// Most textures of one mesh.
pub const MAX_TEXTURES: usize = 64;
/// Most texels of all textures of one mesh: four of the largest, 256 MB.
pub const MAX_MESH_TEXELS: u64 = 4 << 24;

const USE_BYTES: usize = 34;
const COORDINATE_BYTES: usize = 24;
const NO_TEXTURE: u8 = u8::MAX;

/// How a texture goes on beyond its edge, along one of its sides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// From its other edge on.
    #[default]
    Repeat,
    /// Back, as in a mirror.
    Mirror,
    /// With its last texel.
    Clamp,
}

impl Wrap {
    const ALL: [Self; 3] = [Self::Repeat, Self::Mirror, Self::Clamp];

    /// A coordinate that is anywhere, brought to where it is within the picture: 0 to 1.
    pub fn within(self, place: f64) -> f64 {
        match self {
            Self::Repeat => place - place.floor(),
            Self::Mirror => 1.0 - (place.rem_euclid(2.0) - 1.0).abs(),
            Self::Clamp => place.clamp(0.0, 1.0),
        }
    }
}

/// A texture as a mesh has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureUse {
    /// Hash of the encoded [`Texture`](crate::Texture).
    pub texture: MeshHash,
    /// Beyond its edges along u and along v.
    pub wrap: [Wrap; 2],
}

/// The textures of a mesh. The colour of a look that has one is a factor on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Textures {
    /// At most [`MAX_TEXTURES`], and one at least.
    pub list: Vec<TextureUse>,
    /// Place in the list, for each look of the mesh.
    pub of_looks: Vec<Option<u8>>,
    /// u and v of the corners of each triangle, in its order; of one without a texture they mean nothing.
    pub coordinates: Vec<[[f32; 2]; 3]>,
}

impl Textures {
    /// Checks that they are those of a mesh with so many looks and triangles.
    pub(crate) fn check(&self, looks: usize, triangles: usize) -> Result<(), DecodeError> {
        let count = self.list.len();
        let known = |place: &u8| usize::from(*place) < count;
        if !(1..=MAX_TEXTURES).contains(&count)
            || self.of_looks.len() != looks
            || self.coordinates.len() != triangles
            || !self.of_looks.iter().flatten().all(known)
        {
            return Err(DecodeError::Inconsistent {
                what: "mesh textures",
            });
        }
        let mut numbers = self.coordinates.as_flattened().as_flattened().iter();
        if numbers.all(|number| number.is_finite()) {
            Ok(())
        } else {
            Err(DecodeError::NotFinite)
        }
    }

    /// Length of what [`Textures::write`] writes.
    pub(crate) fn encoded_len(&self) -> usize {
        4 + USE_BYTES * self.list.len()
            + self.of_looks.len()
            + COORDINATE_BYTES * self.coordinates.len()
    }

    pub(crate) fn write(&self, to: &mut Vec<u8>) {
        to.extend((self.list.len() as u32).to_le_bytes()); // at most MAX_TEXTURES
        for one in &self.list {
            to.extend(one.texture.bytes);
            to.extend(one.wrap.map(|wrap| wrap as u8));
        }
        to.extend(
            self.of_looks
                .iter()
                .map(|place| place.unwrap_or(NO_TEXTURE)),
        );
        let numbers = self.coordinates.as_flattened().as_flattened();
        to.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    }

    /// Reads what [`Textures::write`] wrote for a mesh with so many looks; the coordinates are whatever follows them.
    pub(crate) fn read(bytes: &[u8], looks: usize) -> Result<Self, DecodeError> {
        let Some((count, rest)) = bytes.split_first_chunk::<4>() else {
            return Err(DecodeError::Truncated);
        };
        let length = USE_BYTES.checked_mul(u32::from_le_bytes(*count) as usize);
        let uses = length.and_then(|length| rest.split_at_checked(length));
        let parts = uses.and_then(|(uses, rest)| Some((uses, rest.split_at_checked(looks)?)));
        let Some((uses, (of_looks, coordinates))) = parts else {
            return Err(DecodeError::Truncated);
        };
        let (uses, _) = uses.as_chunks::<USE_BYTES>();
        let (numbers, left) = coordinates.as_chunks::<4>();
        let (pairs, odd) = numbers.as_chunks::<2>();
        let (triangles, apart) = pairs.as_chunks::<3>();
        if !(left.is_empty() && odd.is_empty() && apart.is_empty()) {
            return Err(DecodeError::Inconsistent {
                what: "mesh textures",
            });
        }
        let place = |place: &u8| Some(*place).filter(|place| *place != NO_TEXTURE);
        Ok(Self {
            list: uses.iter().map(use_of).collect::<Result<_, _>>()?,
            of_looks: of_looks.iter().map(place).collect(),
            coordinates: triangles
                .iter()
                .map(|corners| corners.map(|pair| pair.map(f32::from_le_bytes)))
                .collect(),
        })
    }
}

fn use_of(bytes: &[u8; USE_BYTES]) -> Result<TextureUse, DecodeError> {
    let [hash @ .., u, v] = *bytes;
    let wrap = |tag: u8| {
        let known = Wrap::ALL.get(usize::from(tag)).copied();
        known.ok_or(DecodeError::UnknownTag {
            what: "texture wrap",
            tag,
        })
    };
    Ok(TextureUse {
        texture: MeshHash { bytes: hash },
        wrap: [wrap(u)?, wrap(v)?],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_beyond_a_picture_are_brought_into_it() {
        for (wrap, places) in [
            (Wrap::Repeat, [0.75, 0.25, 0.25, 0.75]),
            (Wrap::Mirror, [0.25, 0.25, 0.75, 0.25]),
            (Wrap::Clamp, [0.0, 0.25, 1.0, 1.0]),
        ] {
            let found = [-0.25, 0.25, 1.25, 3.75].map(|place| wrap.within(place));
            assert_eq!(found, places, "{wrap:?}");
        }
    }
}
