//! When pictures lit up, as a Wayland compositor tells it by `wp_presentation`.
//!
//! winit hands display and surfaces out as the C pointers of libwayland; this file, and no other of the node, takes them: it asks on winit's own
//! connection, by a queue of its own. What comes for that queue is read with what comes for winit's, whose loop waits on the socket.
#![allow(
    unsafe_code,
    reason = "winit hands its Wayland display and surfaces out by C pointers alone"
)]

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};
use wayland_backend::client::{Backend, ObjectId};
use wayland_client::globals::{GlobalListContents, registry_queue_init};
use wayland_client::protocol::wl_registry::{self, WlRegistry};
use wayland_client::protocol::wl_surface::WlSurface;
use wayland_client::{Connection, Dispatch, EventQueue, Proxy, QueueHandle, WEnum};
use wayland_protocols::wp::presentation_time::client::wp_presentation::{self, WpPresentation};
use wayland_protocols::wp::presentation_time::client::wp_presentation_feedback::{
    self, Kind, WpPresentationFeedback,
};
use winit::event_loop::OwnedDisplayHandle;
use winit::raw_window_handle::{
    HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle,
};
use winit::window::Window;

/// Frames that are followed at once; the compositor holds more back only while windows are hidden, and those are not asked for.
const MAX_FOLLOWED: usize = 64;

/// Asks the compositor of the node's windows.
pub(super) struct Light {
    queue: EventQueue<Told>,
    told: Told,
    presentation: WpPresentation,
    /// In the order of the windows.
    surfaces: Vec<WlSurface>,
    /// What the pointers above belong to: dropped after them.
    _windows: Vec<Arc<Window>>,
    _display: OwnedDisplayHandle,
}

/// A frame all of whose pictures lit up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lit {
    /// Its number at the barrier, where it had one.
    pub(super) frame: Option<u64>,
    /// When its first picture was handed over.
    pub(super) called: Instant,
    /// When its last picture lit up.
    pub(super) lit: Instant,
}

/// What the compositor has told.
#[derive(Debug, Default)]
struct Told {
    clock: Option<ClockId>,
    /// Number of the oldest of `frames`.
    oldest: u64,
    frames: VecDeque<Followed>,
    /// Frames a picture of which never lit up: a newer one came first, or the window was hidden.
    discarded: u64,
    newest: Option<(Kind, Duration)>,
}

#[derive(Debug)]
struct Followed {
    frame: Option<u64>,
    called: Instant,
    /// Pictures that were not told of yet.
    open: usize,
    lit: Option<Instant>,
    discarded: bool,
}

impl Light {
    /// `None` where there is nobody to ask: under X11, and where the compositor has no `wp_presentation`.
    pub(super) fn of(display: OwnedDisplayHandle, windows: Vec<Arc<Window>>) -> Option<Self> {
        let RawDisplayHandle::Wayland(handle) = display.display_handle().ok()?.as_raw() else {
            return None;
        };
        // SAFETY: the display is winit's, open while `_display` holds its connection, which is dropped last; this backend does not close it.
        let backend = unsafe { Backend::from_foreign_display(handle.display.as_ptr().cast()) };
        let connection = Connection::from_backend(backend);
        let (globals, mut queue) = registry_queue_init::<Told>(&connection).ok()?;
        let presentation: WpPresentation = globals.bind(&queue.handle(), 1..=1, ()).ok()?;
        let mut told = Told::default();
        queue.roundtrip(&mut told).ok()?; // its clock
        told.clock?;
        let surface = |window: &Arc<Window>| {
            let RawWindowHandle::Wayland(handle) = window.window_handle().ok()?.as_raw() else {
                return None;
            };
            // SAFETY: the surface is the window's, a `wl_surface` of the same connection, and lives as long as the window, which `_windows` holds.
            let id = unsafe {
                ObjectId::from_ptr(WlSurface::interface(), handle.surface.as_ptr().cast())
            };
            WlSurface::from_id(&connection, id.ok()?).ok()
        };
        let surfaces = windows.iter().map(surface).collect::<Option<Vec<_>>>()?;
        Some(Self {
            queue,
            told,
            presentation,
            surfaces,
            _windows: windows,
            _display: display,
        })
    }

    /// Follows the frame that is handed over next, with pictures in these windows, by their places: call it right before.
    pub(super) fn follow(&mut self, frame: Option<u64>, places: impl Iterator<Item = usize>) {
        if self.told.frames.len() == MAX_FOLLOWED {
            return;
        }
        let number = self.told.oldest + self.told.frames.len() as u64;
        let mut open = 0;
        for surface in places.filter_map(|place| self.surfaces.get(place)) {
            self.presentation
                .feedback(surface, &self.queue.handle(), number);
            open += 1;
        }
        if open > 0 {
            self.told.frames.push_back(Followed {
                frame,
                called: Instant::now(),
                open,
                lit: None,
                discarded: false,
            });
        }
    }

    /// The next frame that lit up, in order.
    pub(super) fn take(&mut self) -> Option<Lit> {
        // An error of the connection is winit's to tell.
        let _ = self.queue.dispatch_pending(&mut self.told);
        self.told.take()
    }

    /// Frames that never lit up.
    pub(super) fn discarded(&self) -> u64 {
        self.told.discarded
    }

    /// What the times are worth, for people.
    pub(super) fn described(&self) -> String {
        let clock = match self.told.clock {
            Some(clock) => format!("{clock:?}"),
            None => "unknown".to_owned(),
        };
        let Some((kind, refresh)) = self.told.newest else {
            return format!("told by the compositor (clock {clock}); none came yet");
        };
        let rate = match refresh.as_secs_f64() {
            0.0 => "no constant refresh".to_owned(),
            period => format!("a refresh each {:.2} ms", 1e3 * period),
        };
        format!(
            "told by the compositor (clock {clock}, {rate}; {})",
            worth(kind)
        )
    }
}

/// By the protocol's flags.
fn worth(kind: Kind) -> String {
    let flags = [
        (Kind::Vsync, "at the refresh"),
        (Kind::HwClock, "by the display's clock"),
        (Kind::HwCompletion, "the display said so"),
        (Kind::ZeroCopy, "without a copy"),
    ];
    let said = flags.into_iter().filter(|(flag, _)| kind.contains(*flag));
    let said: Vec<_> = said.map(|(_, text)| text).collect();
    match said.is_empty() {
        true => "by the compositor's own timer, no display vouches for it".to_owned(),
        false => said.join(", "),
    }
}

impl Told {
    fn followed(&mut self, number: u64) -> Option<&mut Followed> {
        let place = usize::try_from(number.checked_sub(self.oldest)?).ok()?;
        self.frames.get_mut(place)
    }

    /// One picture of a frame lit up at `lit`, or never (`None`).
    fn note(&mut self, number: u64, lit: Option<Instant>) {
        let Some(followed) = self.followed(number) else {
            return;
        };
        followed.open = followed.open.saturating_sub(1);
        followed.discarded |= lit.is_none();
        followed.lit = followed.lit.max(lit);
    }

    fn take(&mut self) -> Option<Lit> {
        while self.frames.front().is_some_and(|frame| frame.open == 0) {
            let done = self.frames.pop_front()?;
            self.oldest += 1;
            if let (Some(lit), false) = (done.lit, done.discarded) {
                return Some(Lit {
                    frame: done.frame,
                    called: done.called,
                    lit,
                });
            }
            self.discarded += 1;
        }
        None
    }

    /// A time of the compositor's clock on this program's.
    fn instant(&self, at: Duration) -> Option<Instant> {
        let clock = clock_gettime(self.clock?);
        let now = Instant::now();
        let reading = Duration::new(
            u64::try_from(clock.tv_sec).ok()?,
            u32::try_from(clock.tv_nsec).ok()?,
        );
        match reading.checked_sub(at) {
            Some(ago) => now.checked_sub(ago),
            None => now.checked_add(at - reading), // planned by the display, and told before it is
        }
    }
}

/// By the number of Linux; `None` for one that is not a clock of the machine.
fn clock_of(number: u32) -> Option<ClockId> {
    let known = [
        ClockId::Realtime,
        ClockId::Monotonic,
        #[cfg(target_os = "linux")]
        ClockId::MonotonicRaw,
        #[cfg(target_os = "linux")]
        ClockId::RealtimeCoarse,
        #[cfg(target_os = "linux")]
        ClockId::MonotonicCoarse,
        #[cfg(target_os = "linux")]
        ClockId::Boottime,
    ];
    known.into_iter().find(|clock| *clock as u32 == number)
}

impl Dispatch<WpPresentation, ()> for Told {
    fn event(
        told: &mut Self,
        _: &WpPresentation,
        event: wp_presentation::Event,
        _: &(),
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let wp_presentation::Event::ClockId { clk_id } = event {
            told.clock = clock_of(clk_id);
        }
    }
}

impl Dispatch<WpPresentationFeedback, u64> for Told {
    fn event(
        told: &mut Self,
        _: &WpPresentationFeedback,
        event: wp_presentation_feedback::Event,
        number: &u64,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        match event {
            wp_presentation_feedback::Event::Presented {
                tv_sec_hi,
                tv_sec_lo,
                tv_nsec,
                refresh,
                flags,
                ..
            } => {
                let seconds = u64::from(tv_sec_hi) << 32 | u64::from(tv_sec_lo);
                // More than a second of nanoseconds is no time.
                let at = (tv_nsec < 1_000_000_000).then(|| Duration::new(seconds, tv_nsec));
                let kind = match flags {
                    WEnum::Value(kind) => kind,
                    WEnum::Unknown(_) => Kind::empty(),
                };
                told.newest = Some((kind, Duration::from_nanos(refresh.into())));
                let lit = at.and_then(|at| told.instant(at));
                told.note(*number, lit);
            }
            wp_presentation_feedback::Event::Discarded => told.note(*number, None),
            _ => {}
        }
    }
}

impl Dispatch<WlRegistry, GlobalListContents> for Told {
    fn event(
        _: &mut Self,
        _: &WlRegistry,
        _: wl_registry::Event,
        _: &GlobalListContents,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn following(pictures: &[usize]) -> Told {
        let followed = |(frame, open): (usize, &usize)| Followed {
            frame: Some(100 + frame as u64),
            called: Instant::now(),
            open: *open,
            lit: None,
            discarded: false,
        };
        Told {
            clock: Some(ClockId::Monotonic),
            oldest: 7,
            frames: pictures.iter().enumerate().map(followed).collect(),
            ..Told::default()
        }
    }

    #[test]
    fn a_frame_lit_up_when_its_last_picture_did_and_frames_come_in_order() {
        let mut told = following(&[2, 1]);
        let now = Instant::now();
        let at = |ms| now.checked_add(Duration::from_millis(ms));
        told.note(8, at(30));
        assert_eq!(told.take(), None, "the one before is not told of");
        told.note(7, at(16));
        told.note(7, at(12));
        let first = told.take().expect("both told");
        assert_eq!((first.frame, Some(first.lit)), (Some(100), at(16)));
        assert_eq!(told.take().and_then(|lit| lit.frame), Some(101));
        assert_eq!((told.take(), told.discarded), (None, 0));
    }

    #[test]
    fn a_frame_of_which_a_picture_never_lit_up_is_counted_and_has_no_light() {
        let mut told = following(&[2, 1]);
        told.note(7, Some(Instant::now()));
        told.note(7, None);
        told.note(8, Some(Instant::now()));
        told.note(99, None); // nobody asked
        assert_eq!(told.take().and_then(|lit| lit.frame), Some(101));
        assert_eq!(told.discarded, 1);
    }

    #[test]
    fn a_time_of_the_compositor_s_clock_is_one_of_this_program_s() {
        for clock in [ClockId::Monotonic, ClockId::MonotonicRaw] {
            let told = Told {
                clock: Some(clock),
                ..Told::default()
            };
            let reading = clock_gettime(clock);
            let reading = Duration::new(reading.tv_sec as u64, reading.tv_nsec as u32);
            let before = Instant::now();
            let ago = told
                .instant(reading - Duration::from_secs(5))
                .expect("a time");
            let ahead = told
                .instant(reading + Duration::from_secs(5))
                .expect("a time");
            let off = (before - ago).abs_diff(Duration::from_secs(5));
            assert!(off < Duration::from_millis(100), "{clock:?}: {off:?}");
            let apart = (ahead - ago).abs_diff(Duration::from_secs(10));
            assert!(apart < Duration::from_millis(100), "{clock:?}: {apart:?}");
        }
        assert_eq!(clock_of(4), Some(ClockId::MonotonicRaw));
        assert_eq!(clock_of(3), None, "a thread's processor time");
    }

    #[test]
    fn flags_say_what_a_time_is_worth() {
        assert!(worth(Kind::empty()).contains("timer"));
        assert_eq!(
            worth(Kind::Vsync | Kind::HwCompletion),
            "at the refresh, the display said so"
        );
    }
}
