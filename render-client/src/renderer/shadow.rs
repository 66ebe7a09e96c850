//! The shadow map of the key light: depth of god-object and obstacles as the light sees them.
//!
//! What stands keeps a map of its own. While only the god-object moves, that map is copied and the
//! god-object drawn into the copy; while nothing moves, nothing is drawn.

use super::frame::KeyLight;
use super::gpu::Gpu;
use super::mesh::buffer_layouts;
use super::pipeline::{DEPTH, Output, shader};
use super::resources::{attachment, bind, uniform_buffer};

/// The map, its sampler and the pipeline that draws it.
#[derive(Debug)]
pub(crate) struct ShadowMap {
    pub(crate) view: wgpu::TextureView,
    pub(crate) sampler: wgpu::Sampler,
    map: wgpu::Texture,
    standing: wgpu::Texture,
    standing_view: wgpu::TextureView,
    pipeline: wgpu::RenderPipeline,
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl ShadowMap {
    /// Texels along an edge: sharp enough for one view of a scene, and cheap in software.
    pub(crate) const TEXELS: u32 = 1024;

    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let single = Output {
            format: DEPTH,
            samples: 1,
        };
        let size = (Self::TEXELS, Self::TEXELS);
        let shown = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let map = attachment(device, "shadow map", size, single, shown);
        let copied = wgpu::TextureUsages::COPY_SRC;
        let standing = attachment(device, "standing shadow map", size, single, copied);
        let pipeline = pipeline(device);
        let uniform = uniform_buffer::<[[f32; 4]; 4]>(device, "shadow");
        let layout = pipeline.get_bind_group_layout(0);
        let group = bind(device, "shadow", &layout, &[uniform.as_entire_binding()]);
        Self {
            view: map.create_view(&Default::default()),
            map,
            standing_view: standing.create_view(&Default::default()),
            standing,
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("shadow"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                compare: Some(wgpu::CompareFunction::LessEqual),
                ..Default::default()
            }),
            pipeline,
            uniform,
            group,
        }
    }

    /// Sets the light for the next submission.
    pub(crate) fn aim(&self, queue: &wgpu::Queue, light: &KeyLight) {
        let columns: [[f32; 4]; 4] = light.shadow_from_workbench.cast::<f32>().into();
        queue.write_buffer(&self.uniform, 0, bytemuck::cast_slice(&columns));
    }

    /// Begins the pass of what stands; the caller sets the instances and draws.
    pub(crate) fn begin_standing<'a>(
        &self,
        gpu: &Gpu,
        encoder: &'a mut wgpu::CommandEncoder,
    ) -> wgpu::RenderPass<'a> {
        let cleared = wgpu::LoadOp::Clear(1.0);
        self.begin(
            gpu,
            encoder,
            ("standing shadows", &self.standing_view),
            cleared,
        )
    }

    /// Begins the pass of what moves, over what stands.
    pub(crate) fn begin_moving<'a>(
        &self,
        gpu: &Gpu,
        encoder: &'a mut wgpu::CommandEncoder,
    ) -> wgpu::RenderPass<'a> {
        encoder.copy_texture_to_texture(
            self.standing.as_image_copy(),
            self.map.as_image_copy(),
            self.map.size(),
        );
        self.begin(
            gpu,
            encoder,
            ("moving shadows", &self.view),
            wgpu::LoadOp::Load,
        )
    }

    fn begin<'a>(
        &self,
        gpu: &Gpu,
        encoder: &'a mut wgpu::CommandEncoder,
        (label, view): (&'static str, &wgpu::TextureView),
        load: wgpu::LoadOp<f32>,
    ) -> wgpu::RenderPass<'a> {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: Some(wgpu::Operations {
                    load,
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: gpu.timed(label),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass
    }
}

fn pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let source = include_str!("../../shaders/shadow.wgsl").to_owned();
    let module = shader(device, "shadow", source);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("shadow"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &buffer_layouts(),
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            // Against a surface shadowing itself; the rest is done by the offset along the normal.
            bias: wgpu::DepthBiasState {
                constant: 2,
                slope_scale: 1.5,
                clamp: 0.0,
            },
        }),
        multisample: Default::default(),
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}
