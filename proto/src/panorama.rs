//! A picture of all directions as it travels: the light around the scene, named by the BLAKE3 hash of its bytes.
//!
//! | offset | field  | bytes             | meaning                                                     |
//! |--------|--------|-------------------|-------------------------------------------------------------|
//! | 0      | magic  | 4                 | "tpan"                                                      |
//! | 4      | texels | width × height × 4 | rows from the zenith down; shared exponent, little-endian |
//!
//! Equirectangular: the middle of the picture is straight ahead of the viewer (+y of the workbench), its right half is to the
//! right (+x), its first row is up (+z). A texel has 9 bits of red, green and blue and 5 bits of exponent, as graphics cards read
//! them (`VK_FORMAT_E5B9G9R9_UFLOAT_PACK32`): no pattern of bits is not finite, so only the length can be wrong.
//!
//! Source: OpenGL extension `EXT_texture_shared_exponent`, for the encoding.

use crate::DecodeError;

const MAGIC: [u8; 4] = *b"tpan";
const EXPONENT_BIAS: i32 = 15;
const MANTISSA_BITS: i32 = 9;
const MANTISSA_MAX: f32 = 511.0;

/// Light from all directions, linear red, green and blue, in a unit of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Panorama {
    texels: Vec<u32>,
}

impl Panorama {
    /// Columns, over 360 degrees: 1.4 degrees each.
    pub const WIDTH: usize = 256;
    /// Rows, over 180 degrees.
    pub const HEIGHT: usize = 128;

    /// The light at the middle of each texel, by its column and row. What is not above 0 is dark.
    pub fn from_fn(light: impl Fn(usize, usize) -> [f32; 3]) -> Self {
        let texel = |place: usize| shared_exponent(light(place % Self::WIDTH, place / Self::WIDTH));
        Self {
            texels: (0..Self::WIDTH * Self::HEIGHT).map(texel).collect(),
        }
    }

    /// The light of a texel.
    ///
    /// # Panics
    /// Beyond the picture.
    pub fn light(&self, column: usize, row: usize) -> [f32; 3] {
        assert!(column < Self::WIDTH, "column {column}");
        light_of(self.texels[row * Self::WIDTH + column])
    }

    /// The bytes that travel and are hashed.
    pub fn encode(&self) -> Vec<u8> {
        let texels = self.texels.iter().flat_map(|texel| texel.to_le_bytes());
        MAGIC.into_iter().chain(texels).collect()
    }

    /// Reads what [`Panorama::encode`] wrote.
    ///
    /// # Errors
    /// Other bytes than a panorama's.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        let Some((magic, rest)) = bytes.split_first_chunk::<4>() else {
            return Err(DecodeError::Truncated);
        };
        if *magic != MAGIC {
            return Err(DecodeError::WrongMagic);
        }
        let (texels, left) = rest.as_chunks::<4>();
        if texels.len() != Self::WIDTH * Self::HEIGHT || !left.is_empty() {
            return Err(DecodeError::Inconsistent {
                what: "panorama length",
            });
        }
        Ok(Self {
            texels: texels.iter().map(|t| u32::from_le_bytes(*t)).collect(),
        })
    }
}

/// Light in 32 bits: three mantissas and the exponent of the brightest. What is above 65,408 is that.
pub fn shared_exponent(light: [f32; 3]) -> u32 {
    let most = MANTISSA_MAX * 2f32.powi(31 - EXPONENT_BIAS - MANTISSA_BITS);
    // NaN fails both comparisons of clamp's kind: it is dark.
    let kept = light.map(|part| if part > 0.0 { part.min(most) } else { 0.0 });
    let peak = kept.iter().copied().fold(0.0, f32::max);
    let magnitude = if peak > 0.0 {
        peak.log2().floor() as i32
    } else {
        i32::MIN / 2
    };
    let exponent = |magnitude: i32| (magnitude + 1 + EXPONENT_BIAS).max(0);
    let unit = |exponent: i32| 2f32.powi(exponent - EXPONENT_BIAS - MANTISSA_BITS);
    let mut shared = exponent(magnitude);
    if (peak / unit(shared)).round() > MANTISSA_MAX {
        shared += 1; // rounded up to the next power of two
    }
    let mantissa = |part: f32| (part / unit(shared)).round() as u32;
    let [red, green, blue] = kept.map(mantissa);
    (shared as u32) << 27 | blue << 18 | green << 9 | red
}

/// The light that [`shared_exponent`] wrote.
pub fn light_of(texel: u32) -> [f32; 3] {
    let unit = 2f32.powi((texel >> 27) as i32 - EXPONENT_BIAS - MANTISSA_BITS);
    [0, 9, 18].map(|shift| ((texel >> shift) & 0x1ff) as f32 * unit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn light_survives_up_to_half_a_step_of_the_brightest(
            light in prop::array::uniform3(0.0..60_000.0_f32), dim in 0..45,
        ) {
            let light = light.map(|part| part * 0.5f32.powi(dim));
            let found = light_of(shared_exponent(light));
            let peak = light.iter().copied().fold(0.0, f32::max);
            // The brightest is at least 255.75 steps, where it was rounded up to 256, unless the smallest step is too large for it.
            let half_a_step = (peak / 511.0).max(0.5 * light_of(1)[0]);
            for (a, b) in light.iter().zip(found) {
                prop_assert!((a - b).abs() <= half_a_step, "{light:?} {found:?}");
            }
        }

        #[test]
        fn every_texel_is_light(texel in any::<u32>()) {
            prop_assert!(light_of(texel).iter().all(|part| part.is_finite() && *part >= 0.0));
        }

        #[test]
        fn bytes_that_are_no_panorama_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            prop_assert!(Panorama::decode(&bytes).is_err());
        }
    }

    #[test]
    fn what_is_no_light_is_dark_and_what_is_too_bright_is_the_brightest() {
        let dark = shared_exponent([f32::NAN, -1.0, f32::NEG_INFINITY]);
        assert_eq!(light_of(dark), [0.0; 3]);
        let bright = shared_exponent([f32::INFINITY, 1e9, 0.0]);
        assert_eq!(light_of(bright), [65_408.0, 65_408.0, 0.0]);
        assert_eq!(
            light_of(shared_exponent([1.0, 0.5, 0.25])),
            [1.0, 0.5, 0.25]
        );
    }

    #[test]
    fn a_panorama_survives_its_bytes_and_no_other_length() {
        let panorama = Panorama::from_fn(|column, row| [column as f32, row as f32, 0.5]);
        let bytes = panorama.encode();
        assert_eq!(Panorama::decode(&bytes), Ok(panorama));
        for wrong in [&bytes[1..], &bytes[..bytes.len() - 1], &bytes[..4], &[]] {
            assert!(Panorama::decode(wrong).is_err());
        }
        let longer = [&bytes[..], &[0; 4]].concat();
        assert!(Panorama::decode(&longer).is_err());
    }
}
