//! The grid under the obstacles, which takes their shadow and gives the eye a measure of depth.

use super::pipeline::{FrameLayout, Layer, Output, PipelineParts};

/// The pipeline of the floor; drawn as a strip of four vertices without buffers, and seen from above alone.
pub(crate) fn pipeline(
    device: &wgpu::Device,
    layout: &FrameLayout,
    output: Output,
) -> wgpu::RenderPipeline {
    let parts = PipelineParts {
        label: "floor",
        source: include_str!("../../shaders/floor.wgsl"),
        vertex: "vertex",
        fragment: "fragment",
        buffers: &[],
        topology: wgpu::PrimitiveTopology::TriangleStrip,
        layer: Layer::Opaque,
    };
    layout.pipeline(device, output, &parts)
}
