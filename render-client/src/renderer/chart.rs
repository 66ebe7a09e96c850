//! Draws a calibration picture where the scene would be drawn: its parts are projected on the processor, few and exactly.

use bytemuck::{Pod, Zeroable};
use nalgebra::{Matrix4, Point3};

use super::gpu::Gpu;
use super::overlay::{OverlayPipeline, part_of};
use super::pipeline::{Output, over_all};
use super::resources::{bind, filled};
use crate::calibration::{Chart, ChartQuad};
use crate::hud::Mark;
use crate::view::Eye;

/// Mirrors the inputs of chart.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct ChartVertex {
    clip: [f32; 4],
    colour: [f32; 4],
    texel: [f32; 2],
}

/// A calibration picture for one eye.
#[derive(Debug)]
pub(crate) struct ChartDrawing {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    chart: Chart,
    eye: Eye,
}

impl ChartDrawing {
    pub(crate) fn new(
        gpu: &Gpu,
        output: Output,
        text: &OverlayPipeline,
        chart: &Chart,
        eye: Eye,
    ) -> Self {
        const ATTRIBUTES: [wgpu::VertexAttribute; 3] =
            wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4, 2 => Float32x2];
        let source = include_str!("../../shaders/chart.wgsl");
        let vertices = wgpu::VertexBufferLayout {
            array_stride: size_of::<ChartVertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &ATTRIBUTES,
        };
        let triangles = wgpu::PrimitiveTopology::TriangleList;
        let pipeline = over_all(gpu, output, "chart", source, triangles, vertices);
        let layout = pipeline.get_bind_group_layout(0);
        let group = bind(&gpu.device, "chart", &layout, &text.resources());
        Self {
            pipeline,
            group,
            chart: chart.clone(),
            eye,
        }
    }

    /// What lies flat in the plane of the picture, on a screen `shape` times as wide as high.
    pub(crate) fn marks(&self, shape: f32) -> Vec<Mark> {
        self.chart.marks(self.eye, shape)
    }

    /// Draws what lies on the screen itself.
    pub(crate) fn draw(&self, gpu: &Gpu, pass: &mut wgpu::RenderPass<'_>, clip: &Matrix4<f64>) {
        let quads = self.chart.quads();
        let vertices: Vec<ChartVertex> =
            quads.iter().flat_map(|quad| corners(quad, clip)).collect();
        if vertices.is_empty() {
            return;
        }
        let usage = wgpu::BufferUsages::VERTEX;
        let buffer = filled(&gpu.device, "chart", &vertices, usage);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_vertex_buffer(0, buffer.slice(..));
        pass.draw(0..vertices.len() as u32, 0..1);
    }
}

/// Two triangles.
fn corners(quad: &ChartQuad, clip: &Matrix4<f64>) -> [ChartVertex; 6] {
    let [left, top, right, bottom] = part_of(quad.letter);
    let texels = [[left, bottom], [right, bottom], [right, top], [left, top]];
    [0, 1, 2, 0, 2, 3].map(|i| {
        let point: &Point3<f64> = &quad.corners[i];
        ChartVertex {
            clip: (clip * point.to_homogeneous()).cast::<f32>().into(),
            colour: quad.colour,
            texel: texels[i],
        }
    })
}
