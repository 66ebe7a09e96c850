//! The light around a scene as a picture: an equirectangular Radiance file (.hdr), reduced to what nodes draw with.

use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, ImageReader, Limits};
use taut_proto::Panorama;

use crate::files::read_bytes;
use crate::problem::Problem;

/// Largest file, bytes.
const MAX_FILE_BYTES: u64 = 1 << 28;
/// Longest side, pixels: 400 MB while it is read.
const MAX_SIDE: u32 = 8192;
/// Most bytes of a picture as floats that a byte of its file can stand for: a run of 127 takes two bytes of each of four channels.
const MOST_PER_BYTE: u64 = 127 * 12 / 8 + 1;

/// Reads the light around a scene, or says why a file has none.
///
/// # Errors
/// It cannot be opened, is no such picture, or not twice as wide as high.
pub fn read_environment(path: &Path) -> Result<Panorama, Problem> {
    let fail = |text: String| Problem::of_file(path.display(), text);
    let bytes = read_bytes(path, MAX_FILE_BYTES)?;
    // What the file cannot hold is not made room for, whatever its header says.
    let most = MOST_PER_BYTE * bytes.len() as u64;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Hdr);
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MAX_SIDE), Some(MAX_SIDE));
    limits.max_alloc = Some(most);
    reader.limits(limits);
    let picture = reader.decode().map_err(|error| {
        fail(format!(
            "cannot be read as the light around a scene ({error}); save it as a Radiance picture (.hdr) of at most {MAX_SIDE} pixels a side"
        ))
    })?;
    let (width, height) = (picture.width(), picture.height());
    if width != 2 * height || height == 0 {
        return Err(fail(format!(
            "is {width} x {height} pixels, but a picture of all directions is twice as wide as high; save it as an equirectangular one"
        )));
    }
    let picture = picture.into_rgb32f();
    // The mean of what a texel covers; by hand, since resizing in `image` cuts off what is brighter than 1.
    let covered = |place: usize, of: usize, pixels: u32| {
        let start = place * pixels as usize / of;
        let end = (place + 1) * pixels as usize / of;
        start as u32..end.max(start + 1) as u32
    };
    Ok(Panorama::from_fn(|column, row| {
        let (across, down) = (
            covered(column, Panorama::WIDTH, width),
            covered(row, Panorama::HEIGHT, height),
        );
        let share = 1.0 / (across.len() * down.len()) as f32;
        let mut mean = [0.0; 3];
        for pixel in down.flat_map(|y| across.clone().map(move |x| (x, y))) {
            let light = picture.get_pixel(pixel.0, pixel.1).0;
            mean = std::array::from_fn(|i| mean[i] + share * light[i]);
        }
        mean
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, Rgb32FImage};

    fn written(name: &str, picture: &Rgb32FImage) -> (tempfile::TempDir, std::path::PathBuf) {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join(name);
        let mut bytes = Vec::new();
        let pixels: Vec<Rgb<f32>> = picture.pixels().copied().collect();
        image::codecs::hdr::HdrEncoder::new(&mut bytes)
            .encode(&pixels, picture.width() as usize, picture.height() as usize)
            .expect("encoded");
        std::fs::write(&path, bytes).expect("written");
        (directory, path)
    }

    #[test]
    fn light_keeps_its_place_and_its_mean() {
        // Twice as fine as a panorama: red above, and a lamp of 2 x 2 pixels, one texel, of 800.
        let lamp = |x: u32, y: u32| (300..302).contains(&x) && (180..182).contains(&y);
        let picture = Rgb32FImage::from_fn(512, 256, |x, y| {
            Rgb(if lamp(x, y) {
                [800.0; 3]
            } else if y < 128 {
                [2.0, 0.0, 0.0]
            } else {
                [0.0, 0.5, 0.5]
            })
        });
        let (_keep, path) = written("studio.hdr", &picture);
        let panorama = read_environment(&path).expect("light");
        let red = panorama.light(10, 20);
        assert!((red[0] - 2.0).abs() < 0.02 && red[1] < 0.01, "{red:?}");
        let lamp = panorama.light(150, 90);
        assert!(
            lamp.iter().all(|part| (part - 800.0).abs() < 8.0),
            "{lamp:?}"
        );
        assert!(panorama.light(151, 90)[0] < 0.01 && panorama.light(150, 89)[0] < 0.01);
    }

    #[test]
    fn pictures_that_are_no_light_are_named_with_what_to_do() {
        let fault = |name: &str, picture: &Rgb32FImage| {
            let (_keep, path) = written(name, picture);
            read_environment(&path).expect_err(name).to_string()
        };
        let square = fault("square.hdr", &Rgb32FImage::new(16, 16));
        assert!(
            square.contains("square.hdr: is 16 x 16 pixels") && square.contains("equirectangular"),
            "{square}"
        );
        let directory = tempfile::tempdir().expect("a directory");
        let of_text = |name: &str, text: &str| {
            let path = directory.path().join(name);
            std::fs::write(&path, text).expect("written");
            read_environment(&path).expect_err(name).to_string()
        };
        let fault = of_text("text.hdr", "no picture");
        assert!(fault.contains("save it as a Radiance picture"), "{fault}");
        let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 0\n";
        let fault = of_text("empty.hdr", header);
        assert!(fault.contains("empty.hdr: is 0 x 0 pixels"), "{fault}");
    }
}
