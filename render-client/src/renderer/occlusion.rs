//! How much of the surroundings bodies hide from places near them, out of the shadow map: mean and spread of the depth around each place.
//!
//! It is a second, smaller map, drawn when the shadow map is: a picture takes one sample for each fragment, and all screens and eyes see the
//! same shade, which they would not if it came from what each of them sees.
//! Source: Donnelly and Lauritzen 2006, "Variance shadow maps".

use bytemuck::{Pod, Zeroable};

use super::frame::{Floor, KeyLight, OCCLUSION_TEXELS};
use super::gpu::Gpu;
use super::pipeline::{Output, output_pass, to_output};
use super::resources::{attachment, bind, uniform_buffer};
use super::shadow::ShadowMap;

/// Two half floats are blended by every adapter, unlike two whole ones.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;

/// Texels along an edge: half of the disc's radius to a texel. Twice as many look alike and cost software 4 ms of a frame.
const TEXELS: u32 = ShadowMap::TEXELS * 2 / OCCLUSION_TEXELS;

/// The map and the pipeline that draws it.
#[derive(Debug)]
pub(crate) struct OcclusionMap {
    pub(crate) view: wgpu::TextureView,
    pipeline: wgpu::RenderPipeline,
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Mirrors `struct Map` of occlusion.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct MapUniform {
    /// Depth of the floor in the shadow map: factors of x, y and 1 in clip coordinates.
    floor: [f32; 3],
    /// Disc radii from depth 0 to 1.
    depth: f32,
}

impl OcclusionMap {
    pub(crate) fn new(device: &wgpu::Device, shadow: &ShadowMap) -> Self {
        let output = Output {
            format: FORMAT,
            samples: 1,
        };
        let shown = wgpu::TextureUsages::TEXTURE_BINDING;
        let map = attachment(device, "occlusion", (TEXELS, TEXELS), output, shown);
        let source = concat!(
            include_str!("../../shaders/covering.wgsl"),
            include_str!("../../shaders/occlusion.wgsl")
        );
        let source = format!("const RADIUS = {OCCLUSION_TEXELS}.0;\n{source}");
        let pipeline = to_output(device, FORMAT, "occlusion", &source, &[]);
        let uniform = uniform_buffer::<MapUniform>(device, "occlusion");
        let resources = [
            uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(&shadow.view),
        ];
        let layout = pipeline.get_bind_group_layout(0);
        Self {
            view: map.create_view(&Default::default()),
            group: bind(device, "occlusion", &layout, &resources),
            pipeline,
            uniform,
        }
    }

    /// Draws the map anew from the shadow map; the floor, which is not in that, lies where `floor` is.
    pub(crate) fn draw(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        light: &KeyLight,
        floor: &Floor,
    ) {
        let uniform = MapUniform {
            floor: light.depth_of_level(floor.center.z),
            depth: light.depth_in_discs() as f32,
        };
        gpu.queue
            .write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        let mut pass = output_pass(gpu, encoder, "occlusion", &self.view);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}
