//! Draws in windows: one for each picture of each screen of the node.
//!
//! All windows of a frame show the same state and are submitted together. Keys: Esc ends, F covers
//! the monitor, G, C, V, H and M show or hide the device ghost, the contacts, the force, the HUD and reflections. A window that
//! holds the body ([`crate::hand`]) takes the inputs of [`crate::mouse`] as well.

mod display;
mod light;
mod opened;
mod shown;
pub(crate) mod still;

use std::time::{Duration, Instant};

use nalgebra::Isometry3;
use taut_proto::scene::Show;
use winit::application::ApplicationHandler;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Fullscreen, Window, WindowId};

use crate::canvas::eyes_of;
use crate::cli::DrawnWith;
use crate::error::RenderError;
use crate::hand::Hand;
use crate::headless::{Drawn, shown};
use crate::hud::Overlay;
use crate::monitor::Places;
use crate::mouse::{Mouse, Pointed};
use crate::node_status::LinkHealth;
use crate::pacing::Pacer;
use crate::renderer::GpuChoice;
use crate::session::{Session, Turn};
use crate::stage::Stage;
use crate::statistics::{Ended, NO_WINDOW, Statistics};
use crate::timeline::{Latched, Timeline};
use crate::view::Eyes;
use display::{Display, Next, Pane};
use shown::Shown;

/// Nothing to draw yet: how soon to look again.
const MOMENT: Duration = Duration::from_millis(2);

/// When to end and how fast to draw.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) frames: Option<u64>,
    pub(crate) duration: Option<Duration>,
    pub(crate) frame_time: Duration,
    /// Least time between frames where the processor draws.
    pub(crate) software_frame_time: Duration,
    /// Where the windows are asked to be, whatever the server says.
    pub(crate) asked: Places,
    pub(crate) gpu: GpuChoice,
    /// Samples per pixel, where they are asked for.
    pub(crate) samples: Option<u32>,
    /// From handing a picture over to its light, in nanoseconds.
    pub(crate) display_ns: u64,
    pub(crate) show: Show,
    /// Name of the node.
    pub(crate) node: String,
}

/// Draws until the plan, the user, the server or a signal ends it; says what drew.
pub(crate) fn run(
    session: &mut Session,
    stage: Stage,
    timeline: &mut Timeline,
    statistics: &mut Statistics,
    plan: Plan,
    hand: Option<Hand>,
) -> Result<(Ended, DrawnWith), RenderError> {
    let no_display = |error: winit::error::EventLoopError| opened::missing(&error);
    let events = EventLoop::new().map_err(no_display)?;
    let mut app = App {
        session,
        timeline,
        statistics,
        show: Shown::new(plan.show),
        plan,
        hand,
        mouse: Mouse::default(),
        eyes: Eyes::of_head(&stage.head, stage.eye_separation),
        god_object: stage.god_object.pose,
        stage,
        screen: None,
        start: Instant::now(),
        next_frame: Instant::now(),
        pacer: None,
        last_drawn: None,
        result: None,
    };
    events.run_app(&mut app).map_err(no_display)?;
    let screen = app.screen.as_ref();
    let drawn_with = DrawnWith {
        adapter: screen.map_or_else(String::new, |screen| screen.gpu.summary().to_string()),
        present_timing: screen.map_or_else(|| NO_WINDOW.to_owned(), Display::present_timing),
    };
    match app.result {
        Some(Ok(ended)) => Ok((ended, drawn_with)),
        Some(Err(error)) => Err(error),
        None => Ok((Ended::Closed, drawn_with)),
    }
}

struct App<'a> {
    session: &'a mut Session,
    timeline: &'a mut Timeline,
    statistics: &'a mut Statistics,
    plan: Plan,
    stage: Stage,
    show: Shown,
    hand: Option<Hand>,
    mouse: Mouse,
    /// As drawn last.
    eyes: Eyes,
    /// As drawn last, world from body.
    god_object: Isometry3<f64>,
    screen: Option<Display>,
    start: Instant,
    next_frame: Instant,
    /// From the first frame on.
    pacer: Option<Pacer>,
    last_drawn: Option<Drawn>,
    result: Option<Result<Ended, RenderError>>,
}

/// A frame to be drawn.
struct Due {
    latched: Latched,
    /// The barrier released it.
    locked: bool,
    drawn: Drawn,
    health: LinkHealth,
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.screen.is_some() {
            return;
        }
        match self.open(events) {
            Ok(screen) => {
                if screen.gpu.is_software() {
                    let slower = self.plan.software_frame_time;
                    self.plan.frame_time = self.plan.frame_time.max(slower);
                }
                self.screen = Some(screen);
            }
            Err(error) => self.end(events, Err(error)),
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        self.move_hand(id, &event);
        match event {
            WindowEvent::CloseRequested => self.end(events, Ok(Ended::Closed)),
            WindowEvent::KeyboardInput { event, .. }
                if event.state == ElementState::Pressed && !event.repeat =>
            {
                self.key(events, event.physical_key);
            }
            WindowEvent::Resized(size) => {
                if let Some(screen) = &mut self.screen {
                    screen.resize(&self.stage, id, size);
                }
                self.last_drawn = None;
            }
            WindowEvent::RedrawRequested => self.last_drawn = None,
            _ => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if self.result.is_some() {
            return;
        }
        match self.tick(events) {
            Ok(None) => events.set_control_flow(ControlFlow::WaitUntil(self.next_frame)),
            Ok(Some(ended)) => self.end(events, Ok(ended)),
            Err(error) => self.end(events, Err(error)),
        }
    }
}

impl App<'_> {
    fn end(&mut self, events: &ActiveEventLoop, result: Result<Ended, RenderError>) {
        self.result.get_or_insert(result);
        events.exit();
    }

    fn key(&mut self, events: &ActiveEventLoop, key: PhysicalKey) {
        let PhysicalKey::Code(code) = key else {
            return;
        };
        match code {
            KeyCode::Escape => self.end(events, Ok(Ended::Closed)),
            KeyCode::KeyF => {
                let panes = self.screen.iter().flat_map(|screen| &screen.panes);
                panes.for_each(|pane| toggle_fullscreen(&pane.window));
            }
            KeyCode::KeyP | KeyCode::KeyR => self.let_go_or_return(code),
            _ => self.show.key(code),
        }
        self.last_drawn = None;
    }

    /// Moves the held body by an event of the window `id`.
    fn move_hand(&mut self, id: WindowId, event: &WindowEvent) {
        let (Some(hand), Some(display)) = (&mut self.hand, &self.screen) else {
            return;
        };
        if let WindowEvent::ModifiersChanged(modifiers) = event {
            self.mouse.modifiers(modifiers.state());
        }
        let Some(pane) = display.panes.iter().find(|pane| pane.window.id() == id) else {
            return;
        };
        let pointed = Pointed {
            screen: &self.stage.screens[pane.screen].screen,
            picture: &pane.picture,
            size: (pane.config.width.into(), pane.config.height.into()),
            eyes: &self.eyes,
        };
        if self.mouse.event(event, &pointed, &mut hand.hold) {
            hand.lead(self.mouse.buttons());
        }
    }

    fn let_go_or_return(&mut self, code: KeyCode) {
        let Some(hand) = &mut self.hand else {
            return;
        };
        if code == KeyCode::KeyP {
            hand.hold.toggle(&self.god_object);
        } else {
            hand.hold.reset();
        }
        hand.lead(self.mouse.buttons());
    }

    /// Draws another scene from now on: in the same windows, unless the node's screens changed too.
    fn restage(&mut self, events: &ActiveEventLoop, stage: Stage) -> Result<(), RenderError> {
        let windows = |stage: &Stage| -> Vec<_> {
            let screens = stage.screens.iter();
            screens
                .map(|screen| (screen.name.clone(), screen.pixels, screen.stereo))
                .collect()
        };
        let same = windows(&stage) == windows(&self.stage);
        self.stage = stage;
        self.god_object = self.stage.god_object.pose;
        if let Some(hand) = &mut self.hand {
            hand.follow(&self.stage, self.mouse.buttons());
        }
        match &mut self.screen {
            Some(screen) if same => screen.restage(&self.stage)?,
            _ => {
                self.screen = None; // its windows close before the new ones open
                self.screen = Some(self.open(events)?);
            }
        }
        Ok(())
    }

    /// Opens windows where they are asked to be, or else where the scene of this session says.
    fn open(&self, events: &ActiveEventLoop) -> Result<Display, RenderError> {
        let places = self.plan.asked.or(self.session.places());
        let holds = self.hand.is_some();
        Display::open(events, &self.stage, &self.plan, &places, holds)
    }

    /// What the window system has told of the light of earlier frames.
    fn take_light(&mut self) {
        let light = self.screen.as_mut().map(|screen| &mut screen.light);
        let Some(Ok(light)) = light else {
            return;
        };
        while let Some(lit) = light.take() {
            self.statistics
                .light(lit.lit.saturating_duration_since(lit.called));
            if let (Some(frame), Some(pacer)) = (lit.frame, &mut self.pacer) {
                pacer.lit(frame, lit.lit);
            }
        }
        self.statistics.unlit += light.take_unlit();
    }

    /// Draws a frame if one is due; says if this was the last.
    fn tick(&mut self, events: &ActiveEventLoop) -> Result<Option<Ended>, RenderError> {
        if let Some(ended) = self.follow_session(events)? {
            return Ok(Some(ended));
        }
        self.take_light();
        if let Some(stats) = self.statistics.report(false) {
            self.session.report(stats);
        }
        self.session.take_states(self.timeline);
        let (Some(taken_ns), true) = (self.session.now_ns(), self.screen.is_some()) else {
            self.next_frame = Instant::now() + MOMENT;
            return Ok(None);
        };
        let Some(due) = self.due(taken_ns) else {
            return Ok(None);
        };
        if !self.draw(due, taken_ns)? {
            return Ok(None);
        }
        self.tell_first_frame();
        let enough = self
            .plan
            .frames
            .is_some_and(|frames| self.statistics.frames >= frames);
        Ok(enough.then_some(Ended::Frames))
    }

    /// Takes part in the session's changes; why drawing ends, if it does.
    fn follow_session(&mut self, events: &ActiveEventLoop) -> Result<Option<Ended>, RenderError> {
        if self.session.interrupted() {
            return Ok(Some(Ended::Interrupted));
        }
        match self.session.turn(self.timeline) {
            Turn::Same => {}
            Turn::Renewed(other) => {
                self.statistics.renewed();
                if let Some(scene) = other {
                    self.show.follow(scene.1);
                    self.restage(events, scene.0)?;
                }
                self.pacer = None;
                self.last_drawn = None;
            }
            Turn::Told => return Ok(Some(Ended::ServerStopped)),
            Turn::Lost(reason) => return Err(self.session.lost(reason)),
        }
        let over = |duration| self.start.elapsed() >= duration;
        Ok(self
            .plan
            .duration
            .is_some_and(over)
            .then_some(Ended::Duration))
    }

    /// What is to be drawn now; `None` where nothing is due, or nothing has changed.
    fn due(&mut self, taken_ns: u64) -> Option<Due> {
        let (session, frame_time) = (&*self.session, self.plan.frame_time);
        let display_ns = self.plan.display_ns;
        let pacer = self
            .pacer
            .get_or_insert_with(|| Pacer::new(session, frame_time, display_ns));
        let released = pacer
            .next(taken_ns, self.timeline.newest_ns())
            .filter(|_| pacer.draws_at(self.next_frame, frame_time));
        let locked = released.is_some();
        let now = Instant::now();
        if !locked && now < self.next_frame {
            return None; // where there is a barrier, that keeps the rhythm
        }
        self.next_frame = (self.next_frame + frame_time).max(now);
        let latched = released.or_else(|| self.timeline.latch(taken_ns))?;
        let health = self.session.health();
        let drawn = (latched.state.time_ns, latched.stale, shown(health));
        if self.last_drawn == Some(drawn) && !locked && !session.is_picture_asked() {
            return None;
        }
        Some(Due {
            latched,
            locked,
            drawn,
            health,
        })
    }

    /// Draws and shows a frame; `false` where all windows are hidden.
    fn draw(&mut self, due: Due, taken_ns: u64) -> Result<bool, RenderError> {
        let Due {
            mut latched,
            locked,
            drawn,
            health,
        } = due;
        let (Some(screen), Some(pacer)) = (&mut self.screen, &mut self.pacer) else {
            return Ok(false);
        };
        let Display {
            gpu,
            renderer,
            panes,
            light,
        } = screen;
        let show = self.show.now();
        renderer.set_state(gpu, &self.stage, &latched, show);
        let status = pacer.complete(self.statistics.status(&self.plan.node, health));
        renderer.set_overlay(Overlay::of(&status, latched.stale, show.hud));
        if !locked {
            // As late as can be: the head where it will be when the picture lights up. Screens that are shown together are drawn for
            // one head, which follows from their frame: a line across their edge would break otherwise.
            self.session.take_states(self.timeline);
            let photon_ns = self.session.now_ns().unwrap_or(taken_ns) + self.plan.display_ns;
            latched.state.head = self.timeline.head_at(photon_ns).or(latched.state.head);
        }
        let eyes = eyes_of(&self.stage, &latched);
        (self.eyes, self.god_object) = (eyes, latched.state.god_object);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut textures = Vec::with_capacity(panes.len());
        for (place, pane) in panes.iter().enumerate() {
            let Next::Texture(texture) = pane.texture(gpu)? else {
                continue;
            };
            let view = pane.view(&texture);
            let screen = &self.stage.screens[pane.screen].screen;
            renderer.draw(gpu, &mut encoder, screen, &eyes, &pane.target, &view);
            textures.push((place, pane, texture));
        }
        let visible: Vec<usize> = textures.iter().map(|(place, ..)| *place).collect();
        if visible.is_empty() && !locked {
            self.give_pictures(&visible);
            return Ok(false); // all windows are hidden
        }
        gpu.queue.submit([encoder.finish()]);
        if locked {
            // All pictures of all nodes are drawn before any is shown.
            gpu.finish()?;
            pacer.wait();
        }
        if let Ok(light) = light {
            light.follow(pacer.frame(), textures.iter().map(|(place, ..)| *place));
        }
        for (_, pane, texture) in textures {
            pane.window.pre_present_notify();
            gpu.queue.present(texture);
        }
        if locked {
            self.statistics.swap(pacer.shown());
        } else {
            gpu.finish()?;
        }
        self.last_drawn = Some(drawn);
        let drawn_ns = self.session.now_ns().unwrap_or(taken_ns);
        self.statistics.frame(&latched, taken_ns, drawn_ns);
        self.give_pictures(&visible);
        Ok(true)
    }

    /// Gives the server the pictures of the frame that was drawn last, if it wants them: of the windows at these places, since the others are hidden.
    fn give_pictures(&self, visible: &[usize]) {
        let Some(display) = &self.screen else {
            return;
        };
        let parts = || {
            let panes = visible.iter().filter_map(|place| display.panes.get(*place));
            panes.map(Pane::part).collect()
        };
        self.session.give_pictures(
            |shown_ns| display.frame(&self.stage, &self.eyes, shown_ns),
            parts,
        );
    }

    fn tell_first_frame(&mut self) {
        let Some(Display { gpu, panes, .. }) = &self.screen else {
            return;
        };
        let stage = &self.stage;
        self.session.tell_first_frame(|| {
            let of = |pane: &Pane| {
                let (name, size) = (&stage.screens[pane.screen].name, &pane.config);
                format!("{name} {}x{}", size.width, size.height)
            };
            let pictures = panes.iter().map(of).collect::<Vec<_>>().join(", ");
            (pictures, gpu.summary().to_string())
        });
    }
}

fn toggle_fullscreen(window: &Window) {
    let now = match window.fullscreen() {
        Some(_) => None,
        None => Some(Fullscreen::Borderless(window.current_monitor())),
    };
    window.set_fullscreen(now);
}
