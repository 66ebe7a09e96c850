//! The adapter and device that a node draws with.

use crate::error::RenderError;

/// An open graphics device.
#[derive(Debug)]
pub struct Gpu {
    /// The instance, which makes surfaces for windows.
    pub instance: wgpu::Instance,
    /// The adapter chosen.
    pub adapter: wgpu::Adapter,
    /// Its device.
    pub device: wgpu::Device,
    /// The device's queue.
    pub queue: wgpu::Queue,
}

/// What to tell people of the adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// As the driver names it.
    pub name: String,
    /// Vulkan, GL ...
    pub backend: String,
    /// Discrete, integrated, software ...
    pub kind: String,
}

impl std::fmt::Display for AdapterSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({}, {})", self.name, self.kind, self.backend)
    }
}

/// An instance that can make surfaces for windows of `display`, where one is given.
///
/// GL is asked only if Vulkan has no adapter: two drivers for one card would only be in each other's way.
pub(crate) fn new_instance(display: Option<Display>) -> wgpu::Instance {
    let mut vulkan_only = descriptor(display.clone());
    vulkan_only.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(vulkan_only);
    if adapters(&instance).is_empty() {
        return wgpu::Instance::new(descriptor(display));
    }
    instance
}

/// The connection to the window system.
pub(crate) type Display = winit::event_loop::OwnedDisplayHandle;

fn adapters(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
}

fn descriptor(display: Option<Display>) -> wgpu::InstanceDescriptor {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    // The validation layer of the driver is a tool for who writes shaders: WGPU_VALIDATION=1.
    let layers = wgpu::InstanceFlags::VALIDATION | wgpu::InstanceFlags::DEBUG;
    if std::env::var_os("WGPU_VALIDATION").is_none() {
        descriptor.flags.remove(layers);
    }
    descriptor.display = display.map(|display| Box::new(display) as Box<_>);
    descriptor
}

impl Gpu {
    /// Opens the best adapter for drawing off-screen.
    pub fn open() -> Result<Self, RenderError> {
        Self::open_for(new_instance(None), None)
    }

    /// Opens the best adapter that can show pictures on `surface`, or any where none is given.
    pub(crate) fn open_for(
        instance: wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Self, RenderError> {
        let wanted = std::env::var("WGPU_ADAPTER_NAME")
            .ok()
            .map(|name| name.to_lowercase());
        let mut adapters = adapters(&instance);
        adapters.retain(|adapter| surface.is_none_or(|s| adapter.is_surface_supported(s)));
        if let Some(wanted) = wanted {
            adapters.retain(|adapter| adapter.get_info().name.to_lowercase().contains(&wanted));
        }
        let adapter = adapters
            .into_iter()
            .min_by_key(rank)
            .ok_or(RenderError::NoGpu)?;

        let descriptor = wgpu::DeviceDescriptor {
            label: Some("taut-render"),
            required_limits: wgpu::Limits::downlevel_defaults().using_resolution(adapter.limits()),
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
                RenderError::Gpu {
                    adapter: adapter.get_info().name,
                    reason: error.to_string(),
                }
            })?;
        let gpu = Self {
            instance,
            adapter,
            device,
            queue,
        };
        tracing::info!(adapter = %gpu.summary(), "drawing");
        Ok(gpu)
    }

    /// What to tell people of the adapter.
    pub fn summary(&self) -> AdapterSummary {
        let info = self.adapter.get_info();
        AdapterSummary {
            kind: match info.device_type {
                wgpu::DeviceType::DiscreteGpu => "discrete",
                wgpu::DeviceType::IntegratedGpu => "integrated",
                wgpu::DeviceType::VirtualGpu => "virtual",
                wgpu::DeviceType::Cpu => "software",
                wgpu::DeviceType::Other => "of unknown kind",
            }
            .to_owned(),
            backend: format!("{:?}", info.backend),
            name: info.name,
        }
    }

    /// Whether the processor draws, for want of a graphics card.
    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Samples per pixel: 4 where the adapter can for this format, else 1.
    pub(crate) fn samples(&self, format: wgpu::TextureFormat) -> u32 {
        let can = |format| {
            self.adapter
                .get_texture_format_features(format)
                .flags
                .sample_count_supported(4)
        };
        if can(format) && can(super::pipeline::DEPTH) {
            4
        } else {
            1
        }
    }

    /// Waits until everything submitted so far has been drawn.
    pub fn finish(&self) -> Result<(), RenderError> {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map(|_| ())
            .map_err(|error| self.broken(&error))
    }

    /// The error that says that this adapter failed.
    pub(crate) fn broken(&self, reason: &impl std::fmt::Display) -> RenderError {
        RenderError::Gpu {
            adapter: self.adapter.get_info().name,
            reason: reason.to_string(),
        }
    }
}

/// Order of preference, the best first: hardware before software, Vulkan before GL.
fn rank(adapter: &wgpu::Adapter) -> (u8, u8) {
    let info = adapter.get_info();
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    let backend = match info.backend {
        wgpu::Backend::Gl => 1,
        _ => 0,
    };
    (kind, backend)
}
