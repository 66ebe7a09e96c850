//! Height maps as pictures: a grey PNG, best of 16 bits; black is the deepest, white the highest. It repeats without a seam.

use std::io::Cursor;
use std::path::Path;

use god_object::HeightMap;
use image::{ColorType, ImageFormat, ImageReader, Limits};

use crate::files::read_bytes;
use crate::problem::Problem;

/// Largest picture file, bytes.
const MAX_PICTURE_BYTES: u64 = 1 << 28;
/// Longest side, pixels: 16 million heights, 300 MB with all their resolutions.
const MAX_SIDE: u32 = 4096;

/// Reads a picture as a height map, or says why it is none.
pub(crate) fn read_height_map(path: &Path) -> Result<HeightMap, Problem> {
    let fail = |text: String| Problem::of_file(path.display(), text);
    let bytes = read_bytes(path, MAX_PICTURE_BYTES)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MAX_SIDE), Some(MAX_SIDE));
    reader.limits(limits);
    let picture = reader.decode().map_err(|error| {
        fail(format!(
            "cannot be read as a height map ({error}); save it as a grey PNG of at most {MAX_SIDE} x {MAX_SIDE} pixels"
        ))
    })?;
    if !matches!(picture.color(), ColorType::L8 | ColorType::L16) {
        return Err(fail(
            "is a coloured picture, but a height map has one grey value for each place; save it as a grey PNG of 16 bits"
                .into(),
        ));
    }
    let grey = picture.into_luma16();
    let heights: Vec<f64> = grey
        .pixels()
        .map(|pixel| f64::from(pixel.0[0]) / f64::from(u16::MAX))
        .collect();
    HeightMap::new(grey.width() as usize, &heights)
        .map_err(|error| fail(format!("is no height map: {error}; use a larger picture")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(
        name: &str,
        picture: &image::DynamicImage,
    ) -> (tempfile::TempDir, std::path::PathBuf) {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join(name);
        picture.save(&path).expect("a written picture");
        (directory, path)
    }

    #[test]
    fn a_ramp_of_sixteen_bits_has_its_slope() {
        let ramp = image::ImageBuffer::from_fn(8, 8, |x, _| image::Luma([(x * 1000) as u16]));
        let (_keep, path) = written("ramp.png", &image::DynamicImage::ImageLuma16(ramp));
        let map = read_height_map(&path).expect("a map");
        let [du, dv] = map.slope(3.5, 2.0, 0.0);
        assert!((du - 1000.0 / 65535.0).abs() < 1e-6, "{du}");
        assert_eq!(dv, 0.0);
    }

    #[test]
    fn pictures_that_are_no_height_map_are_named_with_what_to_do() {
        let (_keep, path) = written("c.png", &image::DynamicImage::new_rgb8(8, 8));
        let fault = read_height_map(&path).expect_err("colours").to_string();
        assert!(fault.contains("c.png: is a coloured picture"), "{fault}");
        let (_keep, path) = written("dot.png", &image::DynamicImage::new_luma8(1, 1));
        let fault = read_height_map(&path).expect_err("a dot").to_string();
        assert!(fault.contains("1 heights make no map of 1 x 1"), "{fault}");
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("text.png");
        std::fs::write(&path, "no picture").expect("written");
        let fault = read_height_map(&path).expect_err("text").to_string();
        assert!(fault.contains("cannot be read as a height map"), "{fault}");
    }
}
