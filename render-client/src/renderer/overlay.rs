//! Text over a picture: the letters of a bitmap font in one texture, an instance per letter.

use bytemuck::{Pod, Zeroable};
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use super::gpu::Gpu;
use super::pipeline::{Output, over_all};
use super::resources::{bind, blending_sampler, buffer};
use crate::hud::{MAX_MARKS, Mark};

/// First and last letter of the texture; others are shown as `UNKNOWN`. The last place is full: for boxes.
const FIRST: char = ' ';
const LAST: char = '~';
const UNKNOWN: char = '?';

/// Letters in a row of the texture.
const COLUMNS: u32 = 16;

/// Height of a place of the texture, in texels, and the empty border around its letter, which keeps neighbours out of
/// the smaller copies.
const CELL: u32 = 40;
const BORDER: u32 = 4;

/// Sizes of the texture, each half as large as the one before: small text does not flicker.
const LEVELS: u32 = 3;

/// One letter or box. Mirrors the inputs of overlay.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Quad {
    place: [f32; 4],
    part: [f32; 4],
    colour: [f32; 4],
}

/// What draws text to pictures of one format.
#[derive(Debug)]
pub(crate) struct OverlayPipeline {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    letters: wgpu::TextureView,
    sampler: wgpu::Sampler,
}

/// The text of one picture.
#[derive(Debug)]
pub(crate) struct OverlayQuads {
    buffer: wgpu::Buffer,
}

impl OverlayPipeline {
    pub(crate) fn new(gpu: &Gpu, output: Output) -> Self {
        let device = &gpu.device;
        const ATTRIBUTES: [wgpu::VertexAttribute; 3] =
            wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4, 2 => Float32x4];
        let source = include_str!("../../shaders/overlay.wgsl");
        let quads = wgpu::VertexBufferLayout {
            array_stride: size_of::<Quad>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &ATTRIBUTES,
        };
        let strip = wgpu::PrimitiveTopology::TriangleStrip;
        let pipeline = over_all(gpu, output, "overlay", source, strip, quads);
        let (letters, sampler) = (letters(gpu), blending_sampler(device, "letters"));
        let layout = pipeline.get_bind_group_layout(0);
        Self {
            group: bind(device, "letters", &layout, &resources(&letters, &sampler)),
            pipeline,
            letters,
            sampler,
        }
    }

    /// The letters for other pipelines, as [`part_of`] finds them.
    pub(crate) fn resources(&self) -> [wgpu::BindingResource<'_>; 2] {
        resources(&self.letters, &self.sampler)
    }

    /// Draws `count` quads over what the pass has drawn in its viewport.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, quads: &OverlayQuads, count: u32) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_vertex_buffer(0, quads.buffer.slice(..));
        pass.draw(0..4, 0..count);
    }
}

fn resources<'t>(
    letters: &'t wgpu::TextureView,
    sampler: &'t wgpu::Sampler,
) -> [wgpu::BindingResource<'t>; 2] {
    [
        wgpu::BindingResource::TextureView(letters),
        wgpu::BindingResource::Sampler(sampler),
    ]
}

impl OverlayQuads {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let size = (MAX_MARKS * size_of::<Quad>()) as u64;
        Self {
            buffer: buffer(device, "overlay", size, wgpu::BufferUsages::VERTEX),
        }
    }

    /// Sets the text for the next submission; says how many quads it has.
    pub(crate) fn set(&self, queue: &wgpu::Queue, marks: &[Mark]) -> u32 {
        let quads: Vec<Quad> = marks.iter().take(MAX_MARKS).map(quad).collect();
        queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&quads));
        quads.len() as u32
    }
}

fn quad(mark: &Mark) -> Quad {
    Quad {
        place: mark.place,
        part: part_of(mark.letter),
        colour: mark.colour,
    }
}

/// The part of the letters' texture that shows a letter, or a full place: left, top, right, bottom.
pub(crate) fn part_of(letter: Option<char>) -> [f32; 4] {
    let (size_x, size_y) = texture_size();
    let (x, y) = match letter {
        Some(letter) => place_of(letter),
        None => cell(places() - 1),
    };
    let (width, height) = letter_size();
    // A box takes the middle of its full place only: its edges are sharp.
    let inset = if letter.is_some() { 0 } else { height / 3 };
    let u = |texels: u32| texels as f32 / size_x as f32;
    let v = |texels: u32| texels as f32 / size_y as f32;
    let left = if inset == 0 { x } else { x + width / 2 };
    let right = if inset == 0 { x + width } else { left };
    [u(left), v(y + inset), u(right), v(y + height - inset)]
}

/// Texels of a letter: those of the bitmap font.
fn letter_size() -> (u32, u32) {
    (
        get_raster_width(FontWeight::Bold, RasterHeight::Size32) as u32,
        RasterHeight::Size32.val() as u32,
    )
}

/// Number of places: the letters and the full one.
fn places() -> u32 {
    LAST as u32 - FIRST as u32 + 2
}

/// Upper left texel of a place's letter.
fn cell(place: u32) -> (u32, u32) {
    (
        place % COLUMNS * CELL + BORDER,
        place / COLUMNS * CELL + BORDER,
    )
}

fn place_of(letter: char) -> (u32, u32) {
    let known = (FIRST..=LAST).contains(&letter);
    let letter = if known { letter } else { UNKNOWN };
    cell(letter as u32 - FIRST as u32)
}

fn texture_size() -> (u32, u32) {
    (COLUMNS * CELL, places().div_ceil(COLUMNS) * CELL)
}

/// Coverage of all letters, 0 to 255, row by row.
fn coverage() -> Vec<u8> {
    let (width, height) = texture_size();
    let mut texels = vec![0; (width * height) as usize];
    let mut put = |x: u32, y: u32, value: u8| texels[(y * width + x) as usize] = value;
    for letter in FIRST..=LAST {
        let (x, y) = place_of(letter);
        let raster = get_raster(letter, FontWeight::Bold, RasterHeight::Size32);
        for (down, row) in raster.iter().flat_map(|r| r.rows()).enumerate() {
            for (across, &value) in row.iter().enumerate() {
                put(x + across as u32, y + down as u32, value);
            }
        }
    }
    let (x, y) = cell(places() - 1);
    let (wide, high) = letter_size();
    for down in 0..high {
        for across in 0..wide {
            put(x + across, y + down, u8::MAX);
        }
    }
    texels
}

/// Half the size: the mean of each four texels.
fn halved(texels: &[u8], (width, height): (u32, u32)) -> Vec<u8> {
    let at = |x: u32, y: u32| u32::from(texels[(y * width + x) as usize]);
    let mean = |x, y| (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1) + 2) / 4;
    let rows = (0..height / 2).flat_map(|y| (0..width / 2).map(move |x| (2 * x, 2 * y)));
    rows.map(|(x, y)| mean(x, y) as u8).collect()
}

fn letters(gpu: &Gpu) -> wgpu::TextureView {
    let (width, height) = texture_size();
    let size = |level: u32| (width >> level, height >> level);
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("letters"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: LEVELS,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let mut texels = coverage();
    for level in 0..LEVELS {
        let (width, height) = size(level);
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                mip_level: level,
                ..texture.as_image_copy()
            },
            &texels,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(width),
                rows_per_image: Some(height),
            },
            wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
        );
        texels = halved(&texels, (width, height));
    }
    texture.create_view(&Default::default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_that_the_hud_may_write_has_ink_and_a_place_of_its_own() {
        let texels = coverage();
        let (width, _) = texture_size();
        let (wide, high) = letter_size();
        assert!(wide + 2 * BORDER <= CELL && high + 2 * BORDER <= CELL);
        for letter in ('!'..=LAST).chain([UNKNOWN]) {
            let (x, y) = place_of(letter);
            let inked = (0..high * wide)
                .any(|i| texels[((y + i / wide) * width + x + i % wide) as usize] > 200);
            assert!(inked, "{letter}");
        }
        assert_eq!(place_of('ü'), place_of(UNKNOWN));
    }

    #[test]
    fn places_halve_evenly_at_every_level() {
        let (width, height) = texture_size();
        assert!(width.is_multiple_of(1 << LEVELS) && height.is_multiple_of(1 << LEVELS));
        let bright =
            |texels: &[u8]| texels.iter().map(|t| f64::from(*t)).sum::<f64>() / texels.len() as f64;
        let full = coverage();
        let half = halved(&full, (width, height));
        assert_eq!(half.len() * 4, full.len());
        assert!((bright(&full) - bright(&half)).abs() < 0.5);
    }
}
