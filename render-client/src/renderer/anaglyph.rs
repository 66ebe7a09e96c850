//! Lays the two eyes' pictures over each other for red and cyan glasses.

use super::gpu::Gpu;
use super::pipeline::{output_pass, to_output};
use super::resources::bind;

/// The pipeline that combines two pictures into one of `format`.
#[derive(Debug)]
pub(crate) struct Anaglyph {
    pipeline: wgpu::RenderPipeline,
}

impl Anaglyph {
    pub(crate) fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let source = include_str!("../../shaders/anaglyph.wgsl");
        let pipeline = to_output(device, format, "anaglyph", source, &[]);
        Self { pipeline }
    }

    /// Names the two pictures to combine.
    pub(crate) fn bind(
        &self,
        device: &wgpu::Device,
        left: &wgpu::TextureView,
        right: &wgpu::TextureView,
    ) -> wgpu::BindGroup {
        let layout = self.pipeline.get_bind_group_layout(0);
        let eyes = [left, right].map(wgpu::BindingResource::TextureView);
        bind(device, "anaglyph", &layout, &eyes)
    }

    /// Draws the combined picture.
    pub(crate) fn draw(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        eyes: &wgpu::BindGroup,
        target: &wgpu::TextureView,
    ) {
        let mut pass = output_pass(gpu, encoder, "anaglyph", target);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, eyes, &[]);
        pass.draw(0..3, 0..1);
    }
}
