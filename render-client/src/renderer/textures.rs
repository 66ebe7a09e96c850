//! Textures on the graphics card: each once, with all its sizes.

use std::sync::Arc;

use taut_proto::Wrap;
use wgpu::util::{DeviceExt, TextureDataOrder};

use super::gpu::Gpu;
use super::resources::bind;
use crate::textures::{MeshTextures, SizedTexture};

/// How much farther apart than across the samples of a slanted picture may lie: 8 is where floors and walls are sharp. An adapter without takes 1.
const ANISOTROPY: u16 = 8;

/// What a pipeline of textured bodies is bound to, and the textures so far.
#[derive(Debug)]
pub(crate) struct TextureStore {
    pub(crate) layout: wgpu::BindGroupLayout,
    views: Vec<(Arc<SizedTexture>, wgpu::TextureView)>,
    white: wgpu::BindGroup,
}

impl TextureStore {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let picture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let filtering = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("texture"),
            entries: &[entry(0, picture), entry(1, filtering)],
        });
        let texel = upload(gpu, (1, 1), 1, &[u8::MAX; 4]);
        let white = group(device, &layout, &texel, [Wrap::Clamp; 2]);
        Self {
            layout,
            views: Vec::new(),
            white,
        }
    }

    /// Bindings of the textures of a mesh; the last is of its triangles without.
    pub(crate) fn groups(&mut self, gpu: &Gpu, textures: &MeshTextures) -> Vec<wgpu::BindGroup> {
        let of = |(texture, wrap): &(Arc<SizedTexture>, [Wrap; 2])| {
            let known = self
                .views
                .iter()
                .position(|(known, _)| Arc::ptr_eq(known, texture));
            let place = known.unwrap_or_else(|| {
                self.views.push((texture.clone(), uploaded(gpu, texture)));
                self.views.len() - 1
            });
            group(&gpu.device, &self.layout, &self.views[place].1, *wrap)
        };
        let mut groups: Vec<_> = textures.list.iter().map(of).collect();
        groups.push(self.white.clone());
        groups
    }
}

fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    view: &wgpu::TextureView,
    wrap: [Wrap; 2],
) -> wgpu::BindGroup {
    let [address_mode_u, address_mode_v] = wrap.map(|wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
    });
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("texture"),
        address_mode_u,
        address_mode_v,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        anisotropy_clamp: ANISOTROPY,
        ..Default::default()
    });
    let resources = [
        wgpu::BindingResource::TextureView(view),
        wgpu::BindingResource::Sampler(&sampler),
    ];
    bind(device, "texture", layout, &resources)
}

/// The sizes of a texture that the adapter holds.
fn uploaded(gpu: &Gpu, texture: &SizedTexture) -> wgpu::TextureView {
    let most = gpu.longest_side();
    let held = |size: (u32, u32)| size.0.max(size.1) <= most;
    let levels = texture.levels.iter().filter(|level| held(level.size()));
    let levels: Vec<_> = levels.collect();
    let size = levels.first().map_or((1, 1), |level| level.size());
    let texels: Vec<&[u8]> = levels
        .iter()
        .map(|level| level.texels().as_flattened())
        .collect();
    upload(gpu, size, levels.len() as u32, &texels.concat())
}

fn upload(gpu: &Gpu, (width, height): (u32, u32), levels: u32, texels: &[u8]) -> wgpu::TextureView {
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("texture"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: levels,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8UnormSrgb,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        TextureDataOrder::MipMajor,
        texels,
    );
    texture.create_view(&Default::default())
}
