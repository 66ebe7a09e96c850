//! What the port tells: typed events, each with its time, its cause and one number.
//!
//! An event is told when something begins, not on every tick that it lasts.

use std::fmt;
use std::time::Duration;

use crate::device::DeviceFault;

/// Most events of one tick; more are counted and dropped.
const MAX_EVENTS_PER_TICK: usize = 8;

/// What happened at the port. The number that goes with it has the unit that [`EventKind::unit`] says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum EventKind {
    /// The force begins to ramp in.
    Arming,
    /// The force is there in full.
    Armed,
    /// Somebody asked for no force.
    Disarmed,
    /// The dead-man's button was let go.
    DeadManReleased,
    /// Somebody asked for force, but the inputs are not in order.
    ArmRefused,
    /// The force is zero after a fault and stays so until somebody arms again.
    RearmNeeded,
    /// No new force for longer than the hold: it fades. Age of the newest, s.
    ForceStale,
    /// The constraints are older than their limit: the force fades. Their age, s.
    ConstraintsStale,
    /// The command lies ahead of the clock and is not taken. By how much, s.
    CommandNotOnClock,
    /// The commanded wrench is not finite.
    WrenchNotFinite,
    /// The norm of the force was limited. Norm that was asked for, N.
    ForceLimited,
    /// The norm of the torque was limited. Norm that was asked for, N m.
    TorqueLimited,
    /// The change of the force was limited. Change per tick that was asked for, N.
    ForceSlewLimited,
    /// The change of the torque was limited. Change per tick that was asked for, N m.
    TorqueSlewLimited,
    /// The port itself was not called for longer than the hold. The gap, s.
    PortStalled,
    /// The passivity controller begins to damp. Energy that it has to take out, J.
    PassivityActs,
    /// No sample of the device has ever come.
    DeviceNotStarted,
    /// The device's samples stopped. Age of the last one, s.
    DeviceLost,
    /// The device sent what is no pose.
    DeviceNotFinite,
    /// The device's time stamps are not on this clock.
    DeviceNotOnClock,
    /// The device says that it is faulty.
    DeviceReportedFault,
    /// The device's bridge was replaced.
    DeviceReconnected,
    /// The recorded trace ended.
    DeviceEnded,
    /// The device jumped faster than a hand moves. Its speed, m/s.
    DeviceTeleported,
    /// The device turned faster than a hand turns. Its rate, rad/s.
    DeviceSpun,
    /// The device stopped dead out of a movement and stays there to the bit. Since when, s.
    DeviceFrozen,
    /// The device's time stamps went back. By how much, s.
    DeviceTimeWentBack,
    /// The device gives good samples again.
    DeviceBack,
    /// A string-driven device has no pose that may be trusted: strings, encoders or grip. Number of the string, from 1; 0 where
    /// none is to blame alone.
    DeviceStrings,
}

impl EventKind {
    /// All kinds, each at the place that its number says.
    pub const ALL: [Self; 29] = [
        Self::Arming,
        Self::Armed,
        Self::Disarmed,
        Self::DeadManReleased,
        Self::ArmRefused,
        Self::RearmNeeded,
        Self::ForceStale,
        Self::ConstraintsStale,
        Self::CommandNotOnClock,
        Self::WrenchNotFinite,
        Self::ForceLimited,
        Self::TorqueLimited,
        Self::ForceSlewLimited,
        Self::TorqueSlewLimited,
        Self::PortStalled,
        Self::PassivityActs,
        Self::DeviceNotStarted,
        Self::DeviceLost,
        Self::DeviceNotFinite,
        Self::DeviceNotOnClock,
        Self::DeviceReportedFault,
        Self::DeviceReconnected,
        Self::DeviceEnded,
        Self::DeviceTeleported,
        Self::DeviceSpun,
        Self::DeviceFrozen,
        Self::DeviceTimeWentBack,
        Self::DeviceBack,
        Self::DeviceStrings,
    ];

    /// The kind of this number, as on the wire.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// What happened, for people.
    #[must_use]
    pub fn sentence(self) -> &'static str {
        match self {
            Self::Arming => "safety: the force ramps in",
            Self::Armed => "safety: armed, the force is there in full",
            Self::Disarmed => "safety: disarmed, the force fades",
            Self::DeadManReleased => "safety: the dead-man's button was let go, the force fades",
            Self::ArmRefused => {
                "safety: not armed, because the device or the forces are not in order yet"
            }
            Self::RearmNeeded => "safety: no force until somebody arms again",
            Self::ForceStale => "safety: no new force comes, the last one fades",
            Self::ConstraintsStale => "safety: the constraints are too old, the force fades",
            Self::CommandNotOnClock => {
                "safety: the computed force is ahead of the clock and not taken"
            }
            Self::WrenchNotFinite => "safety: the computed force is not finite and not taken",
            Self::ForceLimited => "safety: the force is limited",
            Self::TorqueLimited => "safety: the torque is limited",
            Self::ForceSlewLimited => "safety: the change of the force is limited",
            Self::TorqueSlewLimited => "safety: the change of the torque is limited",
            Self::PortStalled => "safety: the device loop itself stalled",
            Self::PassivityActs => "safety: the loop gives out energy, damping takes it out",
            Self::DeviceNotStarted => "device: no sample has come yet, there is no force",
            Self::DeviceLost => "device: lost, the force fades",
            Self::DeviceNotFinite => "device: its pose is not finite, the force fades",
            Self::DeviceNotOnClock => {
                "device: its time stamps are not on this clock, the force fades"
            }
            Self::DeviceReportedFault => {
                "device: it reports a fault at the far end, the force fades"
            }
            Self::DeviceReconnected => "device: its bridge has just reconnected, the force fades",
            Self::DeviceEnded => "device: the recorded trace ended, the force fades",
            Self::DeviceTeleported => "device: it jumped faster than a hand moves, the force fades",
            Self::DeviceSpun => "device: it turned faster than a hand turns, the force fades",
            Self::DeviceFrozen => "device: it froze in the middle of a movement, the force fades",
            Self::DeviceTimeWentBack => "device: its time stamps went back, the force fades",
            Self::DeviceBack => "device: good samples come",
            Self::DeviceStrings => {
                "device: its strings or encoders give no pose to be trusted, the force fades"
            }
        }
    }

    /// Unit of the number; empty where there is none.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::ForceStale
            | Self::ConstraintsStale
            | Self::CommandNotOnClock
            | Self::PortStalled
            | Self::DeviceLost
            | Self::DeviceFrozen
            | Self::DeviceTimeWentBack => "s",
            Self::ForceLimited | Self::ForceSlewLimited => "N",
            Self::TorqueLimited | Self::TorqueSlewLimited => "N m",
            Self::PassivityActs => "J",
            Self::DeviceTeleported => "m/s",
            Self::DeviceSpun => "rad/s",
            Self::DeviceStrings => "string",
            _ => "",
        }
    }

    /// Whether it is worth a warning, and counts in reports: it is no part of normal work.
    #[must_use]
    pub fn is_warning(self) -> bool {
        !matches!(
            self,
            Self::Arming
                | Self::Armed
                | Self::Disarmed
                | Self::DeadManReleased
                | Self::DeviceBack
                | Self::DeviceNotStarted // whoever is to join has not yet
                | Self::PassivityActs // as it does in any contact, where it is on
                // A body that slips off an edge lets go of its force at once; the limit makes a ramp of that, as it is there to do.
                | Self::ForceSlewLimited
                | Self::TorqueSlewLimited
        )
    }

    /// Whether it is a fault: of the device's samples once they come, or of the computed wrench.
    #[must_use]
    pub fn is_fault(self) -> bool {
        let of_device = self as u8 > Self::DeviceNotStarted as u8;
        (of_device && self != Self::DeviceBack) || self == Self::WrenchNotFinite
    }
}

/// One event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyEvent {
    /// Counts the events of a port from 1.
    pub number: u64,
    /// When, on the clock of the port's ticks.
    pub time: Duration,
    /// What happened.
    pub kind: EventKind,
    /// How much, in the unit of [`EventKind::unit`]; 0 where there is none.
    pub value: f64,
}

impl fmt::Display for SafetyEvent {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}", self.kind.sentence())?;
        match self.kind.unit() {
            "" => Ok(()),
            "string" if self.value == 0.0 => Ok(()),
            "string" => write!(out, " (string {:.0})", self.value),
            unit => write!(out, " ({:.3} {unit})", self.value),
        }
    }
}

/// What a fault of the device is as an event: its kind and its number.
pub(super) fn kind_of_fault(fault: &DeviceFault) -> (EventKind, f64) {
    match fault {
        DeviceFault::NotStarted => (EventKind::DeviceNotStarted, 0.0),
        DeviceFault::Lost { age } => (EventKind::DeviceLost, age.as_secs_f64()),
        DeviceFault::NotFinite => (EventKind::DeviceNotFinite, 0.0),
        DeviceFault::TimeNotOnClock => (EventKind::DeviceNotOnClock, 0.0),
        DeviceFault::ReportedFault => (EventKind::DeviceReportedFault, 0.0),
        DeviceFault::Strings(fault) => {
            let string = fault.string().map_or(0.0, |string| (string + 1) as f64);
            (EventKind::DeviceStrings, string)
        }
        DeviceFault::Reconnected => (EventKind::DeviceReconnected, 0.0),
        DeviceFault::Ended => (EventKind::DeviceEnded, 0.0),
        DeviceFault::Teleported { speed } => (EventKind::DeviceTeleported, *speed),
        DeviceFault::SpunTooFast { rate } => (EventKind::DeviceSpun, *rate),
        DeviceFault::Frozen { time } => (EventKind::DeviceFrozen, time.as_secs_f64()),
        DeviceFault::TimeWentBack { by } => (EventKind::DeviceTimeWentBack, by.as_secs_f64()),
    }
}

/// The events of one tick, at most `MAX_EVENTS_PER_TICK`. No allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Events {
    list: [Option<SafetyEvent>; MAX_EVENTS_PER_TICK],
    len: usize,
}

impl Events {
    /// In the order in which they happened.
    pub fn iter(&self) -> impl Iterator<Item = &SafetyEvent> {
        self.list.iter().flatten()
    }

    /// Whether nothing happened.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(super) fn push(&mut self, event: SafetyEvent) {
        if let Some(place) = self.list.get_mut(self.len) {
            *place = Some(event);
            self.len += 1;
        }
    }
}

/// Numbers events and keeps those of this tick. No allocation.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TickEvents {
    now: Duration,
    count: u64,
    events: Events,
}

impl TickEvents {
    pub(super) fn begin_tick(&mut self, now: Duration) {
        self.now = now;
        self.events = Events::default();
    }

    pub(super) fn tell(&mut self, kind: EventKind, value: f64) {
        self.count += 1;
        self.events.push(SafetyEvent {
            number: self.count,
            time: self.now,
            kind,
            value,
        });
    }

    pub(super) fn events(&self) -> &Events {
        &self.events
    }
}

/// Something that comes and goes: it begins with its first tick, and is over once it has been gone for [`EdgeDetector::QUIET`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EdgeDetector {
    last: Option<Duration>,
}

impl EdgeDetector {
    /// After a shorter gap it goes on: a limit that chatters is told once.
    const QUIET: Duration = Duration::from_millis(100);

    /// Whether one begins with this tick.
    pub(crate) fn begins(&mut self, now: Duration, is_on: bool) -> bool {
        if !is_on {
            return false;
        }
        let last = self.last.replace(now);
        last.is_none_or(|last| now.saturating_sub(last) > Self::QUIET)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_stands_at_the_place_of_its_number() {
        for (place, kind) in EventKind::ALL.into_iter().enumerate() {
            assert_eq!(place, kind as usize);
            assert_eq!(EventKind::from_number(kind as u8), Some(kind));
        }
        assert_eq!(EventKind::from_number(EventKind::ALL.len() as u8), None);
    }

    #[test]
    fn each_fault_is_a_warning_and_what_a_contact_does_is_none() {
        for kind in EventKind::ALL.into_iter().filter(|kind| kind.is_fault()) {
            assert!(kind.is_warning(), "{kind:?}");
        }
        let in_contact = [
            EventKind::ForceSlewLimited,
            EventKind::TorqueSlewLimited,
            EventKind::PassivityActs,
        ];
        assert!(!in_contact.into_iter().any(EventKind::is_warning));
        // A server whose bridge joins later.
        let waits = EventKind::DeviceNotStarted;
        assert!(!waits.is_fault() && !waits.is_warning());
    }

    #[test]
    fn a_string_fault_is_its_own_kind_and_names_the_string() {
        use taut_spidar::StringFault;
        let kind_of = |fault| {
            let (kind, value) = kind_of_fault(&DeviceFault::Strings(fault));
            assert_eq!(kind, EventKind::DeviceStrings);
            assert!(kind.is_fault() && kind.is_warning());
            let event = SafetyEvent {
                number: 1,
                time: Duration::ZERO,
                kind,
                value,
            };
            event.to_string()
        };
        let slack = kind_of(StringFault::Slack {
            string: 4,
            tension: 0.01,
        });
        assert!(slack.ends_with("the force fades (string 5)"), "{slack}");
        let nobody = kind_of(StringFault::NotConverged);
        assert!(nobody.ends_with("the force fades"), "{nobody}");
        assert!(!slack.contains("far end"));
        let far = kind_of_fault(&DeviceFault::ReportedFault);
        assert_eq!(far, (EventKind::DeviceReportedFault, 0.0));
    }

    #[test]
    fn a_tick_keeps_its_first_events_and_drops_the_rest() {
        let mut events = Events::default();
        for number in 1..=20 {
            events.push(SafetyEvent {
                number,
                time: Duration::ZERO,
                kind: EventKind::Arming,
                value: 0.0,
            });
        }
        let kept: Vec<u64> = events.iter().map(|event| event.number).collect();
        assert_eq!(kept, [1, 2, 3, 4, 5, 6, 7, 8]);
    }

    #[test]
    fn a_limit_that_chatters_is_told_once() {
        let mut edges = EdgeDetector::default();
        let begun: Vec<u64> = (0..500)
            .filter(|ms| edges.begins(Duration::from_millis(*ms), *ms < 200 && ms % 3 == 0))
            .collect();
        assert_eq!(begun, [0]);
        assert!(edges.begins(Duration::from_millis(500), true));
    }
}
