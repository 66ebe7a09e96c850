//! Lays the two eyes' pictures over each other for red and cyan glasses.

use super::pipeline::shader;

/// The pipeline that combines two pictures into one of `format`.
#[derive(Debug)]
pub(crate) struct Anaglyph {
    pipeline: wgpu::RenderPipeline,
}

impl Anaglyph {
    pub(crate) fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let source = include_str!("../../shaders/anaglyph.wgsl").to_owned();
        let module = shader(device, "anaglyph", source);
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("anaglyph"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline }
    }

    /// Names the two pictures to combine.
    pub(crate) fn bind(
        &self,
        device: &wgpu::Device,
        left: &wgpu::TextureView,
        right: &wgpu::TextureView,
    ) -> wgpu::BindGroup {
        let entry = |binding, view| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(view),
        };
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("anaglyph"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[entry(0, left), entry(1, right)],
        })
    }

    /// Draws the combined picture.
    pub(crate) fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        eyes: &wgpu::BindGroup,
        target: &wgpu::TextureView,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("anaglyph"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, eyes, &[]);
        pass.draw(0..3, 0..1);
    }
}
