//! The windows of a node, one for each picture of each of its screens, and what draws in them.

use std::sync::Arc;

use wgpu::CurrentSurfaceTexture;
use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::window::{Window, WindowId};

use super::Plan;
use super::light::{Light, NoFeedback};
use super::opened::open_windows;
use crate::canvas::target_of;
use crate::error::RenderError;
use crate::monitor::Places;
use crate::mouse;
use crate::renderer::{Gpu, OffScreen, PictureTarget, Renderer, new_instance};
use crate::snapshot::{Frame, Part};
use crate::stage::Stage;
use crate::stereo::Picture;
use crate::texture_limits::check_masks;
use crate::view::Eyes;

/// The windows and what draws in them.
pub(super) struct Display {
    pub(super) gpu: Gpu,
    pub(super) renderer: Renderer,
    pub(super) panes: Vec<Pane>,
    /// Where the window system tells when pictures lit up; else why not.
    pub(super) light: Result<Light, NoFeedback>,
}

/// One window.
pub(super) struct Pane {
    pub(super) window: Arc<Window>,
    pub(super) surface: wgpu::Surface<'static>,
    pub(super) config: wgpu::SurfaceConfiguration,
    /// The format that is drawn: that of the surface, with sRGB encoding.
    pub(super) format: wgpu::TextureFormat,
    pub(super) picture: Picture,
    /// Place of the picture among those of the screen.
    pub(super) place: usize,
    pub(super) target: PictureTarget,
    /// Place of the screen in the stage.
    pub(super) screen: usize,
}

/// What a window has to draw to.
pub(super) enum Next {
    Texture(wgpu::SurfaceTexture),
    /// Nothing became free within a second, for which this was waited.
    Busy,
    /// The window is hidden or changes: the window system tells when it is to be drawn again.
    Hidden,
}

impl Display {
    /// Opens the windows of the stage at their places.
    pub(super) fn open(
        events: &ActiveEventLoop,
        stage: &Stage,
        plan: &Plan,
        places: &Places,
        holds: bool,
    ) -> Result<Self, RenderError> {
        let help = if holds {
            format!(" ({})", mouse::HELP)
        } else {
            String::new()
        };
        let instance = new_instance(Some(events.owned_display_handle()));
        let opened = open_windows(events, &instance, stage, places, &help)?;
        let gpu = Gpu::open_for(
            instance,
            opened.first().map(|opened| &opened.surface),
            &plan.gpu,
        )?
        .smoothed(plan.samples, false);
        check_masks(stage, gpu.longest_side())?;
        let mut renderer: Option<Renderer> = None;
        let mut panes = Vec::new();
        for opened in opened {
            let size = opened.window.inner_size();
            let (config, format) = configuration(&gpu, &opened.surface, size, panes.len())?;
            opened.surface.configure(&gpu.device, &config);
            let renderer = renderer.get_or_insert_with(|| Renderer::new(&gpu, stage, format));
            let size = (config.width, config.height);
            let drawn = &stage.screens[opened.screen];
            let picture = (opened.place, &opened.picture);
            let target = target_of(&gpu, renderer, drawn, picture, size);
            panes.push(Pane {
                window: opened.window,
                surface: opened.surface,
                config,
                format,
                picture: opened.picture,
                place: opened.place,
                target,
                screen: opened.screen,
            });
        }
        let renderer = renderer.ok_or_else(|| RenderError::BadScene {
            what: "this node draws no screen".to_owned(),
        })?;
        let windows = panes.iter().map(|pane| Arc::clone(&pane.window)).collect();
        Ok(Self {
            gpu,
            renderer,
            panes,
            light: Light::of(events.owned_display_handle(), windows),
        })
    }

    /// What can be known of the time at which pictures light up.
    pub(super) fn present_timing(&self) -> String {
        match &self.light {
            Ok(light) => light.described(),
            Err(why) => format!(
                "not known, the times told are those of calls alone: {why}; {}",
                self.gpu.present_timing()
            ),
        }
    }

    /// The frame that was drawn last, for these eyes, and shown at `shown_ns`, to be drawn again.
    pub(super) fn frame<'d>(
        &'d self,
        stage: &'d Stage,
        eyes: &'d Eyes,
        shown_ns: u64,
    ) -> Frame<'d> {
        let first = self.panes.first();
        Frame {
            gpu: &self.gpu,
            renderer: &self.renderer,
            stage,
            eyes,
            format: first.map_or(OffScreen::FORMAT, |pane| pane.format),
            shown_ns,
        }
    }

    /// Draws another stage in the same windows.
    pub(super) fn restage(&mut self, stage: &Stage) -> Result<(), RenderError> {
        let Some(format) = self.panes.first().map(|pane| pane.format) else {
            return Ok(());
        };
        check_masks(stage, self.gpu.longest_side())?;
        self.renderer = Renderer::new(&self.gpu, stage, format);
        for pane in &mut self.panes {
            let size = (pane.config.width, pane.config.height);
            pane.target = pane.target_for(&self.gpu, &self.renderer, stage, size);
        }
        Ok(())
    }

    pub(super) fn resize(&mut self, stage: &Stage, id: WindowId, size: PhysicalSize<u32>) {
        let hidden = size.width == 0 || size.height == 0;
        let pane = self
            .panes
            .iter_mut()
            .find(|pane| pane.window.id() == id && !hidden);
        if let Some(pane) = pane {
            (pane.config.width, pane.config.height) = (size.width, size.height);
            pane.surface.configure(&self.gpu.device, &pane.config);
            pane.target = pane.target_for(&self.gpu, &self.renderer, stage, size.into());
        }
    }
}

impl Pane {
    /// Its picture, as it is shown.
    pub(super) fn part(&self) -> Part<'_> {
        Part {
            screen: self.screen,
            place: self.place,
            picture: &self.picture,
            size: (self.config.width, self.config.height),
        }
    }

    fn target_for(
        &self,
        gpu: &Gpu,
        renderer: &Renderer,
        stage: &Stage,
        size: (u32, u32),
    ) -> PictureTarget {
        let screen = &stage.screens[self.screen];
        target_of(gpu, renderer, screen, (self.place, &self.picture), size)
    }

    /// The window's next texture as it is drawn to.
    pub(super) fn view(&self, texture: &wgpu::SurfaceTexture) -> wgpu::TextureView {
        texture.texture.create_view(&wgpu::TextureViewDescriptor {
            format: Some(self.format),
            ..Default::default()
        })
    }

    /// What to draw to next.
    pub(super) fn texture(&self, gpu: &Gpu) -> Result<Next, RenderError> {
        let acquired = acquire(
            || self.surface.get_current_texture(),
            || self.surface.configure(&gpu.device, &self.config),
        );
        Next::of(acquired).ok_or_else(|| gpu.broken(&"the window's surface is invalid"))
    }
}

impl Next {
    /// `None` where the surface is invalid.
    fn of(acquired: CurrentSurfaceTexture) -> Option<Self> {
        match acquired {
            CurrentSurfaceTexture::Success(texture)
            | CurrentSurfaceTexture::Suboptimal(texture) => Some(Self::Texture(texture)),
            CurrentSurfaceTexture::Timeout => Some(Self::Busy),
            CurrentSurfaceTexture::Occluded
            | CurrentSurfaceTexture::Outdated
            | CurrentSurfaceTexture::Lost => Some(Self::Hidden),
            CurrentSurfaceTexture::Validation => None,
        }
    }
}

/// The next texture of a surface, which is configured anew if it does not fit its window any more. Once: that of a hidden window may never fit.
fn acquire(
    mut next: impl FnMut() -> CurrentSurfaceTexture,
    configure: impl FnOnce(),
) -> CurrentSurfaceTexture {
    match next() {
        CurrentSurfaceTexture::Outdated | CurrentSurfaceTexture::Lost => {
            configure();
            next()
        }
        acquired => acquired,
    }
}

/// How the window at a place among those of the node shows its pictures, of the ways that its surface offers: never torn.
///
/// The first window waits for its monitor. On monitors that are out of step the others would wait again: they show the newest picture at their
/// own next refresh. Where that is not offered they wait, too: at worst the node then draws at half the refresh, the lesser evil beside
/// a tear in every picture.
fn present_mode(place: usize, offered: &[wgpu::PresentMode]) -> wgpu::PresentMode {
    if place > 0 && offered.contains(&wgpu::PresentMode::Mailbox) {
        wgpu::PresentMode::Mailbox
    } else {
        wgpu::PresentMode::Fifo // offered everywhere
    }
}

/// How to show pictures on the surface of the window at a place, and the sRGB format to draw them in.
fn configuration(
    gpu: &Gpu,
    surface: &wgpu::Surface<'_>,
    size: PhysicalSize<u32>,
    place: usize,
) -> Result<(wgpu::SurfaceConfiguration, wgpu::TextureFormat), RenderError> {
    let (width, height) = (size.width.max(1), size.height.max(1));
    let mut config = surface
        .get_default_config(&gpu.adapter, width, height)
        .ok_or_else(|| gpu.broken(&"it cannot show pictures in this window"))?;
    let offered = surface.get_capabilities(&gpu.adapter);
    config.format = offered
        .formats
        .into_iter()
        .find(wgpu::TextureFormat::is_srgb)
        .unwrap_or(config.format);
    let drawn = config.format.add_srgb_suffix();
    if drawn != config.format {
        config.view_formats.push(drawn);
    }
    config.present_mode = present_mode(place, &offered.present_modes);
    config.desired_maximum_frame_latency = 1; // the least age that double buffering allows
    Ok((config, drawn))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_window_is_shown_in_a_way_that_tears() {
        use wgpu::PresentMode::{Fifo, FifoRelaxed, Immediate, Mailbox};
        let all = [Immediate, Mailbox, FifoRelaxed, Fifo];
        assert_eq!(
            [0, 1, 2].map(|place| present_mode(place, &all)),
            [Fifo, Mailbox, Mailbox]
        );
        let few = [Immediate, FifoRelaxed, Fifo];
        assert_eq!([0, 1].map(|place| present_mode(place, &few)), [Fifo, Fifo]);
    }

    /// How often a surface that always answers so is asked and configured.
    fn tries(answer: fn() -> CurrentSurfaceTexture) -> (u32, u32) {
        let (mut asked, mut configured) = (0, 0);
        let next = || {
            asked += 1;
            answer()
        };
        let _ = acquire(next, || configured += 1);
        (asked, configured)
    }

    #[test]
    fn a_hidden_window_is_not_asked_again_and_again() {
        let unfit: [fn() -> CurrentSurfaceTexture; 2] = [
            || CurrentSurfaceTexture::Outdated,
            || CurrentSurfaceTexture::Lost,
        ];
        for unfit in unfit {
            assert_eq!(tries(unfit), (2, 1));
            assert!(matches!(Next::of(unfit()), Some(Next::Hidden)));
        }
        assert_eq!(tries(|| CurrentSurfaceTexture::Occluded), (1, 0));
        let occluded = Next::of(CurrentSurfaceTexture::Occluded);
        assert!(matches!(occluded, Some(Next::Hidden)));
        assert_eq!(tries(|| CurrentSurfaceTexture::Timeout), (1, 0));
        let late = Next::of(CurrentSurfaceTexture::Timeout);
        assert!(matches!(late, Some(Next::Busy)));
        assert!(Next::of(CurrentSurfaceTexture::Validation).is_none());
    }
}
