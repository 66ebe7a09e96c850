//! Pictures on surfaces as files: PNG and JPEG.

use std::io::Cursor;

use image::{ImageFormat, ImageReader, Limits};
use taut_proto::Texture;
use taut_proto::texture::halved;

/// Largest picture file, bytes.
pub(crate) const MAX_PICTURE_BYTES: u64 = 1 << 28;
/// Longest side that is read, pixels: 256 MB as texels.
const MAX_SIDE: u32 = 8192;
/// Most bytes of a picture that a byte of its file can stand for: DEFLATE makes 1032 of one, a JPEG about as many.
const MOST_PER_BYTE: u64 = 2048;

/// A picture that was read.
#[derive(Clone, Debug)]
pub(crate) struct ReadPicture {
    pub(crate) texture: Texture,
    /// Width and height in the file, pixels.
    pub(crate) size: (u32, u32),
    /// How names of such files end.
    pub(crate) ending: &'static str,
}

/// Reads a picture, at half its size or less where it has more than [`Texture::MAX_SIDE`] a side; or says why not, as the end of a sentence. For tests of its
/// bounds, besides.
///
/// # Errors
/// Another format than PNG and JPEG, damaged bytes, more than 8192 pixels a side.
pub fn read_picture(bytes: &[u8]) -> Result<Texture, String> {
    decode(bytes).map(|read| read.texture)
}

/// [`read_picture`], with what else is known of it.
pub(crate) fn decode(bytes: &[u8]) -> Result<ReadPicture, String> {
    let (format, ending) = match image::guess_format(bytes) {
        Ok(format @ ImageFormat::Png) => (format, "png"),
        Ok(format @ ImageFormat::Jpeg) => (format, "jpg"),
        _ => return Err("is no PNG or JPEG picture; save it as one".to_owned()),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MAX_SIDE), Some(MAX_SIDE));
    // What the file cannot hold is not made room for, whatever its header says; 8 bytes a pixel are the most that a format has.
    let most = 8 * u64::from(MAX_SIDE) * u64::from(MAX_SIDE);
    limits.max_alloc = Some(most.min(MOST_PER_BYTE * bytes.len() as u64));
    reader.limits(limits);
    let picture = reader.decode().map_err(|error| {
        format!("cannot be read ({error}); save it again, with at most {MAX_SIDE} pixels a side")
    })?;
    let size = (picture.width(), picture.height());
    let texels = picture.into_rgba8().into_raw();
    let (texels, _) = texels.as_chunks::<4>();
    let mut reduced = size;
    let mut smaller: Option<Vec<[u8; 4]>> = None;
    while reduced.0.max(reduced.1) > Texture::MAX_SIDE {
        let (size, half) = halved(reduced, smaller.as_deref().unwrap_or(texels));
        (reduced, smaller) = (size, Some(half));
    }
    let texels = smaller.unwrap_or_else(|| texels.to_vec());
    let texture = Texture::new(reduced, texels).map_err(|_| "has no pixels".to_owned())?;
    Ok(ReadPicture {
        texture,
        size,
        ending,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{DynamicImage, GrayImage, Luma, Rgb, RgbImage, Rgba, RgbaImage};
    use proptest::prelude::*;

    fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).expect("encoded");
        bytes.into_inner()
    }

    proptest! {
        #[test]
        fn a_damaged_picture_is_read_or_refused(place in 0usize..2000, value: u8, jpeg: bool) {
            let picture = RgbImage::from_fn(16, 8, |x, y| Rgb([16 * x as u8, 32 * y as u8, 0]));
            let format = if jpeg { ImageFormat::Jpeg } else { ImageFormat::Png };
            let mut bytes = encoded(&picture.into(), format);
            let place = place % bytes.len();
            bytes[place] = value;
            let _ = read_picture(&bytes);
            let _ = read_picture(&bytes[..place]);
        }
    }

    #[test]
    fn every_kind_of_pixel_becomes_the_same_kind_of_texel() {
        let grey = GrayImage::from_pixel(3, 2, Luma([100]));
        let rgba = RgbaImage::from_pixel(3, 2, Rgba([100, 100, 100, 255]));
        let grey: DynamicImage = grey.into();
        for picture in [
            grey.clone(),
            grey.to_luma16().into(),
            grey.to_rgb8().into(),
            grey.to_rgb16().into(),
            rgba.into(),
        ] {
            let read = read_picture(&encoded(&picture, ImageFormat::Png)).expect("a picture");
            assert_eq!(read.size(), (3, 2));
            assert!(read.texels().iter().all(|t| *t == [100, 100, 100, 255]));
        }
        let jpeg = decode(&encoded(&grey, ImageFormat::Jpeg)).expect("a picture");
        assert_eq!((jpeg.size, jpeg.ending), ((3, 2), "jpg"));
        let near = |t: &[u8; 4]| t[..3].iter().all(|c| c.abs_diff(100) < 3) && t[3] == 255;
        assert!(jpeg.texture.texels().iter().all(near));
    }

    #[test]
    fn a_picture_that_is_too_large_is_halved_and_one_beyond_all_bounds_refused() {
        let wide = GrayImage::from_fn(8192, 2, |x, _| Luma([if x < 4096 { 0 } else { 255 }]));
        let read = decode(&encoded(&wide.into(), ImageFormat::Png)).expect("a picture");
        assert_eq!((read.size, read.texture.size()), ((8192, 2), (4096, 1)));
        let texels = read.texture.texels();
        assert_eq!((texels[2047][0], texels[2048][0]), (0, 255));
        let beyond = encoded(&GrayImage::new(8193, 1).into(), ImageFormat::Png);
        let text = read_picture(&beyond).expect_err("too wide");
        assert!(text.contains("at most 8192 pixels"), "{text}");
    }

    #[test]
    fn what_a_file_cannot_hold_is_not_made_room_for() {
        // A header of 8192 x 8192 pixels, and nothing behind it.
        let mut bytes = encoded(&GrayImage::new(1, 1).into(), ImageFormat::Png);
        bytes[16..24].copy_from_slice(&[0, 0, 32, 0, 0, 0, 32, 0]);
        assert!(read_picture(&bytes).is_err());
        let text = read_picture(b"RIFF....WEBPVP8 ").expect_err("another format");
        assert!(text.contains("no PNG or JPEG"), "{text}");
    }
}
