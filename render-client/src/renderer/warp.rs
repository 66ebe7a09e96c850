//! The pass that brings off-screen pictures to an output, along a mesh, with blend mask and colour correction.

use bytemuck::{Pod, Zeroable};
use nalgebra::{Matrix4, Point3};
use taut_screens::{Mask, OutputNode, Target};
use wgpu::util::DeviceExt;

use super::gpu::Gpu;
use super::picture::PictureTarget;
use super::pipeline::{output_pass, to_output};
use super::resources::{bind, blending_sampler, filled, uniform_buffer};
use crate::calibration::Chart;
use crate::correction::{Correction, Hull, clip_from_target};
use crate::view::{ClipPlanes, Eye, Eyes, Screen};

/// Mirrors `Correction` in warp.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct WarpUniform {
    scene_from_target: [[f32; 4]; 4],
    red: [f32; 4],
    green: [f32; 4],
    blue: [f32; 4],
    gamma: [f32; 4],
}

/// The pipeline of the pass, for outputs of one format.
#[derive(Debug)]
pub(crate) struct WarpPipeline {
    pipeline: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
}

/// What one picture needs to be corrected.
#[derive(Debug)]
pub(crate) struct WarpTarget {
    scenes: Vec<SceneTexture>,
    target: Target,
    hull: Option<Hull>,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    count: u32,
    /// All but the projection.
    uniform: WarpUniform,
}

/// The scene as one eye sees it, before it is warped.
#[derive(Debug)]
pub(crate) struct SceneTexture {
    pub(crate) picture: PictureTarget,
    pub(crate) view: wgpu::TextureView,
    eye: Eye,
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// How to correct one picture of a screen.
#[derive(Clone, Copy, Debug)]
pub struct Corrected<'c> {
    /// The correction of the screen.
    pub correction: &'c Correction,
    /// Place of the picture among those of the screen.
    pub picture: usize,
    /// Drawn instead of the scene.
    pub chart: Option<&'c Chart>,
}

impl WarpPipeline {
    pub(crate) fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        const ATTRIBUTES: [wgpu::VertexAttribute; 3] =
            wgpu::vertex_attr_array![0 => Float32x2, 1 => Float32x3, 2 => Float32];
        let nodes = wgpu::VertexBufferLayout {
            array_stride: size_of::<OutputNode>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &ATTRIBUTES,
        };
        let source = include_str!("../../shaders/warp.wgsl");
        let pipeline = to_output(device, format, "warp", source, &[Some(nodes)]);
        Self {
            pipeline,
            sampler: blending_sampler(device, "warp"),
        }
    }

    /// Draws scenes, warped, each into its pixels of `target`: left, top, width, height.
    pub(crate) fn draw<'s>(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        warp: &WarpTarget,
        scenes: impl IntoIterator<Item = (&'s SceneTexture, [u32; 4])>,
        target: &wgpu::TextureView,
    ) {
        let mut pass = output_pass(gpu, encoder, "warp", target);
        pass.set_pipeline(&self.pipeline);
        pass.set_vertex_buffer(0, warp.vertices.slice(..));
        pass.set_index_buffer(warp.indices.slice(..), wgpu::IndexFormat::Uint32);
        for (scene, [x, y, width, height]) in scenes {
            pass.set_viewport(x as f32, y as f32, width as f32, height as f32, 0.0, 1.0);
            pass.set_scissor_rect(x, y, width, height);
            pass.set_bind_group(0, &scene.group, &[]);
            pass.draw_indexed(0..warp.count, 0, 0..1);
        }
    }

    /// Brings mesh and mask of a picture of `size` pixels to the graphics card; `scenes` are what is warped, one for each view.
    pub(crate) fn target(
        &self,
        gpu: &Gpu,
        corrected: &Corrected<'_>,
        (width, height): (u32, u32),
        scenes: Vec<(Eye, PictureTarget, wgpu::TextureView)>,
    ) -> WarpTarget {
        let Corrected {
            correction,
            picture,
            chart,
        } = corrected;
        let mesh = correction.mesh(*picture);
        let mesh = mesh.for_output(f64::from(width.max(1)) / f64::from(height.max(1)));
        let mask = mask_texture(gpu, correction.mask(*picture).map(|mask| &**mask));
        let indices: Vec<[u32; 3]> = mesh.triangles().collect();
        let device = &gpu.device;
        let layout = self.pipeline.get_bind_group_layout(0);
        let scene = |(eye, picture, view)| {
            let uniform = uniform_buffer::<WarpUniform>(device, "warp");
            let resources = [
                uniform.as_entire_binding(),
                wgpu::BindingResource::TextureView(&view),
                wgpu::BindingResource::Sampler(&self.sampler),
                wgpu::BindingResource::TextureView(&mask),
            ];
            let group = bind(device, "warp", &layout, &resources);
            SceneTexture {
                picture,
                view,
                eye,
                uniform,
                group,
            }
        };
        WarpTarget {
            scenes: scenes.into_iter().map(scene).collect(),
            target: mesh.target,
            hull: Hull::of(&mesh),
            vertices: filled(device, "warp", &mesh.nodes, wgpu::BufferUsages::VERTEX),
            count: 3 * indices.len() as u32,
            indices: filled(device, "warp", &indices, wgpu::BufferUsages::INDEX),
            uniform: uniform(correction, chart.is_some()),
        }
    }
}

impl WarpTarget {
    /// What is warped, one for each view of the picture.
    pub(crate) fn scenes(&self) -> &[SceneTexture] {
        &self.scenes
    }

    /// The flat screen that the scenes are drawn on.
    pub(crate) fn screen(&self, screen: &Screen, eyes: &Eyes) -> Screen {
        let all = [eyes.left, eyes.right, eyes.position(Eye::Middle)];
        let fitted = self.hull.as_ref().map(|hull| hull.screen(screen, &all));
        fitted.unwrap_or(*screen)
    }

    /// Sets the projection for the next submission; `screen` is that of [`Self::screen`].
    pub(crate) fn aim(
        &self,
        queue: &wgpu::Queue,
        screen: &Screen,
        eyes: &Eyes,
        planes: &ClipPlanes,
    ) {
        for scene in &self.scenes {
            let eye: Point3<f64> = eyes.position(scene.eye);
            let seen = clip_from_target(self.target, screen, &eye, planes);
            // Nothing is in front of an eye that sees nothing.
            let map = seen.unwrap_or_else(Matrix4::zeros);
            let uniform = WarpUniform {
                scene_from_target: map.cast::<f32>().into(),
                ..self.uniform
            };
            queue.write_buffer(&scene.uniform, 0, bytemuck::bytes_of(&uniform));
        }
    }
}

/// The uniform without its projection.
fn uniform(correction: &Correction, tints: bool) -> WarpUniform {
    let mix = correction.colour.cast::<f32>();
    let row = |i: usize| [mix[(i, 0)], mix[(i, 1)], mix[(i, 2)], 0.0];
    let gamma = correction.gamma.cast::<f32>();
    WarpUniform {
        scene_from_target: [[0.0; 4]; 4],
        red: row(0),
        green: row(1),
        blue: row(2),
        gamma: [gamma.x, gamma.y, gamma.z, f32::from(u8::from(tints))],
    }
}

/// The mask as a texture; one pixel that keeps all where there is none.
fn mask_texture(gpu: &Gpu, mask: Option<&Mask>) -> wgpu::TextureView {
    let (size, shares) = match mask {
        Some(mask) => ((mask.width, mask.height), mask.shares.as_slice()),
        None => ((1, 1), &[1.0_f32][..]),
    };
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("mask"),
            size: wgpu::Extent3d {
                width: size.0,
                height: size.1,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(shares),
    );
    texture.create_view(&Default::default())
}
