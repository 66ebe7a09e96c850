//! Windows whose pictures stay: calibration. Esc ends, F covers the monitor.

use std::time::Duration;

use taut_proto::scene::Show;
use winit::application::ApplicationHandler;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::WindowId;

use super::display::{Display, Next};
use super::opened;
use super::{Plan, toggle_fullscreen};
use crate::calibrate::CalibrationWindows;
use crate::canvas::eyes_of;
use crate::error::RenderError;
use crate::monitor::Places;
use crate::preview::at_start;
use crate::renderer::SMOOTH;
use crate::stage::Stage;

/// Shows the stage at its start until the user or a signal ends it.
pub(crate) fn show(
    stage: &Stage,
    node: &str,
    windows: &CalibrationWindows,
) -> Result<(), RenderError> {
    let no_display = |error: winit::error::EventLoopError| opened::missing(&error);
    let events = EventLoop::new().map_err(no_display)?;
    let mut app = Still {
        stage: stage.clone(),
        plan: Plan {
            frames: None,
            duration: None,
            frame_time: Duration::ZERO,
            software_frame_time: Duration::ZERO,
            asked: Places {
                fullscreen: windows.fullscreen,
                monitors: windows.monitors.clone(),
            },
            gpu: windows.gpu.clone(),
            samples: Some(SMOOTH), // it stands still
            display_ns: 0,
            show: Show::default(),
            node: node.to_owned(),
        },
        display: None,
        result: Ok(()),
    };
    events.run_app(&mut app).map_err(no_display)?;
    app.result
}

struct Still {
    stage: Stage,
    plan: Plan,
    display: Option<Display>,
    result: Result<(), RenderError>,
}

impl ApplicationHandler for Still {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.display.is_some() {
            return;
        }
        events.set_control_flow(ControlFlow::Wait);
        let places = &self.plan.asked;
        let opened = Display::open(events, &self.stage, &self.plan, places, false);
        let opened = opened.map(|mut display| {
            let at_start = at_start(&self.stage);
            let show = self.plan.show;
            display
                .renderer
                .set_state(&display.gpu, &self.stage, &at_start, show);
            display
        });
        match opened {
            Ok(display) => {
                for pane in &display.panes {
                    pane.window.request_redraw();
                }
                self.display = Some(display);
            }
            Err(error) => self.end(events, Err(error)),
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => self.end(events, Ok(())),
            WindowEvent::KeyboardInput { event, .. }
                if event.state == ElementState::Pressed && !event.repeat =>
            {
                match event.physical_key {
                    PhysicalKey::Code(KeyCode::Escape) => self.end(events, Ok(())),
                    PhysicalKey::Code(KeyCode::KeyF) => {
                        let panes = self.display.iter().flat_map(|display| &display.panes);
                        panes.for_each(|pane| toggle_fullscreen(&pane.window));
                    }
                    _ => {}
                }
            }
            WindowEvent::Resized(size) => {
                if let Some(display) = &mut self.display {
                    display.resize(&self.stage, id, size);
                }
                self.ask(id);
            }
            WindowEvent::Occluded(false) => self.ask(id),
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.draw(id) {
                    self.end(events, Err(error));
                }
            }
            _ => {}
        }
    }
}

impl Still {
    fn end(&mut self, events: &ActiveEventLoop, result: Result<(), RenderError>) {
        if self.result.is_ok() {
            self.result = result;
        }
        events.exit();
    }

    /// Has a window drawn again.
    fn ask(&self, id: WindowId) {
        let mut panes = self.display.iter().flat_map(|display| &display.panes);
        if let Some(pane) = panes.find(|pane| pane.window.id() == id) {
            pane.window.request_redraw();
        }
    }

    fn draw(&mut self, id: WindowId) -> Result<(), RenderError> {
        let Some(Display {
            gpu,
            renderer,
            panes,
            ..
        }) = &self.display
        else {
            return Ok(());
        };
        for pane in panes.iter().filter(|pane| pane.window.id() == id) {
            let texture = match pane.texture(gpu)? {
                Next::Texture(texture) => texture,
                Next::Busy => {
                    pane.window.request_redraw();
                    continue;
                }
                Next::Hidden => continue, // its window asks when it is seen again
            };
            let view = texture.texture.create_view(&wgpu::TextureViewDescriptor {
                format: Some(pane.format),
                ..Default::default()
            });
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let screen = &self.stage.screens[pane.screen].screen;
            let eyes = eyes_of(&self.stage, &at_start(&self.stage));
            renderer.draw(gpu, &mut encoder, screen, &eyes, &pane.target, &view);
            gpu.queue.submit([encoder.finish()]);
            pane.window.pre_present_notify();
            gpu.queue.present(texture);
        }
        Ok(())
    }
}
