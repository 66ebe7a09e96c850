//! The pipelines of the main pass.

use super::mesh::{buffer_layouts, coordinate_layout};
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
    /// Bodies with textures, where there are any.
    pub(crate) textured: Option<TexturedPipelines>,
}

/// The same with textures: `mesh` and `translucent`.
#[derive(Debug)]
pub(crate) struct TexturedPipelines {
    pub(crate) mesh: wgpu::RenderPipeline,
    pub(crate) translucent: wgpu::RenderPipeline,
}

impl Pipelines {
    /// With `fades` opaque bodies that come too near fade away. `texture`: bindings of a texture, where bodies have some.
    pub(crate) fn new(
        device: &wgpu::Device,
        layout: &FrameLayout,
        output: Output,
        fades: bool,
        texture: Option<&wgpu::BindGroupLayout>,
    ) -> Self {
        let shaders = |label, source| layout.shaders(device, output, label, source);
        let solid = shaders(
            "mesh",
            concat!(
                include_str!("../../shaders/mesh.wgsl"),
                include_str!("../../shaders/ghost.wgsl")
            ),
        );
        let mesh = PipelineParts {
            label: "mesh",
            shaders: &solid,
            vertex: "vertex",
            fragment: if fades { "fading" } else { "fragment" },
            own: None,
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
            fragment: "ghost",
            ..translucent
        };
        let background = PipelineParts {
            label: "background",
            shaders: &shaders("background", include_str!("../../shaders/background.wgsl")),
            fragment: "fragment",
            buffers: &[],
            layer: Layer::Background,
            ..mesh
        };
        let floor = PipelineParts {
            label: "floor",
            shaders: &shaders("floor", include_str!("../../shaders/floor.wgsl")),
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            layer: Layer::Opaque,
            ..background
        };
        let pipeline = |parts| layout.pipeline(device, output, parts);
        let textured = texture
            .map(|texture| TexturedPipelines::new(device, layout, output, fades, texture, &mesh));
        Self {
            textured,
            background: pipeline(&background),
            floor: pipeline(&floor),
            mesh: pipeline(&mesh),
            translucent: pipeline(&translucent),
            ghost: pipeline(&ghost),
        }
    }
}

impl TexturedPipelines {
    /// As `plain` bodies are drawn, with a `texture`.
    fn new(
        device: &wgpu::Device,
        layout: &FrameLayout,
        output: Output,
        fades: bool,
        texture: &wgpu::BindGroupLayout,
        plain: &PipelineParts<'_>,
    ) -> Self {
        let [vertices, instances] = buffer_layouts();
        let buffers = [vertices, instances, coordinate_layout()];
        let source = concat!(
            include_str!("../../shaders/mesh.wgsl"),
            include_str!("../../shaders/textured.wgsl")
        );
        let mesh = PipelineParts {
            label: "textured",
            shaders: &layout.shaders(device, output, "textured", source),
            vertex: "pictured",
            fragment: if fades { "textured_fading" } else { "textured" },
            own: Some(texture),
            buffers: &buffers,
            ..*plain
        };
        let translucent = PipelineParts {
            label: "textured translucent",
            fragment: "textured_translucent",
            layer: Layer::Translucent,
            ..mesh
        };
        Self {
            mesh: layout.pipeline(device, output, &mesh),
            translucent: layout.pipeline(device, output, &translucent),
        }
    }
}
