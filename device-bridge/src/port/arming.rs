//! Whether there is force: a state machine, and the share of the commanded wrench that it lets through.
//!
//! ```text
//!              asked (or automatic), inputs good, dead-man held
//!   Disarmed ────────────────────────────────────────────────────► Arming ── ramp-in over ──► Armed
//!      ▲                                                            ▲  │                      │  ▲
//!      │                      fresh again after a silence           │  │   input late or bad  │  │ fresh again
//!      │          ┌─────────────────────────────────────────────────┘  ▼                      ▼  │ in time
//!      │          │                                                 Holding ◄─────────────────────
//!      │ zero: disarmed, or nobody asked after an outage               │ older than the hold
//!      └──────────┤                                                    ▼
//!              Fading ◄────────────────────────────────────────────────┘
//!                 │ zero, after a fault
//!                 ▼
//!              Faulted ── asked again (or automatic), inputs good ──► Arming
//! ```
//!
//! Who asks on the way down is answered at its end.
//!
//! | name in code | unit | meaning |
//! |--------------|------|---------|
//! | `gain`       | –    | share of the wrench that is let through, in [0, 1] |
//! | `OUTAGE`     | s    | silence after which a person arms, where persons do |
//!
//! **Outage.** Where a person arms ([`Rearm::Manual`]), commands that come again within [`OUTAGE`] from where they came before ramp in by
//! themselves: the person who armed has felt the gap. After a longer one, or from another process, nobody knows any more what the hand does and
//! where the god-object stands, so a person arms.

use std::time::Duration;

use super::event::EventKind;
use super::settings::{Rearm, SafetySettings};

/// Longest time without good commands after which those that come ramp in by themselves where a person arms.
pub(super) const OUTAGE: Duration = Duration::from_secs(1);

/// Who commands after a [`restart`](super::DevicePort::restart).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandSource {
    /// Who did before: the same session of the same process, heard by another connection.
    Same,
    /// Another process, or another session of it: it knows nothing of what was felt.
    Other,
}

/// Where the port stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum ArmingState {
    /// No force; nothing is wrong.
    #[default]
    Disarmed,
    /// The force ramps in.
    Arming,
    /// The force is there in full.
    Armed,
    /// An input is late or bad: the last force is held, for at most the hold.
    Holding,
    /// The force ramps out.
    Fading,
    /// No force after a fault.
    Faulted,
}

impl ArmingState {
    /// For people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Disarmed => "disarmed",
            Self::Arming => "arming",
            Self::Armed => "armed",
            Self::Holding => "holding",
            Self::Fading => "fading",
            Self::Faulted => "faulted",
        }
    }

    /// Whether somebody has to arm before there is force again, or the port itself when it may.
    #[must_use]
    pub fn is_off(self) -> bool {
        matches!(self, Self::Disarmed | Self::Faulted)
    }
}

/// What the port found out about this tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Situation {
    /// A fault of the samples or of the wrench lasts; since when there was no good input.
    pub(super) fault_since: Option<Duration>,
    /// The commands stopped: since when they are too old.
    pub(super) stale_since: Option<Duration>,
    /// Nothing is wrong yet, but the last input is late.
    pub(super) late: bool,
    /// Whoever commands gives no force now.
    pub(super) paused: bool,
    /// There was at least one command.
    pub(super) commanded: bool,
    /// The dead-man's button is held, or there is none.
    pub(super) held: bool,
    /// Somebody asks for force.
    pub(super) asked: bool,
    /// Somebody asks for no force.
    pub(super) disarm: bool,
}

/// Why the force went away, the gravest last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Cause {
    Silence,
    /// Silence after which a person arms.
    Outage,
    Request,
    Fault,
}

/// The way down: what was felt when it began.
#[derive(Clone, Copy, Debug)]
struct Fade {
    since: Duration,
    gain: f64,
}

/// The state machine. No allocation.
#[derive(Clone, Debug)]
pub(super) struct Arming {
    state: ArmingState,
    gain: f64,
    cause: Cause,
    fade: Fade,
    /// The port may arm by itself: as configured, until somebody disarms.
    automatic: bool,
    configured: bool,
    last: Option<Duration>,
    /// When commands were good last, while there was force.
    commanded: Option<Duration>,
    was_held: bool,
    /// Somebody asked for force on the way down, and has not taken it back.
    asked: bool,
    /// The commands come by another way since.
    asked_of_another: bool,
}

impl Arming {
    pub(super) fn new(settings: &SafetySettings) -> Self {
        Self {
            state: ArmingState::Disarmed,
            gain: 0.0,
            cause: Cause::Silence,
            fade: Fade {
                since: Duration::ZERO,
                gain: 0.0,
            },
            automatic: settings.rearm == Rearm::Automatic,
            configured: settings.rearm == Rearm::Automatic,
            last: None,
            commanded: None,
            was_held: false,
            asked: false,
            asked_of_another: false,
        }
    }

    pub(super) fn state(&self) -> ArmingState {
        self.state
    }

    pub(super) fn gain(&self) -> f64 {
        self.gain
    }

    /// Whether there is force, or will be without being asked for as soon as all is in order again.
    pub(super) fn gives(&self) -> bool {
        !self.state.is_off() && !self.cause_lasts()
    }

    /// Whether the wrench from before the fault goes on being felt, and no new one.
    pub(super) fn keeps_last_wrench(&self) -> bool {
        let on_the_way_down = matches!(self.state, ArmingState::Holding | ArmingState::Fading);
        on_the_way_down && self.cause == Cause::Fault
    }

    /// The commands come by another way from now on: what there was is gone, and new ones ramp in from zero, if nobody has to be asked.
    pub(super) fn restart(&mut self, source: CommandSource) {
        self.asked_of_another |= self.asked;
        if self.state.is_off() || self.cause_lasts() {
            return;
        }
        self.state = ArmingState::Fading;
        self.cause = match source {
            CommandSource::Other if !self.automatic => Cause::Outage,
            _ => Cause::Silence,
        };
        self.gain = 0.0;
        self.fade.gain = 0.0;
    }

    /// On the way down for a graver cause than silence.
    fn cause_lasts(&self) -> bool {
        let falling = matches!(self.state, ArmingState::Holding | ArmingState::Fading);
        falling && self.cause > Cause::Silence
    }

    /// One tick; tells at most two things.
    pub(super) fn step(
        &mut self,
        now: Duration,
        settings: &SafetySettings,
        situation: &Situation,
    ) -> [Option<EventKind>; 2] {
        // A clock that goes back passes no time, and a stall of the caller lets no force in at once.
        let passed = now.saturating_sub(self.last.unwrap_or(now));
        let stalled = std::mem::take(&mut self.asked_of_another) || passed > settings.hold;
        let passed = passed.min(settings.hold);
        self.last = Some(self.last.map_or(now, |last| last.max(now)));

        let mut events = [None; 2];
        let let_go = self.was_held && !situation.held;
        self.was_held = situation.held;
        if self.state.is_off() {
            events[0] = self.while_off(situation);
            return events;
        }
        if let_go {
            events[0] = Some(EventKind::DeadManReleased);
        } else if situation.disarm {
            events[0] = Some(EventKind::Disarmed);
        }
        self.watch_outage(now, situation);
        if self.follow_causes(now, settings, situation) {
            events[1] = Some(EventKind::Arming);
        }
        if self.cause_lasts() && self.keep_request(stalled, situation) {
            events[0] = events[0].or(Some(EventKind::ArmRefused));
        }
        match self.state {
            ArmingState::Arming => {
                self.gain = (self.gain + ratio(passed, settings.ramp_in)).min(1.0);
                if self.gain >= 1.0 {
                    self.state = ArmingState::Armed;
                    events[1] = Some(EventKind::Armed);
                }
            }
            ArmingState::Holding if self.cause == Cause::Fault && now >= self.fade.since => {
                self.state = ArmingState::Fading;
                events[1] = self.fall(now, settings);
            }
            ArmingState::Fading => events[1] = self.fall(now, settings),
            _ => {}
        }
        if self.state.is_off() && std::mem::take(&mut self.asked) {
            events[1] = self.while_off(&Situation {
                asked: true,
                ..*situation
            });
        }
        events
    }

    /// What is asked on the way down waits for its end, where the force may come again from zero: who presses the dead-man's button again holds it by
    /// then. Not longer: it is taken back by who lets go or disarms, and refused where a fault, a stall or another who commands comes in between. Whether
    /// it is refused.
    fn keep_request(&mut self, stalled: bool, situation: &Situation) -> bool {
        let asked = (self.asked || situation.asked) && !situation.disarm;
        let refused = stalled || situation.fault_since.is_some() || !situation.held;
        self.asked = asked && !refused;
        asked && refused
    }

    /// No force: whether it may come.
    fn while_off(&mut self, situation: &Situation) -> Option<EventKind> {
        let in_order = situation.fault_since.is_none()
            && situation.stale_since.is_none()
            && situation.commanded
            && situation.held;
        if situation.disarm {
            self.automatic = false;
            self.state = ArmingState::Disarmed;
            return Some(EventKind::Disarmed);
        }
        if !(situation.asked || self.automatic && !situation.paused) {
            return None;
        }
        if in_order {
            self.state = ArmingState::Arming;
            self.cause = Cause::Silence;
            self.gain = 0.0;
            self.automatic = self.configured;
            self.commanded = None;
            return Some(EventKind::Arming);
        }
        situation.asked.then_some(EventKind::ArmRefused)
    }

    /// Finds out whether a person has to be asked, because commands were missing for too long; be it that they are missing still, or that nobody
    /// called the port meanwhile.
    fn watch_outage(&mut self, now: Duration, situation: &Situation) {
        let silent = now.saturating_sub(*self.commanded.get_or_insert(now));
        if silent > OUTAGE && !self.automatic && !self.cause_lasts() {
            self.begin_fading(now);
            self.cause = Cause::Outage;
        }
        if situation.stale_since.is_none() {
            self.commanded = Some(now);
        }
    }

    /// Takes the gravest of what is wrong. Whether all is well again after the force had begun to fade.
    fn follow_causes(
        &mut self,
        now: Duration,
        settings: &SafetySettings,
        situation: &Situation,
    ) -> bool {
        let falling = matches!(self.state, ArmingState::Holding | ArmingState::Fading);
        let known = falling.then_some(self.cause);
        if let Some(since) = situation.fault_since {
            if known != Some(Cause::Fault) {
                self.cause = Cause::Fault;
                let since = since.saturating_add(settings.hold);
                if self.state == ArmingState::Fading {
                    self.begin_fading(since);
                } else {
                    self.state = ArmingState::Holding;
                    self.fade = Fade {
                        since,
                        gain: self.gain,
                    };
                }
            }
        } else if situation.disarm || !situation.held {
            if known.is_none_or(|cause| cause < Cause::Request) {
                self.cause = Cause::Request;
                self.begin_fading(now);
            }
        } else if let Some(since) = situation.stale_since.or(situation.paused.then_some(now)) {
            if known.is_none_or(|cause| cause == Cause::Silence) {
                self.cause = Cause::Silence;
                self.begin_fading(since);
            } else if self.state == ArmingState::Fading {
                self.begin_fading(since);
            }
        } else if situation.late {
            if !falling {
                self.state = ArmingState::Holding;
                self.cause = Cause::Silence;
            }
        } else if falling && self.cause == Cause::Silence {
            let faded = self.state == ArmingState::Fading;
            self.state = if self.gain < 1.0 {
                ArmingState::Arming
            } else {
                ArmingState::Armed
            };
            return faded;
        }
        if situation.disarm {
            // Who disarms wants to be asked.
            self.automatic = false;
        }
        false
    }

    /// Begins the way down, or has it begun earlier: what falls for a wish is gone no later than what falls for its age.
    fn begin_fading(&mut self, since: Duration) {
        if self.state == ArmingState::Fading {
            self.fade.since = self.fade.since.min(since);
        } else {
            self.state = ArmingState::Fading;
            self.fade = Fade {
                since,
                gain: self.gain,
            };
        }
    }

    /// Follows the way down; at its end nothing is left.
    fn fall(&mut self, now: Duration, settings: &SafetySettings) -> Option<EventKind> {
        let left = fade_share(now.saturating_sub(self.fade.since), settings.ramp_out);
        self.gain = self.gain.min(self.fade.gain * left);
        if self.gain > 0.0 {
            return None;
        }
        match self.cause {
            Cause::Fault => {
                self.state = ArmingState::Faulted;
                (!self.automatic).then_some(EventKind::RearmNeeded)
            }
            Cause::Request => {
                self.state = ArmingState::Disarmed;
                None
            }
            Cause::Outage => {
                self.state = ArmingState::Disarmed;
                Some(EventKind::RearmNeeded)
            }
            // Fresh inputs ramp it in again, whoever armed it before, unless they come too late.
            Cause::Silence => None,
        }
    }
}

/// Share of a force that is left when `passed` of a way down of `ramp_out` is over: 1 to 0.
pub(crate) fn fade_share(passed: Duration, ramp_out: Duration) -> f64 {
    (1.0 - ratio(passed, ramp_out)).max(0.0)
}

/// `part` over `whole`; one when `whole` is zero.
fn ratio(part: Duration, whole: Duration) -> f64 {
    if whole.is_zero() {
        1.0
    } else {
        part.as_secs_f64() / whole.as_secs_f64()
    }
}
