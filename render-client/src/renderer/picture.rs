//! What one picture (window or image) needs on the graphics card, and pictures that are read back.

use std::sync::mpsc::Sender;

use super::anaglyph::Anaglyph;
use super::chart::ChartDrawing;
use super::gpu::Gpu;
use super::overlay::OverlayQuads;
use super::pipeline::{DEPTH, FrameLayout, Maps, Output};
use super::resources::{attachment, buffer};
use super::warp::WarpTarget;
use crate::error::RenderError;
use crate::stereo::{Part, Picture};
use crate::view::Eye;

/// Attachments and uniforms of one picture at one size.
#[derive(Debug)]
pub struct PictureTarget {
    pub(crate) size: (u32, u32),
    /// Where several samples per pixel are drawn to.
    pub(crate) multisampled: Option<wgpu::TextureView>,
    pub(crate) depth: wgpu::TextureView,
    pub(crate) views: Vec<ViewTarget>,
    /// Combines the views when they lie over each other.
    pub(crate) anaglyph: Option<wgpu::BindGroup>,
    pub(crate) overlay: OverlayQuads,
    /// What is drawn to it comes from pictures of its own, warped.
    pub(crate) warp: Option<Box<WarpTarget>>,
    /// Drawn instead of the scene.
    pub(crate) chart: Option<ChartDrawing>,
}

/// One eye's part of a picture.
#[derive(Debug)]
pub(crate) struct ViewTarget {
    pub(crate) eye: Eye,
    pub(crate) part: Part,
    pub(crate) uniform: wgpu::Buffer,
    pub(crate) group: wgpu::BindGroup,
    /// A picture of this eye's own, when views lie over each other.
    pub(crate) own: Option<wgpu::TextureView>,
}

impl PictureTarget {
    pub(crate) fn new(
        gpu: &Gpu,
        picture: &Picture,
        size: (u32, u32),
        output: Output,
        layout: &FrameLayout,
        maps: Maps<'_>,
        anaglyph: &Anaglyph,
    ) -> Self {
        let device = &gpu.device;
        let only_drawn = wgpu::TextureUsages::empty();
        let depth = Output {
            format: DEPTH,
            ..output
        };
        let single = Output {
            samples: 1,
            ..output
        };
        let view_of = |texture: wgpu::Texture| texture.create_view(&Default::default());
        let views: Vec<ViewTarget> = picture
            .views
            .iter()
            .map(|&(eye, part)| {
                let (uniform, group) = layout.view(device, maps);
                let sampled = wgpu::TextureUsages::TEXTURE_BINDING;
                let own = || view_of(attachment(device, "eye", size, single, sampled));
                ViewTarget {
                    eye,
                    part,
                    uniform,
                    group,
                    own: picture.anaglyph.then(own),
                }
            })
            .collect();
        let combined = match views.as_slice() {
            [
                ViewTarget {
                    own: Some(left), ..
                },
                ViewTarget {
                    own: Some(right), ..
                },
            ] => Some(anaglyph.bind(device, left, right)),
            _ => None,
        };
        let multisampled = (output.samples > 1)
            .then(|| view_of(attachment(device, "samples", size, output, only_drawn)));
        Self {
            size,
            multisampled,
            depth: view_of(attachment(device, "depth", size, depth, only_drawn)),
            views,
            anaglyph: combined,
            overlay: OverlayQuads::new(device),
            warp: None,
            chart: None,
        }
    }
}

/// A picture that is drawn without a window, and can be read back.
#[derive(Debug)]
pub struct OffScreen {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    readback: wgpu::Buffer,
    format: wgpu::TextureFormat,
    size: (u32, u32),
    padded_row: u32,
}

impl OffScreen {
    /// The colour format of off-screen pictures.
    pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

    /// Width and height, pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Whether a picture of this format can be read: four bytes a pixel, red first or blue first.
    pub(crate) fn can_read(format: wgpu::TextureFormat) -> bool {
        matches!(format, Self::FORMAT | wgpu::TextureFormat::Bgra8UnormSrgb)
    }

    /// An empty picture.
    pub fn new(gpu: &Gpu, size: (u32, u32)) -> Self {
        Self::of_format(gpu, size, Self::FORMAT)
    }

    /// The same for a renderer of this format; see [`Self::can_read`].
    pub(crate) fn of_format(
        gpu: &Gpu,
        (width, height): (u32, u32),
        format: wgpu::TextureFormat,
    ) -> Self {
        debug_assert!(Self::can_read(format));
        let output = Output { format, samples: 1 };
        let copied = wgpu::TextureUsages::COPY_SRC;
        let texture = attachment(&gpu.device, "picture", (width, height), output, copied);
        let padded_row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = u64::from(padded_row) * u64::from(height);
        Self {
            view: texture.create_view(&Default::default()),
            readback: buffer(&gpu.device, "readback", bytes, wgpu::BufferUsages::MAP_READ),
            texture,
            format,
            size: (width, height),
            padded_row,
        }
    }

    /// What to draw to.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Asks for the picture to be copied after what `encoder` holds so far.
    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder) {
        let (width, height) = self.size;
        encoder.copy_texture_to_buffer(
            self.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.readback,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.padded_row),
                    rows_per_image: Some(height),
                },
            },
            self.texture.size(),
        );
        debug_assert_eq!(self.texture.size().width, width);
    }

    /// The picture of the last copy that was submitted; waits for it.
    pub fn read(&self, gpu: &Gpu) -> Result<image::RgbaImage, RenderError> {
        let read = gpu.read(&self.readback).map(|rows| self.image(&rows))?;
        self.readback.unmap();
        read.ok_or_else(|| gpu.broken(&"a picture of the wrong size was read back"))
    }

    /// Asks for the last copy that was submitted; `done` hears whether it came, when the device is polled after that.
    pub(crate) fn begin_read(&self, done: Sender<bool>) {
        let mapped = move |result: Result<(), wgpu::BufferAsyncError>| {
            let _ = done.send(result.is_ok()); // nobody listens any more
        };
        self.readback.map_async(wgpu::MapMode::Read, .., mapped);
    }

    /// The picture whose copy came; `None` if it did not.
    pub(crate) fn take_read(&self) -> Option<image::RgbaImage> {
        let read = self.readback.get_mapped_range(..).ok();
        let image = read.and_then(|rows| self.image(&rows));
        self.readback.unmap();
        image
    }

    /// The picture of these rows.
    fn image(&self, rows: &[u8]) -> Option<image::RgbaImage> {
        let (width, height) = self.size;
        let mut pixels = Vec::with_capacity(4 * width as usize * height as usize);
        for row in rows.chunks(self.padded_row as usize) {
            pixels.extend_from_slice(row.get(..4 * width as usize)?);
        }
        if self.format != Self::FORMAT {
            // Blue first.
            pixels
                .chunks_exact_mut(4)
                .for_each(|pixel| pixel.swap(0, 2));
        }
        image::RgbaImage::from_raw(width, height, pixels)
    }
}
