//! Pictures of what this node shows, for whoever operates the workbench: a frame drawn once more, small, after it was shown.
//!
//! The frame loop only adds the drawing and a copy to what the graphics card has to do. Waiting for it, and compressing, is done on a thread of its own, one
//! at a time.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

use image::RgbaImage;
use png::{BitDepth, ColorType, Compression, Encoder, EncodingError};
use taut_link::{PictureAsk, Shown, ShownPicture};
use taut_proto::picture::MAX_NODE_PICTURES;

use crate::canvas::target_of;
use crate::renderer::{Gpu, OffScreen, Renderer};
use crate::stage::Stage;
use crate::stereo::Picture;
use crate::view::Eyes;

/// Longest that the graphics card is waited for: far beyond a frame.
const COPY_PATIENCE: Duration = Duration::from_secs(3);
/// Time between two looks at it.
const LOOK_PERIOD: Duration = Duration::from_millis(2);

/// A frame that was shown.
pub(crate) struct Frame<'f> {
    pub(crate) gpu: &'f Gpu,
    pub(crate) renderer: &'f Renderer,
    pub(crate) stage: &'f Stage,
    pub(crate) eyes: &'f Eyes,
    /// What the renderer draws to.
    pub(crate) format: wgpu::TextureFormat,
    /// Session time when it was shown, ns.
    pub(crate) shown_ns: u64,
}

/// One picture of it.
pub(crate) struct Part<'f> {
    /// Place of the screen in the stage.
    pub(crate) screen: usize,
    /// Place of the picture among those of the screen.
    pub(crate) place: usize,
    pub(crate) picture: &'f Picture,
    /// Pixels as shown.
    pub(crate) size: (u32, u32),
}

/// Makes the pictures.
#[derive(Clone, Debug, Default)]
pub(crate) struct Snapshots {
    is_busy: Arc<AtomicBool>,
}

/// One that the graphics card has to copy.
struct Copying {
    screen: String,
    image: OffScreen,
}

impl Snapshots {
    /// Draws what is asked for, and answers when it is there. Does not wait.
    pub(crate) fn answer(&self, ask: PictureAsk, frame: &Frame<'_>, parts: &[Part<'_>]) {
        if parts.is_empty() {
            return ask.answer(Err("its windows are hidden".to_owned()));
        }
        if parts.len() > MAX_NODE_PICTURES {
            let (count, most) = (parts.len(), MAX_NODE_PICTURES);
            return ask.answer(Err(format!(
                "it shows {count} pictures, and {most} are sent at most"
            )));
        }
        if !OffScreen::can_read(frame.format) {
            let format = frame.format;
            return ask.answer(Err(format!(
                "its windows have pixels of a kind that is not read ({format:?})"
            )));
        }
        if self.is_busy.swap(true, Ordering::Acquire) {
            return ask.answer(Err("it is busy with the pictures before; ask again".into()));
        }
        let busy = Busy(self.is_busy.clone());
        let device = frame.gpu.device.clone();
        let edge = u32::from(ask.longest_edge());
        let (copies, copied) = draw(frame, parts, edge);
        let shown_ns = frame.shown_ns;
        let work = move || {
            let _busy = busy;
            ask.answer(finish(&device, &copies, &copied, shown_ns));
        };
        let name = "taut-picture".to_owned();
        if let Err(error) = std::thread::Builder::new().name(name).spawn(work) {
            tracing::warn!("no thread for a picture: {error}"); // dropped, the question is answered with no
        }
    }
}

/// While pictures are made.
struct Busy(Arc<AtomicBool>);

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

/// Draws the parts once more, none longer than `edge` pixels; whether each copy came is told in any order.
fn draw(frame: &Frame<'_>, parts: &[Part<'_>], edge: u32) -> (Vec<Copying>, Receiver<bool>) {
    let Frame {
        gpu,
        renderer,
        stage,
        eyes,
        format,
        ..
    } = frame;
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let copies: Vec<Copying> = parts
        .iter()
        .map(|part| {
            let screen = &stage.screens[part.screen];
            let size = fitted(part.size, edge);
            let target = target_of(gpu, renderer, screen, (part.place, part.picture), size);
            let image = OffScreen::of_format(gpu, size, *format);
            renderer.draw(
                gpu,
                &mut encoder,
                &screen.screen,
                eyes,
                &target,
                image.view(),
            );
            image.copy(&mut encoder);
            Copying {
                screen: format!("{}{}", screen.name, part.picture.suffix),
                image,
            }
        })
        .collect();
    gpu.queue.submit([encoder.finish()]);
    let (done, copied) = channel();
    for copy in &copies {
        copy.image.begin_read(done.clone());
    }
    (copies, copied)
}

/// The size of which no side is longer than `edge`, of the same shape.
fn fitted((width, height): (u32, u32), edge: u32) -> (u32, u32) {
    let longest = width.max(height).max(1);
    if longest <= edge {
        return (width.max(1), height.max(1));
    }
    let scaled = |side: u32| {
        let side = f64::from(side) * f64::from(edge) / f64::from(longest);
        (side.round() as u32).clamp(1, edge)
    };
    (scaled(width), scaled(height))
}

/// Waits for the copies, and compresses them.
fn finish(
    device: &wgpu::Device,
    copies: &[Copying],
    copied: &Receiver<bool>,
    shown_ns: u64,
) -> Shown {
    let deadline = Instant::now() + COPY_PATIENCE;
    let mut left = copies.len();
    while left > 0 {
        // The frame loop waits for the card, and hears of the copies, too; a wait in here would be in its way.
        let _ = device.poll(wgpu::PollType::Poll);
        match copied.try_recv() {
            Ok(true) => left -= 1,
            Ok(false) | Err(TryRecvError::Disconnected) => {
                return Err("its graphics card did not give the picture".to_owned());
            }
            Err(TryRecvError::Empty) if Instant::now() < deadline => {
                std::thread::sleep(LOOK_PERIOD);
            }
            Err(TryRecvError::Empty) => {
                return Err("its graphics card takes too long over the picture".to_owned());
            }
        }
    }
    let compressed = |copy: &Copying| {
        let image = copy.image.take_read().ok_or_else(|| {
            "a picture of the wrong size was read back from its graphics card".to_owned()
        })?;
        let bytes = png(&image).map_err(|error| format!("its picture has no PNG: {error}"))?;
        let side = |pixels: u32| u16::try_from(pixels).unwrap_or(u16::MAX);
        Ok(ShownPicture {
            screen: copy.screen.clone(),
            shown_ns,
            size: (side(image.width()), side(image.height())),
            png: bytes,
        })
    };
    copies.iter().map(compressed).collect()
}

/// A PNG without the fourth channel: pictures are opaque.
fn png(image: &RgbaImage) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, image.width(), image.height());
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    let mut writer = encoder.write_header()?;
    let pixels: Vec<u8> = image
        .pixels()
        .flat_map(|pixel| [pixel.0[0], pixel.0[1], pixel.0[2]])
        .collect();
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_proto::picture::{MAX_PICTURE_BYTES, MAX_PICTURE_EDGE};

    #[test]
    fn a_picture_keeps_its_shape_and_gets_no_larger() {
        assert_eq!(fitted((3840, 2160), 1280), (1280, 720));
        assert_eq!(fitted((2160, 3840), 1280), (720, 1280));
        assert_eq!(fitted((320, 107), 1280), (320, 107));
        assert_eq!(
            fitted((20_000, 3), 1280),
            (1280, 1),
            "a line stays a picture"
        );
        assert_eq!(fitted((0, 0), 1280), (1, 1));
    }

    #[test]
    fn the_largest_picture_fits_whatever_is_in_it() {
        let edge = u32::from(MAX_PICTURE_EDGE);
        let mut seed = 1_u32;
        let noise = RgbaImage::from_fn(edge, edge, |_, _| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            image::Rgba((seed >> 3).to_be_bytes())
        });
        let bytes = png(&noise).expect("a PNG");
        assert!(bytes.len() <= MAX_PICTURE_BYTES as usize, "{}", bytes.len());
        let again = image::load_from_memory(&bytes).expect("a PNG").into_rgb8();
        let same = again.pixels().zip(noise.pixels());
        assert!(same.into_iter().all(|(new, old)| new.0[..] == old.0[..3]));
    }
}
