//! Pictures of one size as a film in one file: an animated PNG, which browsers play, round and round.

use std::io::Cursor;

use image::RgbaImage;
use png::{BitDepth, BlendOp, ColorType, Compression, Encoder, EncodingError};

/// What a pixel is that stays as it was in the picture before.
const UNCHANGED: [u8; 4] = [0; 4];

/// The bytes of the film: `count` pictures, drawn one by one, that together take `seconds`.
///
/// A pixel that is as it was before takes no room. Pictures are opaque: their fourth channel is not read.
///
/// # Errors
/// What `picture` says, or what the encoder says of no pictures or of two sizes, made to an `E`.
pub(crate) fn film<E: From<EncodingError>>(
    count: u32,
    seconds: f64,
    mut picture: impl FnMut(u32) -> Result<RgbaImage, E>,
) -> Result<Vec<u8>, E> {
    let first = picture(0)?;
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = Encoder::new(&mut bytes, first.width(), first.height());
    encoder.set_color(ColorType::Rgba);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::High);
    encoder.set_animated(count, 0)?; // 0: for ever
    encoder.set_frame_delay(delay_ms(count, seconds), 1000)?;
    encoder.set_blend_op(BlendOp::Over)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(opaque(&first).as_raw())?;
    let mut before = first;
    for view in 1..count {
        let next = picture(view)?;
        writer.write_image_data(changed(&before, &next).as_raw())?;
        before = next;
    }
    writer.finish()?;
    Ok(bytes.into_inner())
}

/// Time of one picture, ms.
fn delay_ms(count: u32, seconds: f64) -> u16 {
    (1e3 * seconds / f64::from(count.max(1))).round() as u16 // saturates: a minute
}

fn opaque(image: &RgbaImage) -> RgbaImage {
    let mut image = image.clone();
    image.pixels_mut().for_each(|pixel| pixel.0[3] = u8::MAX);
    image
}

/// The pixels of `next` that are not those of `before`.
fn changed(before: &RgbaImage, next: &RgbaImage) -> RgbaImage {
    let mut image = opaque(next);
    for (pixel, old) in image.pixels_mut().zip(before.pixels()) {
        if pixel.0[..3] == old.0[..3] {
            pixel.0 = UNCHANGED;
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::png::PngDecoder;
    use image::{AnimationDecoder, Rgba};

    /// A bright square that moves to the right over a ground that does not.
    fn square(view: u32) -> RgbaImage {
        RgbaImage::from_fn(64, 48, |x, y| {
            let within = (10 * view..10 * view + 8).contains(&x) && (20..28).contains(&y);
            Rgba(if within {
                [250, 240, 30, 255]
            } else {
                [x as u8, (7 * y) as u8, 90, 255]
            })
        })
    }

    #[test]
    fn a_film_plays_the_pictures_that_were_drawn() {
        let bytes = film(5, 2.0, |view| Ok::<_, EncodingError>(square(view))).expect("a film");
        let decoder = PngDecoder::new(Cursor::new(&bytes)).expect("a PNG");
        assert!(decoder.is_apng().expect("read"));
        let frames = decoder.apng().expect("animated").into_frames();
        let frames = frames.collect_frames().expect("decoded");
        assert_eq!(frames.len(), 5);
        for (view, frame) in (0..).zip(frames) {
            assert_eq!(frame.delay().numer_denom_ms(), (400, 1));
            assert_eq!(frame.into_buffer(), square(view), "picture {view}");
        }
        // Who does not know films sees the first picture.
        let still = image::load_from_memory(&bytes).expect("a PNG").into_rgba8();
        assert_eq!(still, square(0));
    }

    #[test]
    fn what_stays_takes_no_room_and_pictures_of_two_sizes_are_refused() {
        let size = |count| {
            let still = film(count, 1.0, |_| Ok::<_, EncodingError>(square(0)));
            still.expect("a film").len()
        };
        assert!(size(11) - size(1) < 10 * 200, "{} {}", size(11), size(1));
        let mixed = film(2, 1.0, |view| {
            Ok::<_, EncodingError>(RgbaImage::new(8 + view, 8))
        });
        assert!(mixed.is_err());
    }
}
