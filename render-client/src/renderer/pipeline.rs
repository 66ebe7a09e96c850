//! What the pipelines have in common: formats, the shared bind group, the way to build one.

use super::environment::EnvironmentMap;
use super::frame::{FrameUniform, OCCLUSION_TEXELS};
use super::gpu::Gpu;
use super::occlusion::OcclusionMap;
use super::resources::{bind, uniform_buffer};
use super::shadow::ShadowMap;

/// Format of all depth textures.
pub(crate) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Colour format and samples that a set of pipelines draws to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Output {
    pub(crate) format: wgpu::TextureFormat,
    pub(crate) samples: u32,
}

/// How a pipeline of the main pass treats colour and depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layer {
    /// Hides what is behind it; seen from its front.
    Opaque,
    /// Lets what is behind it shine through; seen from its front.
    Translucent,
    /// As far away as can be: where nothing is yet.
    Background,
}

/// A pipeline of the main pass.
pub(crate) struct PipelineParts<'a> {
    pub(crate) label: &'a str,
    /// Of [`FrameLayout::shaders`].
    pub(crate) shaders: &'a wgpu::ShaderModule,
    pub(crate) vertex: &'a str,
    pub(crate) fragment: &'a str,
    /// Bindings of its own, beside those of the view.
    pub(crate) own: Option<&'a wgpu::BindGroupLayout>,
    pub(crate) buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub(crate) topology: wgpu::PrimitiveTopology,
    pub(crate) layer: Layer,
}

/// What all views read.
pub(crate) type Maps<'a> = (&'a ShadowMap, &'a EnvironmentMap, &'a OcclusionMap);

/// The shared bind group's layout, and the pipeline layout made of it alone.
#[derive(Debug)]
pub(crate) struct FrameLayout {
    group: wgpu::BindGroupLayout,
    pipeline: wgpu::PipelineLayout,
}

impl FrameLayout {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty,
            count: None,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let shadow_map = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Depth,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let environment = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::Cube,
            multisampled: false,
        };
        let occlusion = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let filtering = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let comparison = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let group = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("frame"),
            entries: &[
                entry(0, wgpu::ShaderStages::VERTEX_FRAGMENT, uniform),
                entry(1, wgpu::ShaderStages::FRAGMENT, shadow_map),
                entry(2, wgpu::ShaderStages::FRAGMENT, comparison),
                entry(3, wgpu::ShaderStages::FRAGMENT, environment),
                entry(4, wgpu::ShaderStages::FRAGMENT, filtering),
                entry(5, wgpu::ShaderStages::FRAGMENT, occlusion),
            ],
        });
        let pipeline = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("frame"),
            bind_group_layouts: &[Some(&group)],
            immediate_size: 0,
        });
        Self { group, pipeline }
    }

    /// A uniform buffer and its bind group: one pair for each view that is drawn in one submission.
    pub(crate) fn view(
        &self,
        device: &wgpu::Device,
        (shadow, environment, occlusion): Maps<'_>,
    ) -> (wgpu::Buffer, wgpu::BindGroup) {
        let buffer = uniform_buffer::<FrameUniform>(device, "frame");
        let resources = [
            buffer.as_entire_binding(),
            wgpu::BindingResource::TextureView(&shadow.view),
            wgpu::BindingResource::Sampler(&shadow.sampler),
            wgpu::BindingResource::TextureView(&environment.view),
            wgpu::BindingResource::Sampler(&environment.sampler),
            wgpu::BindingResource::TextureView(&occlusion.view),
        ];
        let group = bind(device, "frame", &self.group, &resources);
        (buffer, group)
    }

    /// The pipeline layout of these bindings and others.
    fn with(&self, device: &wgpu::Device, own: &wgpu::BindGroupLayout) -> wgpu::PipelineLayout {
        device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("frame and own"),
            bind_group_layouts: &[Some(&self.group), Some(own)],
            immediate_size: 0,
        })
    }

    /// Shaders of the main pass; `source` follows frame.wgsl.
    pub(crate) fn shaders(
        &self,
        device: &wgpu::Device,
        output: Output,
        label: &str,
        source: &str,
    ) -> wgpu::ShaderModule {
        let source = format!(
            "const SMOOTH = {};\nconst RADIUS = {OCCLUSION_TEXELS}.0;\n{}\n{}\n{source}",
            output.samples > 1,
            include_str!("../../shaders/covering.wgsl"),
            include_str!("../../shaders/frame.wgsl"),
        );
        shader(device, label, source)
    }

    /// A pipeline of the main pass.
    pub(crate) fn pipeline(
        &self,
        device: &wgpu::Device,
        output: Output,
        parts: &PipelineParts<'_>,
    ) -> wgpu::RenderPipeline {
        let with_own = parts.own.map(|own| self.with(device, own));
        let background = parts.layer == Layer::Background;
        let recipe = Recipe {
            label: parts.label,
            shaders: parts.shaders,
            layout: Some(with_own.as_ref().unwrap_or(&self.pipeline)),
            entries: [parts.vertex, parts.fragment],
            buffers: parts.buffers,
            primitive: wgpu::PrimitiveState {
                topology: parts.topology,
                cull_mode: (!background).then_some(wgpu::Face::Back),
                ..Default::default()
            },
            depth: Some((
                parts.layer == Layer::Opaque,
                if background {
                    wgpu::CompareFunction::LessEqual
                } else {
                    wgpu::CompareFunction::Less
                },
            )),
            output,
            blend: (parts.layer == Layer::Translucent).then_some(wgpu::BlendState::ALPHA_BLENDING),
        };
        recipe.pipeline(device)
    }
}

/// A pipeline to an output with colours.
struct Recipe<'a> {
    label: &'a str,
    shaders: &'a wgpu::ShaderModule,
    /// Without one: what the shaders bind.
    layout: Option<&'a wgpu::PipelineLayout>,
    /// Of vertex and fragment.
    entries: [&'a str; 2],
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    primitive: wgpu::PrimitiveState,
    /// Whether depth is written, and how it is compared.
    depth: Option<(bool, wgpu::CompareFunction)>,
    output: Output,
    blend: Option<wgpu::BlendState>,
}

impl Recipe<'_> {
    fn pipeline(self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let [vertex, fragment] = self.entries;
        let depth = |(write, compare)| wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(write),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias: Default::default(),
        };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.label),
            layout: self.layout,
            vertex: wgpu::VertexState {
                module: self.shaders,
                entry_point: Some(vertex),
                compilation_options: Default::default(),
                buffers: self.buffers,
            },
            primitive: self.primitive,
            depth_stencil: self.depth.map(depth),
            multisample: wgpu::MultisampleState {
                count: self.output.samples,
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: self.shaders,
                entry_point: Some(fragment),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: self.output.format,
                    blend: self.blend,
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// Entry points of shaders of one pipeline.
const BOTH: [&str; 2] = ["vertex", "fragment"];

/// A pipeline for what lies over everything that its pass has drawn, one part over the other in their order. It has its own bindings.
pub(crate) fn over_all(
    gpu: &Gpu,
    output: Output,
    label: &str,
    source: &str,
    topology: wgpu::PrimitiveTopology,
    vertices: wgpu::VertexBufferLayout<'_>,
) -> wgpu::RenderPipeline {
    let recipe = Recipe {
        label,
        shaders: &shader(&gpu.device, label, source.to_owned()),
        layout: None,
        entries: BOTH,
        buffers: &[Some(vertices)],
        primitive: wgpu::PrimitiveState {
            topology,
            ..Default::default()
        },
        depth: Some((false, wgpu::CompareFunction::Always)),
        output,
        blend: Some(wgpu::BlendState::ALPHA_BLENDING),
    };
    recipe.pipeline(&gpu.device)
}

/// A pipeline that brings finished pictures to an output of `format`: nothing hides anything. It has its own bindings.
pub(crate) fn to_output(
    device: &wgpu::Device,
    format: wgpu::TextureFormat,
    label: &str,
    source: &str,
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
) -> wgpu::RenderPipeline {
    let recipe = Recipe {
        label,
        shaders: &shader(device, label, source.to_owned()),
        layout: None,
        entries: BOTH,
        buffers,
        primitive: Default::default(), // both sides: a mesh may be mirrored
        depth: None,
        output: Output { format, samples: 1 },
        blend: None,
    };
    recipe.pipeline(device)
}

/// A pass that draws to an output anew, black where nothing is drawn.
pub(crate) fn output_pass<'e>(
    gpu: &Gpu,
    encoder: &'e mut wgpu::CommandEncoder,
    label: &'static str,
    target: &wgpu::TextureView,
) -> wgpu::RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        })],
        timestamp_writes: gpu.timed(label),
        ..Default::default()
    })
}

/// A shader module from WGSL that is part of this program.
pub(crate) fn shader(device: &wgpu::Device, label: &str, source: String) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}
