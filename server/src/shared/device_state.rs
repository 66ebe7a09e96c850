//! Haptics loop → god-object loop, coupling: where the hand is, and when that was.
//!
//! * Writer: the haptics loop, once per period (1 kHz).
//! * Readers: god-object loop, coupling, broadcast, monitor.
//! * Stale: the device has not answered since `time`. Loops go on with the last pose; the haptics loop alone decides
//!   when the force must fade.

use std::time::Duration;

use god_object::spatial::{Pose, Vector6};
use taut_bridge::{ArmingState, Felt, SafetyEvent, TickReport};

use super::fanout::{Publisher, Subscriber, fanout};

/// One sample of the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceState {
    /// Counts the readings; 0 is the pose at the start, before the device was read.
    pub sequence: u64,
    /// Identity of the device's sample: the `sequence` of the first reading that gave it. The same again is the same sample, read again.
    pub sample: u64,
    /// Session time at which the device was there.
    pub time: Duration,
    /// Session time at which the haptics loop read it, later than `time` by what the device and its way take.
    pub read: Duration,
    /// The device pose x_h, as the pose of the body's own frame.
    pub pose: Pose,
    /// Velocity of the reference point and angular velocity, m/s and rad/s, world axes.
    pub velocity: Vector6,
    /// Pressed buttons, one bit each.
    pub buttons: u16,
    /// The device does not answer; the pose is the last good one.
    pub faulty: bool,
    /// What the hand feels: as a bridge tells it, else what the port rendered last; `None` before the first tick.
    pub felt: Option<Felt>,
    /// What the port did in the tick before.
    pub safety: SafetyState,
}

/// Most recent events that a state carries: readers that miss a few states miss none.
pub const RECENT_EVENTS: usize = 8;

/// Where the device port stands and what it told last.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SafetyState {
    /// Where the port stands.
    pub arming: ArmingState,
    /// Whether there is force, or will be without being asked for as soon as all is in order again.
    pub gives: bool,
    /// The newest events, at their number modulo the length.
    pub events: [Option<SafetyEvent>; RECENT_EVENTS],
}

impl SafetyState {
    /// Takes over what a tick did.
    pub fn follow(&mut self, report: &TickReport) {
        self.arming = report.state;
        self.gives = report.gives;
        for event in report.events.iter() {
            self.events[event.number as usize % RECENT_EVENTS] = Some(*event);
        }
    }

    /// The events after the one of this number, oldest first.
    pub fn after(&self, number: u64) -> impl Iterator<Item = &SafetyEvent> {
        let newest = self.events.iter().flatten().map(|event| event.number).max();
        let newest = newest.unwrap_or(0);
        let oldest = (number + 1).max(newest.saturating_sub(RECENT_EVENTS as u64 - 1));
        (oldest..=newest).filter_map(|number| {
            let event = self.events[number as usize % RECENT_EVENTS].as_ref();
            event.filter(|event| event.number == number)
        })
    }
}

impl DeviceState {
    /// The device at rest at `pose`, before the first sample.
    pub fn at_start(pose: &Pose) -> Self {
        Self {
            sequence: 0,
            sample: 0,
            time: Duration::ZERO,
            read: Duration::ZERO,
            pose: *pose,
            velocity: Vector6::zeros(),
            buttons: 0,
            faulty: false,
            felt: None,
            safety: SafetyState::default(),
        }
    }
}

/// The arrow from the haptics loop, with so many readers.
pub fn channel<const READERS: usize>(
    start: &Pose,
) -> (Publisher<DeviceState>, [Subscriber<DeviceState>; READERS]) {
    fanout(&DeviceState::at_start(start))
}
