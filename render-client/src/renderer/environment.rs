//! The light around the scene on the graphics card.

use wgpu::util::{DeviceExt, TextureDataOrder};

use super::gpu::Gpu;
use super::resources::blending_sampler;
use crate::environment::{Environment, FACE, LEVELS};

/// The cube map of mirrored light and its sampler, and the nine coefficients of the matt light.
#[derive(Debug)]
pub(crate) struct EnvironmentMap {
    pub(crate) view: wgpu::TextureView,
    pub(crate) sampler: wgpu::Sampler,
    pub(crate) irradiance: [[f32; 4]; 9],
}

impl EnvironmentMap {
    pub(crate) fn new(gpu: &Gpu, environment: &Environment) -> Self {
        let texels: Vec<u32> = environment.levels.concat();
        let texture = gpu.device.create_texture_with_data(
            &gpu.queue,
            &wgpu::TextureDescriptor {
                label: Some("environment"),
                size: wgpu::Extent3d {
                    width: FACE,
                    height: FACE,
                    depth_or_array_layers: 6,
                },
                mip_level_count: LEVELS,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgb9e5Ufloat,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
            TextureDataOrder::MipMajor,
            bytemuck::cast_slice(&texels),
        );
        Self {
            view: texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::Cube),
                ..Default::default()
            }),
            sampler: blending_sampler(&gpu.device, "environment"),
            irradiance: environment.irradiance,
        }
    }
}
