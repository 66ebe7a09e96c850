//! The adapter and device that a node draws with.

use super::pass_times::PassTimes;
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
    /// Why this adapter.
    reason: String,
    others: Vec<AdapterSummary>,
    most_samples: u32,
    pass_times: Option<PassTimes>,
}

/// Samples per pixel where they smooth edges.
pub(crate) const SMOOTH: u32 = 4;

/// Which adapter to draw with: by number (in the order of the list that errors and `taut doctor` print) or by a part of
/// its name; the best one where nothing is said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GpuChoice(Option<String>);

impl Default for GpuChoice {
    /// What the variable WGPU_ADAPTER_NAME says, as in other programs of wgpu; else the best.
    fn default() -> Self {
        Self(std::env::var("WGPU_ADAPTER_NAME").ok())
    }
}

impl GpuChoice {
    /// The adapter of this number or name, the default without one.
    pub fn of(wanted: Option<&str>) -> Self {
        wanted.map_or_else(Self::default, |wanted| Self(Some(wanted.to_owned())))
    }
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
        Self::open_with(&GpuChoice::default())
    }

    /// Opens the adapter chosen for drawing off-screen.
    pub fn open_with(choice: &GpuChoice) -> Result<Self, RenderError> {
        Self::open_for(new_instance(None), None, choice)
    }

    /// Opens the adapter chosen; it must be able to show pictures on `surface`, where one is given.
    pub(crate) fn open_for(
        instance: wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
        choice: &GpuChoice,
    ) -> Result<Self, RenderError> {
        let mut adapters = adapters(&instance);
        let offers: Vec<Offer> = adapters
            .iter()
            .map(|adapter| Offer {
                summary: summary(&adapter.get_info()),
                rank: rank(&adapter.get_info()),
                shows: surface.is_none_or(|s| adapter.is_surface_supported(s)),
            })
            .collect();
        let (place, reason) = choose(choice, &offers)?;
        let others = offers
            .into_iter()
            .map(|offer| offer.summary)
            .enumerate()
            .filter(|(other, _)| *other != place);
        let others: Vec<AdapterSummary> = others.map(|(_, summary)| summary).collect();
        let adapter = adapters.swap_remove(place);

        let most = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("taut-render"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: wgpu::Limits {
                // Large pictures that are read back and large meshes take more than the 256 MiB that all adapters have.
                max_buffer_size: most.max_buffer_size,
                ..wgpu::Limits::downlevel_defaults().using_resolution(most)
            },
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
            reason,
            others,
            most_samples: SMOOTH,
            pass_times: None,
        };
        tracing::info!("drawing with {}", gpu.chosen());
        Ok(gpu)
    }

    /// The same, drawing with so many samples per pixel at most: below 4 it is one, edges of bodies are not smoothed, and those of shadows less.
    pub fn with_samples(self, most: u32) -> Self {
        Self {
            most_samples: most,
            ..self
        }
    }

    /// The same with the samples that are asked for; else with four, but one where the processor draws and the pictures are not `kept`.
    pub(crate) fn smoothed(self, asked: Option<u32>, kept: bool) -> Self {
        let most = match (self.is_software(), kept) {
            (true, false) => 1,
            _ => SMOOTH,
        };
        self.with_samples(asked.unwrap_or(most))
    }

    /// The same, timing each pass, where the adapter can.
    pub fn with_pass_times(self) -> Self {
        Self {
            pass_times: PassTimes::new(&self.device),
            ..self
        }
    }

    /// Whether passes are timed.
    pub fn times_passes(&self) -> bool {
        self.pass_times.is_some()
    }

    /// Waits for what is being drawn. Names of the passes since the last call, in their order, and how long the card took for each, ms; nothing
    /// where passes are not timed.
    pub fn pass_times(&self) -> Result<Vec<(&'static str, f64)>, RenderError> {
        self.pass_times
            .as_ref()
            .map_or_else(|| Ok(Vec::new()), |times| times.take(self))
    }

    /// For the descriptor of a pass of this name.
    pub(crate) fn timed(&self, name: &'static str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.pass_times.as_ref().and_then(|times| times.of(name))
    }

    /// What a buffer holds once everything submitted so far is done; to be unmapped by the caller.
    pub(crate) fn read(&self, buffer: &wgpu::Buffer) -> Result<wgpu::BufferView, RenderError> {
        let (done, mapped) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            let _ = done.send(result); // nobody listens only if the wait below failed
        });
        self.finish()?;
        match mapped.try_recv() {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(self.broken(&error)),
            Err(error) => return Err(self.broken(&error)),
        }
        buffer
            .get_mapped_range(..)
            .map_err(|error| self.broken(&error))
    }

    /// What to tell people of the adapter.
    pub fn summary(&self) -> AdapterSummary {
        summary(&self.adapter.get_info())
    }

    /// Which adapter was taken, why, and which others there are, as a sentence's end.
    pub fn chosen(&self) -> String {
        let others: Vec<String> = self.others.iter().map(AdapterSummary::to_string).collect();
        let also = match others.as_slice() {
            [] => "there is no other".to_owned(),
            others => format!("also there: {}", others.join(", ")),
        };
        format!("{}: {}; {also}", self.summary(), self.reason)
    }

    /// What the driver offers to tell of the time at which a picture is on the screen, for people. None of it is read.
    ///
    /// wgpu hands the times of VK_GOOGLE_display_timing to unsafe code only, and names VK_EXT_present_timing nowhere.
    pub fn present_timing(&self) -> &'static str {
        let offered = wgpu::Features::VULKAN_GOOGLE_DISPLAY_TIMING;
        if self.adapter.features().contains(offered) {
            "the driver's VK_GOOGLE_display_timing and VK_EXT_present_timing are not used: wgpu has no safe access to the one and none to the other"
        } else {
            "the driver has no VK_GOOGLE_display_timing, and VK_EXT_present_timing is not used: wgpu has no access to it"
        }
    }

    /// Longest side of a picture that the adapter holds, pixels.
    pub(crate) fn longest_side(&self) -> u32 {
        self.device.limits().max_texture_dimension_2d
    }

    /// Whether the processor draws, for want of a graphics card.
    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Samples per pixel: 4 where that is wanted and the adapter can for this format, else 1.
    pub(crate) fn samples(&self, format: wgpu::TextureFormat) -> u32 {
        let can = |format| {
            self.adapter
                .get_texture_format_features(format)
                .flags
                .sample_count_supported(SMOOTH)
        };
        if self.most_samples >= SMOOTH && can(format) && can(super::pipeline::DEPTH) {
            SMOOTH
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

/// An adapter that could be taken.
#[derive(Clone, Debug)]
struct Offer {
    summary: AdapterSummary,
    rank: Rank,
    /// It can show pictures where they are wanted.
    shows: bool,
}

/// The place of the adapter to take, and why it.
fn choose(choice: &GpuChoice, offers: &[Offer]) -> Result<(usize, String), RenderError> {
    let best = |fits: &dyn Fn(usize, &Offer) -> bool| {
        let fitting = offers
            .iter()
            .enumerate()
            .filter(|(i, offer)| fits(*i, offer));
        fitting.min_by_key(|(_, offer)| offer.rank).map(|(i, _)| i)
    };
    let Some(wanted) = &choice.0 else {
        let place = best(&|_, offer| offer.shows).ok_or(RenderError::NoGpu)?;
        let offer = &offers[place];
        let alone = offers.iter().filter(|offer| offer.shows).count() == 1;
        let reason = match (alone, offer.rank.0) {
            (true, _) => "the only one that can draw here".to_owned(),
            (_, KindRank::Discrete) => "a card of its own comes first".to_owned(),
            (_, KindRank::Software) => "there is no better".to_owned(),
            _ => "there is no card of its own".to_owned(),
        };
        return Ok((place, reason));
    };
    if offers.is_empty() {
        return Err(RenderError::NoGpu);
    }
    let lower = wanted.to_lowercase();
    let number: Option<usize> = wanted.parse().ok();
    let named = |i: usize, offer: &Offer| match number {
        Some(number) => number == i,
        None => offer.summary.name.to_lowercase().contains(&lower),
    };
    if let Some(place) = best(&|i, offer| named(i, offer) && offer.shows) {
        return Ok((place, "asked for".to_owned()));
    }
    if let Some(place) = best(&named) {
        return Err(RenderError::Gpu {
            adapter: offers[place].summary.name.clone(),
            reason: "it cannot show pictures in this window".to_owned(),
        });
    }
    let list = offers.iter().enumerate();
    let list: Vec<String> = list
        .map(|(i, offer)| format!("{i} {}", offer.summary))
        .collect();
    Err(RenderError::UnknownGpu {
        wanted: wanted.clone(),
        known: list.join(", "),
    })
}

fn summary(info: &wgpu::AdapterInfo) -> AdapterSummary {
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
        name: info.name.clone(),
    }
}

/// Kinds of adapters, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum KindRank {
    Discrete,
    Integrated,
    Virtual,
    Unknown,
    Software,
}

/// Order of preference: hardware before software, then Vulkan before GL.
type Rank = (KindRank, u8);

fn rank(info: &wgpu::AdapterInfo) -> Rank {
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => KindRank::Discrete,
        wgpu::DeviceType::IntegratedGpu => KindRank::Integrated,
        wgpu::DeviceType::VirtualGpu => KindRank::Virtual,
        wgpu::DeviceType::Other => KindRank::Unknown,
        wgpu::DeviceType::Cpu => KindRank::Software,
    };
    let backend = match info.backend {
        wgpu::Backend::Gl => 1,
        _ => 0,
    };
    (kind, backend)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offer(name: &str, kind: KindRank, shows: bool) -> Offer {
        Offer {
            summary: AdapterSummary {
                name: name.to_owned(),
                backend: "Vulkan".to_owned(),
                kind: format!("{kind:?}").to_lowercase(),
            },
            rank: (kind, 0),
            shows,
        }
    }

    fn laptop() -> Vec<Offer> {
        vec![
            offer("llvmpipe (LLVM 15)", KindRank::Software, true),
            offer("Intel(R) Arc", KindRank::Integrated, true),
            offer("NVIDIA RTX A2000", KindRank::Discrete, true),
        ]
    }

    fn asked(wanted: &str) -> GpuChoice {
        GpuChoice::of(Some(wanted))
    }

    #[test]
    fn a_card_of_its_own_is_taken_before_all_others() {
        let (place, reason) = choose(&GpuChoice(None), &laptop()).expect("one");
        assert_eq!(
            (place, reason.as_str()),
            (2, "a card of its own comes first")
        );
        let mut closed = laptop();
        closed[2].shows = false;
        let (place, reason) = choose(&GpuChoice(None), &closed).expect("one");
        assert_eq!((place, reason.as_str()), (1, "there is no card of its own"));
    }

    #[test]
    fn an_adapter_is_asked_for_by_number_or_by_part_of_its_name() {
        for (wanted, place) in [("0", 0), ("intel", 1), ("A2000", 2), ("LLVM", 0)] {
            assert_eq!(choose(&asked(wanted), &laptop()).expect("there").0, place);
        }
    }

    #[test]
    fn what_is_not_there_is_refused_with_what_is() {
        for wanted in ["3", "radeon"] {
            let error = choose(&asked(wanted), &laptop())
                .expect_err("unknown")
                .to_string();
            for part in [
                wanted,
                "0 llvmpipe",
                "1 Intel(R) Arc (integrated",
                "2 NVIDIA",
            ] {
                assert!(error.contains(part), "{part} in {error}");
            }
        }
        assert!(matches!(choose(&asked("0"), &[]), Err(RenderError::NoGpu)));
        assert!(matches!(
            choose(&GpuChoice(None), &[]),
            Err(RenderError::NoGpu)
        ));
        let mut closed = laptop();
        closed[2].shows = false;
        let error = choose(&asked("nvidia"), &closed)
            .expect_err("cannot show")
            .to_string();
        assert!(error.contains("cannot show pictures"), "{error}");
    }
}
