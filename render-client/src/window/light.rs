//! When pictures lit up, as a Wayland compositor tells it by `wp_presentation`.
//!
//! Asks on winit's own connection ([`foreign`]), by a queue of its own. What comes for that queue is read with what comes for winit's, whose loop
//! waits on the socket. What the compositor tells is from outside: a time that cannot be is not believed, and no answer stops a frame.

mod foreign;

use std::collections::VecDeque;
use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};
use wayland_client::globals::{GlobalListContents, registry_queue_init};
use wayland_client::protocol::wl_registry::{self, WlRegistry};
use wayland_client::{Connection, Dispatch, EventQueue, QueueHandle, WEnum};
use wayland_protocols::wp::presentation_time::client::wp_presentation::{self, WpPresentation};
use wayland_protocols::wp::presentation_time::client::wp_presentation_feedback::{
    self, Kind, WpPresentationFeedback,
};
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

use foreign::Foreign;

/// Frames that are followed at once. A compositor that keeps its answers longer is asked for no more until it gives them.
const MAX_FOLLOWED: usize = 64;

/// Farthest that a time of light is believed from the moment at which it is told, either way: a display plans a refresh ahead, and tells late only
/// when the program did not look. Anything farther is a clock that is not the one that was named.
const FARTHEST: Duration = Duration::from_secs(10);

/// Asks the compositor of the node's windows.
pub(super) struct Light {
    queue: EventQueue<Feedback>,
    feedback: Feedback,
    presentation: WpPresentation,
    /// What the others stand on: dropped after them.
    foreign: Foreign,
}

/// Why nobody tells when pictures light up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoFeedback {
    /// X11, or another window system that is not Wayland.
    NotWayland,
    /// A compositor without `wp_presentation`.
    NoProtocol,
    /// A compositor whose times are of a clock that this program cannot read.
    NoClock,
}

impl fmt::Display for NoFeedback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotWayland => "this window system is not Wayland, which alone tells",
            Self::NoProtocol => "the Wayland compositor has no wp_presentation",
            Self::NoClock => "the Wayland compositor names a clock that cannot be read here",
        })
    }
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
struct Feedback {
    clock: Option<ClockId>,
    /// Number of the oldest of `frames`.
    oldest: u64,
    frames: VecDeque<Followed>,
    /// Frames without a light: a newer one came before a picture lit up, a window was hidden, or the time told cannot be.
    unlit: u64,
    newest: Option<(Kind, Duration)>,
}

#[derive(Debug)]
struct Followed {
    frame: Option<u64>,
    called: Instant,
    /// Pictures that were not told of yet.
    open: usize,
    lit: Option<Instant>,
    unlit: bool,
}

impl Light {
    /// Begins to listen; asks nothing yet.
    pub(super) fn of(
        display: OwnedDisplayHandle,
        windows: Vec<Arc<Window>>,
    ) -> Result<Self, NoFeedback> {
        let foreign = Foreign::of(display, windows).ok_or(NoFeedback::NotWayland)?;
        let (globals, mut queue) = registry_queue_init::<Feedback>(foreign.connection())
            .map_err(|_| NoFeedback::NoProtocol)?;
        let presentation: WpPresentation = globals
            .bind(&queue.handle(), 1..=1, ())
            .map_err(|_| NoFeedback::NoProtocol)?;
        let mut feedback = Feedback::default();
        queue
            .roundtrip(&mut feedback)
            .map_err(|_| NoFeedback::NoProtocol)?; // its clock
        feedback.clock.ok_or(NoFeedback::NoClock)?;
        Ok(Self {
            queue,
            feedback,
            presentation,
            foreign,
        })
    }

    /// Follows the frame that is handed over next, with pictures in these windows, by their places: call it right before.
    pub(super) fn follow(&mut self, frame: Option<u64>, places: impl Iterator<Item = usize>) {
        let Some(number) = self.feedback.next_number() else {
            return;
        };
        let mut pictures = 0;
        for surface in places.filter_map(|place| self.foreign.surface(place)) {
            self.presentation
                .feedback(surface, &self.queue.handle(), number);
            pictures += 1;
        }
        self.feedback.follow(frame, pictures);
    }

    /// The next frame that lit up, in order.
    pub(super) fn take(&mut self) -> Option<Lit> {
        // An error of the connection is winit's to tell.
        let _ = self.queue.dispatch_pending(&mut self.feedback);
        self.feedback.take()
    }

    /// Frames without a light ([`Feedback::unlit`]) that were told of since this was asked last.
    pub(super) fn take_unlit(&mut self) -> u64 {
        std::mem::take(&mut self.feedback.unlit)
    }

    /// What the times are worth, for people.
    pub(super) fn described(&self) -> String {
        let clock = match self.feedback.clock {
            Some(clock) => format!("{clock:?}"),
            None => "unknown".to_owned(),
        };
        let Some((kind, refresh)) = self.feedback.newest else {
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

impl Feedback {
    /// Number of the frame that is followed next; `None` while as many as can be wait for their light.
    fn next_number(&self) -> Option<u64> {
        let waiting = self.frames.len();
        (waiting < MAX_FOLLOWED).then(|| self.oldest + waiting as u64)
    }

    /// A frame with this number at the barrier is handed over now, if it has a picture.
    fn follow(&mut self, frame: Option<u64>, pictures: usize) {
        if pictures == 0 {
            return;
        }
        self.frames.push_back(Followed {
            frame,
            called: Instant::now(),
            open: pictures,
            lit: None,
            unlit: false,
        });
    }

    fn followed(&mut self, number: u64) -> Option<&mut Followed> {
        let place = usize::try_from(number.checked_sub(self.oldest)?).ok()?;
        self.frames.get_mut(place)
    }

    /// One picture of a frame lit up at `lit`; `None` where it never did, or nobody knows when.
    fn note(&mut self, number: u64, lit: Option<Instant>) {
        let Some(followed) = self.followed(number) else {
            return;
        };
        followed.open = followed.open.saturating_sub(1);
        followed.unlit |= lit.is_none();
        followed.lit = followed.lit.max(lit);
    }

    fn take(&mut self) -> Option<Lit> {
        while self.frames.front().is_some_and(|frame| frame.open == 0) {
            let done = self.frames.pop_front()?;
            self.oldest += 1;
            if let (Some(lit), false) = (done.lit, done.unlit) {
                return Some(Lit {
                    frame: done.frame,
                    called: done.called,
                    lit,
                });
            }
            self.unlit += 1;
        }
        None
    }

    /// A time of the compositor's clock on this program's; `None` where it is farther than [`FARTHEST`] from now.
    fn instant(&self, at: Duration) -> Option<Instant> {
        let clock = clock_gettime(self.clock?);
        let now = Instant::now();
        let reading = Duration::new(
            u64::try_from(clock.tv_sec).ok()?,
            u32::try_from(clock.tv_nsec).ok()?,
        );
        if reading.abs_diff(at) > FARTHEST {
            return None;
        }
        match reading.checked_sub(at) {
            Some(ago) => now.checked_sub(ago),
            None => now.checked_add(at - reading), // planned by the display, and told before it is
        }
    }

    /// A picture of the frame with this number lit up at a time of the compositor's clock, in its parts as on the wire.
    fn presented(&mut self, number: u64, (high, low, ns): (u32, u32, u32)) {
        let seconds = u64::from(high) << 32 | u64::from(low);
        // More than a second of nanoseconds is no time.
        let at = (ns < 1_000_000_000).then(|| Duration::new(seconds, ns));
        let lit = at.and_then(|at| self.instant(at));
        self.note(number, lit);
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

impl Dispatch<WpPresentation, ()> for Feedback {
    fn event(
        feedback: &mut Self,
        _: &WpPresentation,
        event: wp_presentation::Event,
        _: &(),
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let wp_presentation::Event::ClockId { clk_id } = event {
            feedback.clock = clock_of(clk_id);
        }
    }
}

impl Dispatch<WpPresentationFeedback, u64> for Feedback {
    fn event(
        feedback: &mut Self,
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
                let kind = match flags {
                    WEnum::Value(kind) => kind,
                    WEnum::Unknown(_) => Kind::empty(),
                };
                feedback.newest = Some((kind, Duration::from_nanos(refresh.into())));
                feedback.presented(*number, (tv_sec_hi, tv_sec_lo, tv_nsec));
            }
            wp_presentation_feedback::Event::Discarded => feedback.note(*number, None),
            _ => {}
        }
    }
}

impl Dispatch<WlRegistry, GlobalListContents> for Feedback {
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
    use proptest::prelude::*;

    /// Follows frames 100, 101 .. with so many pictures each, by numbers from 7 on.
    fn following(pictures: &[usize]) -> Feedback {
        let mut feedback = Feedback {
            clock: Some(ClockId::Monotonic),
            oldest: 7,
            ..Feedback::default()
        };
        for (frame, pictures) in (100..).zip(pictures) {
            feedback.follow(Some(frame), *pictures);
        }
        feedback
    }

    /// The clock that the compositor is said to have.
    fn reading(clock: ClockId) -> Duration {
        let reading = clock_gettime(clock);
        Duration::new(reading.tv_sec as u64, reading.tv_nsec as u32)
    }

    #[test]
    fn a_frame_lit_up_when_its_last_picture_did_and_frames_come_in_order() {
        let mut feedback = following(&[2, 1]);
        let now = Instant::now();
        let at = |ms| now.checked_add(Duration::from_millis(ms));
        feedback.note(8, at(30));
        assert_eq!(feedback.take(), None, "the one before is not told of");
        feedback.note(7, at(16));
        feedback.note(7, at(12));
        let first = feedback.take().expect("both told");
        assert_eq!((first.frame, Some(first.lit)), (Some(100), at(16)));
        assert_eq!(feedback.take().and_then(|lit| lit.frame), Some(101));
        assert_eq!((feedback.take(), feedback.unlit), (None, 0));
    }

    #[test]
    fn a_frame_of_which_a_picture_never_lit_up_is_counted_and_has_no_light() {
        let mut feedback = following(&[2, 1]);
        feedback.note(7, Some(Instant::now()));
        feedback.note(7, None);
        feedback.note(8, Some(Instant::now()));
        feedback.note(99, None); // nobody asked
        assert_eq!(feedback.take().and_then(|lit| lit.frame), Some(101));
        assert_eq!(feedback.unlit, 1);
    }

    #[test]
    fn a_time_of_the_compositor_s_clock_is_one_of_this_program_s() {
        for clock in [ClockId::Monotonic, ClockId::MonotonicRaw] {
            let feedback = Feedback {
                clock: Some(clock),
                ..Feedback::default()
            };
            // However long this thread is kept waiting: between the moments around it, but for the rates of two clocks.
            let rates = Duration::from_millis(1);
            for ahead in [false, true] {
                let away = Duration::from_secs(5);
                let before = Instant::now();
                let reading = reading(clock);
                let at = if ahead {
                    reading + away
                } else {
                    reading - away
                };
                let feedback = feedback.instant(at).expect("a time");
                let after = Instant::now();
                let now = if ahead {
                    feedback - away
                } else {
                    feedback + away
                };
                assert!(before <= now + rates && now <= after + rates, "{clock:?}");
            }
        }
        assert_eq!(clock_of(4), Some(ClockId::MonotonicRaw));
        assert_eq!(clock_of(3), None, "a thread's processor time");
    }

    #[test]
    fn a_time_that_cannot_be_is_no_light_and_stops_no_frame() {
        let far = (reading(ClockId::Monotonic) + 2 * FARTHEST).as_secs() as u32;
        let impossible = [
            (0, 0, 0),               // since the start of the machine, or of another clock
            (u32::MAX, u32::MAX, 0), // beyond what this program's clock can hold
            (0, far, 0),             // more than ten seconds ahead
            (0, u32::MAX, 999_999_999),
            (0, 1, 1_000_000_000), // more than a second of nanoseconds
        ];
        for parts in impossible {
            let mut feedback = following(&[1, 1]);
            feedback.presented(7, parts);
            let now = reading(ClockId::Monotonic);
            feedback.presented(8, (0, now.as_secs() as u32, now.subsec_nanos()));
            let next = feedback.take().and_then(|lit| lit.frame);
            assert_eq!((next, feedback.unlit), (Some(101), 1), "{parts:?}");
        }
    }

    #[test]
    fn why_nobody_tells_is_said_by_name() {
        assert!(
            NoFeedback::NoProtocol
                .to_string()
                .contains("wp_presentation")
        );
        assert!(NoFeedback::NotWayland.to_string().contains("not Wayland"));
    }

    /// What a node or a compositor does.
    #[derive(Clone, Debug)]
    enum Done {
        Follow(usize),
        Presented(u64, (u32, u32, u32)),
        Discarded(u64),
        Take,
    }

    fn done() -> impl Strategy<Value = Done> {
        let parts = || (0_u32..3, any::<u32>(), 0_u32..1_100_000_000);
        let soon = move || {
            let now = reading(ClockId::Monotonic).as_secs() as u32;
            (Just(0), now - 12..now + 12, 0_u32..1_000_000_000)
        };
        prop_oneof![
            (0_usize..3).prop_map(Done::Follow),
            (0_u64..90, parts()).prop_map(|(number, at)| Done::Presented(number, at)),
            (0_u64..90, soon()).prop_map(|(number, at)| Done::Presented(number, at)),
            (0_u64..90).prop_map(Done::Discarded),
            Just(Done::Take),
        ]
    }

    proptest! {
        /// Whatever a compositor answers, in whatever order and how often.
        #[test]
        fn no_answer_of_a_compositor_breaks_the_count_of_frames(all in proptest::collection::vec(done(), 0..400)) {
            let mut feedback = following(&[]);
            feedback.oldest = 0;
            let (mut followed, mut taken) = (0_u64, Vec::new());
            for one in all {
                match one {
                    Done::Follow(pictures) if feedback.next_number().is_some() => {
                        feedback.follow(Some(followed), pictures);
                        followed += u64::from(pictures > 0);
                    }
                    Done::Follow(_) => {}
                    Done::Presented(number, at) => feedback.presented(number, at),
                    Done::Discarded(number) => feedback.note(number, None),
                    Done::Take => taken.extend(feedback.take()),
                }
                prop_assert!(feedback.frames.len() <= MAX_FOLLOWED);
                prop_assert_eq!(taken.len() as u64 + feedback.unlit + feedback.frames.len() as u64, followed);
            }
            let now = Instant::now();
            for lit in &taken {
                let off = lit.lit.saturating_duration_since(now).max(now.saturating_duration_since(lit.lit));
                prop_assert!(off < 2 * FARTHEST, "{off:?}");
            }
            prop_assert!(taken.is_sorted_by(|a, b| a.frame < b.frame));
        }
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
