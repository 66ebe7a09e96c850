//! The far surroundings: a gradient over directions, so that neighbouring screens agree on it.

use super::pipeline::{FrameLayout, Layer, Output, PipelineParts};

/// The pipeline of the background; drawn as one triangle without buffers.
pub(crate) fn pipeline(
    device: &wgpu::Device,
    layout: &FrameLayout,
    output: Output,
) -> wgpu::RenderPipeline {
    let parts = PipelineParts {
        label: "background",
        source: include_str!("../../shaders/background.wgsl"),
        vertex: "vertex",
        fragment: "fragment",
        buffers: &[],
        topology: wgpu::PrimitiveTopology::TriangleList,
        layer: Layer::Background,
    };
    layout.pipeline(device, output, &parts)
}
