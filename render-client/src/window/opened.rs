//! Windows at their places, before anything draws in them.

use std::sync::Arc;

use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event_loop::ActiveEventLoop;
use winit::monitor::MonitorHandle;
use winit::window::{Fullscreen, Window};

use crate::error::RenderError;
use crate::monitor::{self, Places};
use crate::stage::Stage;
use crate::stereo::Picture;

/// A window that nothing draws in yet.
pub(super) struct Opened {
    /// Place of the screen in the stage.
    pub(super) screen: usize,
    /// Place of the picture among those of the screen.
    pub(super) place: usize,
    pub(super) picture: Picture,
    pub(super) window: Arc<Window>,
    pub(super) surface: wgpu::Surface<'static>,
}

/// One for each picture of each screen; `help` follows their titles.
pub(super) fn open_windows(
    events: &ActiveEventLoop,
    instance: &wgpu::Instance,
    stage: &Stage,
    places: &Places,
    help: &str,
) -> Result<Vec<Opened>, RenderError> {
    let monitors: Vec<MonitorHandle> = events.available_monitors().collect();
    let names: Vec<Option<String>> = monitors.iter().map(MonitorHandle::name).collect();
    let mut opened = Vec::new();
    let mut columns = monitor::Columns::default();
    for (index, screen) in stage.screens.iter().enumerate() {
        for (eye, picture) in Picture::of(screen.stereo).into_iter().enumerate() {
            let (width, height) = screen.pixels;
            let place = monitor::of_window(opened.len(), &places.monitors, &names)?;
            let monitor = place.and_then(|place| monitors.get(place).cloned());
            // A monitor that was asked for is where the window opens, even if it does not cover it.
            let named = place.filter(|_| !places.monitors.is_empty());
            let corner = named
                .and_then(|place| monitors.get(place))
                .map_or(PhysicalPosition::new(0, 0), MonitorHandle::position);
            let below = columns.next(named, height);
            let cover = || Fullscreen::Borderless(monitor.clone());
            let attributes = Window::default_attributes()
                .with_title(format!("taut: {}{}{help}", screen.name, picture.suffix))
                .with_inner_size(PhysicalSize::new(width, height))
                .with_position(PhysicalPosition::new(corner.x, corner.y + below as i32))
                .with_fullscreen(places.fullscreen.then(cover));
            let window = events
                .create_window(attributes)
                .map_err(|error| missing(&error))?;
            let window = Arc::new(window);
            let surface = instance
                .create_surface(Arc::clone(&window))
                .map_err(|error| missing(&error))?;
            opened.push(Opened {
                screen: index,
                place: eye,
                picture,
                window,
                surface,
            });
        }
    }
    Ok(opened)
}

/// No window, by what the window system said.
pub(super) fn missing(error: &dyn std::fmt::Display) -> RenderError {
    RenderError::NoDisplay {
        reason: without_place(&error.to_string()).to_owned(),
    }
}

/// An error's text without the place in winit's source that it may begin with, `os error at FILE.rs:LINE: `, and without its full stop.
fn without_place(text: &str) -> &str {
    let after =
        |(_, rest): (&str, &str)| rest.find(": ").map(|at| at + 2 + text.len() - rest.len());
    let begins = text
        .strip_prefix("os error at ")
        .and_then(|place| place.split_once(".rs:"))
        .and_then(after);
    text[begins.unwrap_or(0)..].trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_window_system_says_is_told_without_a_place_in_its_source() {
        let told = "os error at /home/a/winit-0.30.13/src/mod.rs:765: neither DISPLAY nor another: is set.";
        assert_eq!(without_place(told), "neither DISPLAY nor another: is set");
        assert_eq!(without_place("it is gone"), "it is gone");
    }
}
