//! Loop 3, haptics: the hand's pose in, a safe wrench out, at the device's rate.
//!
//! Reads [`wrench_command`](crate::shared::wrench_command); writes [`device_state`](crate::shared::device_state) and wakes the
//! coupling. The wrench rendered at sample k answers sample k - 1: the loop never waits for the coupling. A tick neither
//! allocates nor waits.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use god_object::spatial::{Pose, Vector6};
use taut_bridge::{Device, EnergyObserver, Safety};
use taut_recording::{HapticsRecord, Tap};

use super::incidents::{Incident, IncidentCounts};
use super::shell::Waker;
use crate::shared::device_state::DeviceState;
use crate::shared::fanout::{Publisher, Subscriber};
use crate::shared::wrench_command::WrenchCommand;
use crate::timing::Histogram;

/// A constraint set may be this old before its age counts as age of the force. With the hold of 20 ms in
/// `taut_bridge::Safety` the force fades once the constraints are older than 100 ms (three updates of the slowest scene last 45 ms).
const CONSTRAINT_AGE_ALLOWED: Duration = Duration::from_millis(80);

/// Loop 3 with its device and its ends of the shared data.
pub struct HapticsLoop {
    device: Box<dyn Device>,
    safety: Safety,
    energy: EnergyObserver,
    wrench: Subscriber<WrenchCommand>,
    states: Publisher<DeviceState>,
    coupling: Waker,
    state: DeviceState,
    last_tick: Option<Duration>,
    recording: Option<Tap<HapticsRecord>>,
    statistics: Arc<HapticsStatistics>,
}

/// What loop 3 says about itself. One writer: the haptics thread.
#[derive(Debug, Default)]
pub struct HapticsStatistics {
    /// Time between the starts of two ticks.
    pub period: Histogram,
    /// Deadlines that passed without a tick in their period.
    pub deadline_misses: AtomicU64,
    /// Times at which the safety stage or a device fault changed the force.
    pub safety_events: AtomicU64,
    /// The same by kind, and the device's returns.
    pub incidents: IncidentCounts,
    /// Energy given to the hand beyond what it had put in, J, as the bits of an `f64`.
    energy_injected_bits: AtomicU64,
    /// The device does not answer now.
    pub device_faulty: AtomicBool,
}

impl HapticsStatistics {
    /// Energy given to the hand beyond what it had put in, J.
    pub fn energy_injected(&self) -> f64 {
        f64::from_bits(self.energy_injected_bits.load(Ordering::Relaxed))
    }
}

impl HapticsLoop {
    /// Puts a device, which stands at `start`, between its shared data.
    pub fn new(
        device: Box<dyn Device>,
        safety: Safety,
        energy: EnergyObserver,
        start: &Pose,
        wrench: Subscriber<WrenchCommand>,
        states: Publisher<DeviceState>,
        coupling: Waker,
    ) -> Self {
        Self {
            device,
            safety,
            energy,
            wrench,
            states,
            coupling,
            state: DeviceState::at_start(start),
            last_tick: None,
            recording: None,
            statistics: Arc::default(),
        }
    }

    /// The same, with every tick recorded.
    #[must_use]
    pub fn with_recording(mut self, tap: Option<Tap<HapticsRecord>>) -> Self {
        self.recording = tap;
        self
    }

    /// The counters that this loop writes.
    pub fn statistics(&self) -> Arc<HapticsStatistics> {
        self.statistics.clone()
    }

    /// One period: read, publish, wake the coupling, render the newest wrench.
    pub fn tick(&mut self, now: Duration) {
        if let Some(last) = self.last_tick.replace(now) {
            self.statistics.period.record_time(now.saturating_sub(last));
        }
        let trusted = self.read(now);
        self.states.publish(&self.state);
        self.coupling.wake();

        let wrench = if trusted {
            self.safe_wrench(now)
        } else {
            Vector6::zeros()
        };
        self.device.write(now, &wrench);
        self.energy.step(&self.state.pose, &wrench);
        self.statistics
            .energy_injected_bits
            .store(self.energy.injected().to_bits(), Ordering::Relaxed);
        if let Some(tap) = &mut self.recording {
            tap.push(HapticsRecord {
                sequence: self.state.sequence,
                time: self.state.time,
                pose: self.state.pose,
                velocity: self.state.velocity,
                buttons: self.state.buttons,
                faulty: self.state.faulty,
                wrench,
            });
        }
    }

    /// Leaves the device without force.
    pub fn release(&mut self, now: Duration) {
        self.safety.reset();
        self.device.write(now, &Vector6::zeros());
    }

    /// Reads the device into the state; false when it has no pose that may be trusted.
    fn read(&mut self, now: Duration) -> bool {
        let was_faulty = self.state.faulty;
        self.state.sequence += 1;
        match self.device.read(now) {
            Ok(sample) => {
                self.state.time = sample.time;
                self.state.pose = sample.pose;
                self.state.velocity = sample.velocity;
                self.state.buttons = sample.buttons;
                self.state.faulty = false;
                if was_faulty {
                    self.statistics.incidents.count(Incident::DeviceBack);
                }
            }
            Err(fault) => {
                // The last good pose stands; the force drops at once and ramps in when the device is back.
                self.state.velocity = Vector6::zeros();
                self.state.faulty = true;
                self.safety.reset();
                if !was_faulty {
                    self.count_event(Incident::from(&fault));
                }
            }
        }
        if was_faulty != self.state.faulty {
            self.statistics
                .device_faulty
                .store(self.state.faulty, Ordering::Relaxed);
        }
        !self.state.faulty
    }

    /// The newest wrench of the coupling after the safety stage.
    fn safe_wrench(&mut self, now: Duration) -> Vector6 {
        let command = *self.wrench.newest();
        let stale_constraints = command
            .constraint_age
            .saturating_sub(CONSTRAINT_AGE_ALLOWED);
        let made = command.time.saturating_sub(stale_constraints);
        let safe = self.safety.step(now, &command.wrench, made);
        if let Some(event) = &safe.event {
            self.count_event(Incident::from(event));
        }
        safe.wrench
    }

    fn count_event(&self, incident: Incident) {
        self.statistics.incidents.count(incident);
        let events = &self.statistics.safety_events;
        events.store(events.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
    }
}
