//! The pipelines of the main pass.

use super::mesh::buffer_layouts;
use super::pipeline::{FrameLayout, Layer, Output, PipelineParts};

/// One for each kind of drawn thing.
#[derive(Debug)]
pub(crate) struct Pipelines {
    /// The far surroundings: a gradient over directions, so that neighbouring screens agree on it. Drawn as one triangle without buffers.
    pub(crate) background: wgpu::RenderPipeline,
    /// The grid under the obstacles, which takes their shadow and gives the eye a measure of depth. Drawn as a strip of four vertices without
    /// buffers, and seen from above alone.
    pub(crate) floor: wgpu::RenderPipeline,
    /// Opaque lit bodies.
    pub(crate) mesh: wgpu::RenderPipeline,
    /// Lit bodies through which others are seen; their far sides are not drawn.
    pub(crate) translucent: wgpu::RenderPipeline,
    /// The device ghost.
    pub(crate) ghost: wgpu::RenderPipeline,
}

impl Pipelines {
    /// With `fades` opaque bodies that come too near fade away.
    pub(crate) fn new(
        device: &wgpu::Device,
        layout: &FrameLayout,
        output: Output,
        fades: bool,
    ) -> Self {
        let mesh = PipelineParts {
            label: "mesh",
            source: include_str!("../../shaders/mesh.wgsl"),
            fragment: if fades { "fading" } else { "fragment" },
            buffers: &buffer_layouts(),
            topology: wgpu::PrimitiveTopology::TriangleList,
            layer: Layer::Opaque,
        };
        let translucent = PipelineParts {
            label: "translucent",
            fragment: "translucent",
            layer: Layer::Translucent,
            ..mesh
        };
        let ghost = PipelineParts {
            label: "ghost",
            source: concat!(
                include_str!("../../shaders/mesh.wgsl"),
                include_str!("../../shaders/ghost.wgsl")
            ),
            fragment: "ghost",
            ..translucent
        };
        let background = PipelineParts {
            label: "background",
            source: include_str!("../../shaders/background.wgsl"),
            fragment: "fragment",
            buffers: &[],
            layer: Layer::Background,
            ..mesh
        };
        let floor = PipelineParts {
            label: "floor",
            source: include_str!("../../shaders/floor.wgsl"),
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            layer: Layer::Opaque,
            ..background
        };
        let pipeline = |parts| layout.pipeline(device, output, parts);
        Self {
            background: pipeline(&background),
            floor: pipeline(&floor),
            mesh: pipeline(&mesh),
            translucent: pipeline(&translucent),
            ghost: pipeline(&ghost),
        }
    }
}
