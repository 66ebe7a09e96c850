//! Blend masks: the share of its light that each pixel of an output keeps.
//!
//! A grey PNG of 8 or 16 bits (in one colour or in three equal ones), or a PFM of one value, as large as the output. A PNG's white is 1.
//! Values are shares of light unless the workbench file gives `blend_gamma`: then they are a signal, and the share is its power of that exponent (MPCDI: `gammaEmbedded` of the alpha map).

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, ImageReader, Limits};

use crate::fault::Unnamed;
use crate::pfm::{FloatMap, MAX_SIDE};

/// Most memory that the decoding of a PNG may take, bytes: 8192 x 8192 of 16 bits, twice.
const MAX_DECODED: u64 = 1 << 28;
/// Most that a byte of a PNG can stand for (deflate: 258 bytes in two bits).
const MOST_PER_BYTE: u64 = 1032;
/// Largest PNG file, bytes.
pub(crate) const MAX_BYTES: u64 = 1 << 28;

/// Shares of light.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// 0 to 1, row by row from the upper left.
    pub shares: Vec<f32>,
}

/// Reads a mask from the bytes of a PNG file.
pub(crate) fn from_png(bytes: Vec<u8>, gamma: f64) -> Result<Mask, Unnamed> {
    // What the file cannot hold is not made room for, whatever its header says.
    let most = MAX_DECODED.min(MOST_PER_BYTE * bytes.len() as u64);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut limits = Limits::default();
    let side = Some(MAX_SIDE as u32);
    (limits.max_image_width, limits.max_image_height) = (side, side);
    limits.max_alloc = Some(most);
    reader.limits(limits);
    let picture = reader.decode().map_err(|error| {
        Unnamed::new(format!(
            "cannot be read as a blend mask ({error}); save it as a grey PNG as large as the output"
        ))
    })?;
    // MPCDI's alpha maps are grey in three colours; three shares for a pixel are another matter.
    let is_grey = match &picture {
        DynamicImage::ImageLuma8(_) | DynamicImage::ImageLuma16(_) => true,
        DynamicImage::ImageRgb8(all) => all.pixels().all(|p| p.0 == [p.0[0]; 3]),
        DynamicImage::ImageRgb16(all) => all.pixels().all(|p| p.0 == [p.0[0]; 3]),
        _ => false,
    };
    if !is_grey {
        return Err(Unnamed::new(
            "is a coloured picture, but a blend mask has one grey value for each pixel; save it as a grey PNG of 16 bits",
        ));
    }
    let grey = picture.into_luma16();
    let shares = grey
        .pixels()
        .map(|pixel| f64::from(pixel.0[0]) / f64::from(u16::MAX));
    checked(Mask {
        width: grey.width(),
        height: grey.height(),
        shares: shares.map(|share| share.powf(gamma) as f32).collect(),
    })
}

/// A mask of a float map.
pub(crate) fn from_map(map: &FloatMap, gamma: f64) -> Result<Mask, Unnamed> {
    if map.channels != 1 {
        return Err(Unnamed::new(
            "has three values for a pixel, but a blend mask has one; save it as a grey map (Pf)",
        ));
    }
    let mut shares = Vec::with_capacity(map.values.len());
    for row in (0..map.height).rev() {
        for column in 0..map.width {
            let value = map.pixel(column, row)[0];
            let share = (0.0..=1.0).contains(&value); // false for NaN
            if !share {
                return Err(Unnamed::new(format!(
                    "has the value {value} at column {column}, row {row} from the lower left, but a share of light is 0 to 1"
                )));
            }
            shares.push(f64::from(value).powf(gamma) as f32);
        }
    }
    checked(Mask {
        width: map.width as u32,
        height: map.height as u32,
        shares,
    })
}

fn checked(mask: Mask) -> Result<Mask, Unnamed> {
    if mask.shares.iter().all(|share| *share == 0.0) {
        return Err(Unnamed::new(
            "is black all over, so nothing would be seen; is it the right file?",
        ));
    }
    Ok(mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(picture: &DynamicImage) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture
            .write_to(&mut bytes, ImageFormat::Png)
            .expect("a PNG");
        bytes.into_inner()
    }

    #[test]
    fn grey_is_a_share_of_light_and_a_signal_with_a_gamma() {
        let ramp = image::ImageBuffer::from_fn(3, 2, |x, _| image::Luma([(x * 32_767) as u16]));
        let bytes = png(&DynamicImage::ImageLuma16(ramp));
        let linear = from_png(bytes.clone(), 1.0).expect("a mask");
        assert!((linear.shares[1] - 0.5).abs() < 1e-4 && (linear.shares[2] - 1.0).abs() < 1e-4);
        let encoded = from_png(bytes, 2.2).expect("a mask");
        assert!((encoded.shares[1] - 0.5_f32.powf(2.2)).abs() < 1e-4);
    }

    #[test]
    fn grey_in_three_colours_is_grey() {
        let ramp = image::ImageBuffer::from_fn(3, 2, |x, _| image::Rgb([(x * 100) as u8; 3]));
        let mask = from_png(png(&DynamicImage::ImageRgb8(ramp)), 1.0).expect("a mask");
        assert!((mask.shares[1] - 100.0 / 255.0).abs() < 1e-4, "{mask:?}");
    }

    #[test]
    fn a_map_begins_below_and_a_mask_above() {
        let values = vec![0.0, 0.25, 0.5, 1.0];
        let map = FloatMap {
            width: 2,
            height: 2,
            channels: 1,
            values,
        };
        assert_eq!(
            from_map(&map, 1.0).expect("a mask").shares,
            [0.5, 1.0, 0.0, 0.25]
        );
        for wrong in [f32::NAN, -0.1, 1.5, f32::INFINITY] {
            let mut map = map.clone();
            map.values[1] = wrong;
            let text = from_map(&map, 1.0).expect_err("refused").text;
            assert!(
                text.contains("column 1, row 0 from the lower left"),
                "{text}"
            );
        }
    }

    #[test]
    fn colours_blackness_and_bombs_are_refused() {
        // The last pixel differs by one part of 65,535.
        let nearly = image::ImageBuffer::from_fn(4, 4, |x, y| {
            image::Rgb([900_u16, 900, 900 + u16::from(x + y == 6)])
        });
        let coloured = png(&DynamicImage::ImageRgb16(nearly));
        assert!(
            from_png(coloured, 1.0)
                .expect_err("colours")
                .text
                .contains("coloured")
        );
        let black = png(&DynamicImage::new_luma8(4, 4));
        assert!(
            from_png(black, 1.0)
                .expect_err("black")
                .text
                .contains("black all over")
        );
        // A header of 16,000 x 16,000 RGBA pixels with hardly any data: refused by the limit, not by memory.
        let mut bomb = png(&DynamicImage::new_rgba16(1, 1));
        let side = 16_000_u32.to_be_bytes();
        bomb[16..20].copy_from_slice(&side);
        bomb[20..24].copy_from_slice(&side);
        let crc = crc(&bomb[12..29]).to_be_bytes();
        bomb[29..33].copy_from_slice(&crc);
        let text = from_png(bomb, 1.0).expect_err("a bomb").text;
        assert!(text.to_lowercase().contains("limit"), "{text}");
    }

    /// CRC-32 as PNG has it.
    fn crc(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(u32::MAX, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
                (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
            })
        })
    }
}
