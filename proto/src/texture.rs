//! A picture on surfaces as it travels: bytes named by their hash, as those of a mesh are.
//!
//! | offset | field  | bytes              | meaning                                                         |
//! |--------|--------|--------------------|-----------------------------------------------------------------|
//! | 0      | magic  | 4                  | "ttex"                                                          |
//! | 4      | width  | 4                  | 1 to 4096                                                       |
//! | 8      | height | 4                  | 1 to 4096                                                       |
//! | 12     | texels | width × height × 4 | rows from the top down; red, green, blue in sRGB, then opacity |
//!
//! Texels and not the bytes of a PNG or JPEG file: no node has to decompress what it is sent, so that only the length can be wrong.
//! The largest takes 64 MB once, and then lies in the nodes' caches.

use std::sync::OnceLock;

use crate::DecodeError;

const MAGIC: [u8; 4] = *b"ttex";
const PREFIX_BYTES: usize = 12;
/// Steps of the table of [`srgb`]: fine enough that the darkest colours, 12.92 times as steep, are off by less than 0.06 of an 8-bit step.
const LIGHT_STEPS: usize = 1 << 16;

/// Colours and opacity by place, 8 bits each.
#[derive(Clone, PartialEq, Eq)]
pub struct Texture {
    width: u32,
    texels: Vec<[u8; 4]>,
}

impl Texture {
    /// Longest side, texels: 64 MB, and a third more on a graphics card with all its smaller forms.
    pub const MAX_SIDE: u32 = 4096;

    /// Texels row by row from the top down: red, green, blue (sRGB), opacity.
    ///
    /// # Errors
    /// A side that is 0 or above [`Texture::MAX_SIDE`], or another number of texels than the sides say.
    pub fn new((width, height): (u32, u32), texels: Vec<[u8; 4]>) -> Result<Self, DecodeError> {
        let sides = 1..=Self::MAX_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(DecodeError::OutOfRange {
                number: "Texture.size",
                range: "1 to 4096",
            });
        }
        if texels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(DecodeError::Inconsistent {
                what: "texture length",
            });
        }
        Ok(Self { width, texels })
    }

    /// Width and height, texels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.texels.len() as u32 / self.width)
    }

    /// Row by row from the top down: red, green, blue (sRGB), opacity.
    pub fn texels(&self) -> &[[u8; 4]] {
        &self.texels
    }

    /// Whether nothing is seen through any of it.
    pub fn is_opaque(&self) -> bool {
        self.texels.iter().all(|texel| texel[3] == u8::MAX)
    }

    /// The bytes that travel and are hashed.
    pub fn encode(&self) -> Vec<u8> {
        let (width, height) = self.size();
        let mut bytes = Vec::with_capacity(PREFIX_BYTES + 4 * self.texels.len());
        bytes.extend(MAGIC);
        bytes.extend(width.to_le_bytes());
        bytes.extend(height.to_le_bytes());
        bytes.extend(self.texels.as_flattened());
        bytes
    }

    /// Reads what [`Texture::encode`] wrote. Memory is bounded by the length of `bytes`.
    ///
    /// # Errors
    /// Other bytes than a texture's.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        let Some((prefix, rest)) = bytes.split_first_chunk::<PREFIX_BYTES>() else {
            return Err(DecodeError::Truncated);
        };
        let [m0, m1, m2, m3, w0, w1, w2, w3, h0, h1, h2, h3] = *prefix;
        if [m0, m1, m2, m3] != MAGIC {
            return Err(DecodeError::WrongMagic);
        }
        let [width, height] = [[w0, w1, w2, w3], [h0, h1, h2, h3]].map(u32::from_le_bytes);
        let (texels, left) = rest.as_chunks::<4>();
        if !left.is_empty() {
            return Err(DecodeError::Inconsistent {
                what: "texture length",
            });
        }
        Self::new((width, height), texels.to_vec())
    }

    /// The same at half the size each way, rounded down, but at least one texel: the mean light of what each texel covers, where it can be seen.
    #[must_use]
    pub fn halved(&self) -> Self {
        let ((width, _), texels) = halved(self.size(), &self.texels);
        Self { width, texels }
    }
}

/// [`Texture::halved`] of texels that may be more than a texture has.
///
/// # Panics
/// If they are fewer than the sides say.
pub fn halved((width, height): (u32, u32), texels: &[[u8; 4]]) -> ((u32, u32), Vec<[u8; 4]>) {
    let (narrow, low) = ((width / 2).max(1), (height / 2).max(1));
    let covered = |place: u32, of: u32, side: u32| {
        let edge = |place: u32| (u64::from(place) * u64::from(side) / u64::from(of)) as usize;
        edge(place)..edge(place + 1)
    };
    let mut half = Vec::with_capacity(narrow as usize * low as usize);
    for y in 0..low {
        for x in 0..narrow {
            let mut mean = Mean::default();
            for row in covered(y, low, height) {
                let start = row * width as usize;
                let columns = covered(x, narrow, width);
                let covered = &texels[start + columns.start..start + columns.end];
                covered.iter().for_each(|texel| mean.add(*texel));
            }
            half.push(mean.texel());
        }
    }
    ((narrow, low), half)
}

impl std::fmt::Debug for Texture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (width, height) = self.size();
        write!(f, "Texture({width} x {height})")
    }
}

/// The mean of some texels: each counts by its opacity, all of them alike where none is seen.
#[derive(Default)]
struct Mean {
    seen: [f32; 3],
    plain: [f32; 3],
    opacity: f32,
    count: f32,
}

impl Mean {
    fn add(&mut self, [red, green, blue, opacity]: [u8; 4]) {
        let light = [red, green, blue].map(|value| light_table()[usize::from(value)]);
        let opacity = f32::from(opacity);
        for (part, light) in light.into_iter().enumerate() {
            self.seen[part] += opacity * light;
            self.plain[part] += light;
        }
        self.opacity += opacity;
        self.count += 1.0;
    }

    fn texel(&self) -> [u8; 4] {
        let (sum, weight) = if self.opacity > 0.0 {
            (self.seen, self.opacity)
        } else {
            (self.plain, self.count)
        };
        let [red, green, blue] = sum.map(|part| srgb(part / weight));
        [red, green, blue, (self.opacity / self.count).round() as u8]
    }
}

/// Linear light of each 8-bit value of sRGB.
///
/// Source: IEC 61966-2-1.
pub fn light_table() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| {
        std::array::from_fn(|value| {
            let value = value as f64 / 255.0;
            let light = if value <= 0.04045 {
                value / 12.92
            } else {
                ((value + 0.055) / 1.055).powf(2.4)
            };
            light as f32
        })
    })
}

/// The nearest 8-bit value of sRGB to linear light; what is beyond 0 to 1 is the end of that, NaN is 0.
pub fn srgb(light: f32) -> u8 {
    static TABLE: OnceLock<Vec<u8>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let value = |step: usize| {
            let light = step as f64 / LIGHT_STEPS as f64;
            let value = if light <= 0.003_130_8 {
                12.92 * light
            } else {
                1.055 * light.powf(1.0 / 2.4) - 0.055
            };
            (255.0 * value).round() as u8
        };
        (0..=LIGHT_STEPS).map(value).collect()
    });
    table[(light.clamp(0.0, 1.0) * LIGHT_STEPS as f32).round() as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn texture(size: (u32, u32), texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
        let places = (0..size.0 * size.1).map(|place| texel(place % size.0, place / size.0));
        Texture::new(size, places.collect()).expect("a texture")
    }

    proptest! {
        #[test]
        fn bytes_that_are_no_texture_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            prop_assert!(Texture::decode(&bytes).is_err());
        }
    }

    #[test]
    fn a_texture_survives_its_bytes_and_no_other_length() {
        let made = texture((3, 2), |x, y| [x as u8, y as u8, 7, 255]);
        let bytes = made.encode();
        assert_eq!(bytes.len(), 12 + 3 * 2 * 4);
        for end in 0..bytes.len() {
            assert!(Texture::decode(&bytes[..end]).is_err(), "cut at {end}");
        }
        assert!(Texture::decode(&[&bytes[..], &[0]].concat()).is_err());
        assert!(Texture::decode(&[&bytes[..], &[0; 4]].concat()).is_err());
        assert_eq!(Texture::decode(&bytes), Ok(made));
    }

    #[test]
    fn sizes_that_are_none_are_refused_before_room_is_made() {
        for size in [(0, 1), (1, 0), (4097, 1), (1, 4097), (u32::MAX, u32::MAX)] {
            assert!(Texture::new(size, vec![[0; 4]]).is_err(), "{size:?}");
            let mut bytes = MAGIC.to_vec();
            bytes.extend(size.0.to_le_bytes());
            bytes.extend(size.1.to_le_bytes());
            assert!(Texture::decode(&bytes).is_err(), "{size:?}");
        }
    }

    #[test]
    fn half_a_checkerboard_is_the_mean_of_its_light() {
        let board = texture((4, 4), |x, y| match (x + y) % 2 {
            0 => [255, 0, 0, 255],
            _ => [0, 0, 255, 255],
        });
        // Half of the light is 188 of 255 in sRGB, and not 128.
        let half = board.halved();
        assert_eq!(half.size(), (2, 2));
        assert!(half.texels().iter().all(|t| *t == [188, 0, 188, 255]));
        assert_eq!(half.halved().halved().size(), (1, 1), "never less");
    }

    #[test]
    fn what_is_not_seen_gives_no_colour() {
        let rim = texture((2, 1), |x, _| {
            [[200, 0, 0, 255], [0, 255, 0, 0]][x as usize]
        });
        assert_eq!(rim.halved().texels(), [[200, 0, 0, 128]]);
        let none = texture((2, 2), |_, _| [9, 9, 9, 0]);
        assert_eq!(none.halved().texels(), [[9, 9, 9, 0]]);
        assert!(!rim.is_opaque() && texture((1, 1), |_, _| [0, 0, 0, 255]).is_opaque());
    }

    #[test]
    fn odd_sides_lose_no_texel() {
        let row = texture(
            (5, 1),
            |x, _| if x == 4 { [255; 4] } else { [0, 0, 0, 255] },
        );
        let half = row.halved();
        assert_eq!(half.size(), (2, 1));
        assert_eq!(half.texels()[0], [0, 0, 0, 255]);
        assert_eq!(half.texels()[1][0], srgb(1.0 / 3.0));
    }

    #[test]
    fn every_value_of_srgb_comes_back_from_its_light() {
        for value in 0..=255_u8 {
            assert_eq!(srgb(light_table()[usize::from(value)]), value);
        }
        assert_eq!([srgb(-1.0), srgb(2.0), srgb(f32::NAN)], [0, 255, 0]);
    }
}
