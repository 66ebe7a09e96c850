//! Loop 3, haptics: the hand's pose in, a safe wrench out, at the device's rate.
//!
//! Reads [`wrench_command`](crate::shared::wrench_command); writes [`device_state`](crate::shared::device_state) and wakes the
//! coupling. The wrench rendered at sample k answers sample k - 1: the loop never waits for the coupling. Everything passes the
//! [`DevicePort`]. A tick neither allocates nor waits.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use god_object::spatial::{Pose, Vector6, angular, linear};
use taut_bridge::{
    ArmSwitch, ArmWish, Command, Device, DevicePort, ExternalWrench, Felt, Reading, TickReport,
};
use taut_recording::{HapticsRecord, Tap};

use super::incidents::IncidentCounts;
use super::shell::Waker;
use crate::shared::atomic_f64::AtomicF64;
use crate::shared::device_state::DeviceState;
use crate::shared::fanout::{Publisher, Subscriber};
use crate::shared::felt_ticks::{FeltTick, FeltWriter};
use crate::shared::passed_wrench::PassedWriter;
use crate::shared::timing::Histogram;
use crate::shared::wrench_command::WrenchCommand;

/// Loop 3 with its device and its ends of the shared data.
pub struct HapticsLoop {
    port: DevicePort,
    wrench: Subscriber<WrenchCommand>,
    states: Publisher<DeviceState>,
    coupling: Waker,
    switch: Arc<ArmSwitch>,
    state: DeviceState,
    /// Time and pose of the device's newest sample.
    newest_sample: Option<(Duration, Pose)>,
    last_tick: Option<Duration>,
    /// CPU time of the coupling up to the command rendered last.
    coupling_cpu_time: Duration,
    recording: Option<Tap<HapticsRecord>>,
    /// A force from outside, where the workbench takes one.
    external: Option<Box<ExternalWrench>>,
    /// Who adds it instead, where the device is behind a bridge.
    passed: Option<PassedWriter>,
    felt: Option<FeltWriter>,
    statistics: Arc<HapticsStatistics>,
}

/// What loop 3 says about itself. One writer: the haptics thread.
#[derive(Debug, Default)]
pub struct HapticsStatistics {
    /// Time between the starts of two ticks.
    pub period: Histogram,
    /// Thread CPU time of a string-driven device's pose and tensions in one tick; empty for other devices.
    pub tension: Histogram,
    /// The same and that of the coupling in one cycle of this loop: of all forces between the command rendered last and the one rendered now.
    pub coupling_and_tension: Histogram,
    /// Time from the reading of a device sample to the rendering of the newest force that answers it.
    pub force_latency: Histogram,
    /// Time from a device sample to the rendering of the newest force whose constraint set answers it.
    pub constraint_latency: Histogram,
    /// Deadlines that passed without a tick in their period.
    pub deadline_misses: AtomicU64,
    /// Times at which the port changed the force or lost the device.
    pub safety_events: AtomicU64,
    /// All events of the port by kind.
    pub incidents: IncidentCounts,
    /// Energy given to the hand beyond what it had put in, J.
    pub energy_injected: AtomicF64,
    /// Net work that moving obstacles have done on the hand, J.
    pub obstacle_work: AtomicF64,
    /// Energy given to the hand beyond what it and the moving obstacles had put in, J: the coupling made it.
    pub energy_generated: AtomicF64,
    /// Norms of the force, N, and the torque, N m, that the hand feels now.
    felt: [AtomicF64; 2],
    /// Largest norm of a force that the hand felt since the start, N.
    pub largest_force: AtomicF64,
    /// The device does not answer now.
    pub device_faulty: AtomicBool,
}

impl HapticsStatistics {
    /// Takes what the hand feels from this tick on.
    fn count_felt(&self, felt: &Vector6) {
        let norms = [linear(felt).norm(), angular(felt).norm()];
        for (felt, norm) in self.felt.iter().zip(norms) {
            felt.store(norm);
        }
        let largest = self.largest_force.load().max(norms[0]); // NaN: as before
        self.largest_force.store(largest);
    }

    /// Norms of the force, N, and the torque, N m, that the hand feels now.
    pub fn felt(&self) -> [f64; 2] {
        self.felt.each_ref().map(AtomicF64::load)
    }
}

impl HapticsLoop {
    /// Puts the port of a device, which stands at `start`, between its shared data.
    pub fn new(
        port: DevicePort,
        start: &Pose,
        wrench: Subscriber<WrenchCommand>,
        states: Publisher<DeviceState>,
        coupling: Waker,
        switch: Arc<ArmSwitch>,
    ) -> Self {
        Self {
            port,
            wrench,
            states,
            coupling,
            switch,
            state: DeviceState::at_start(start),
            newest_sample: None,
            last_tick: None,
            coupling_cpu_time: Duration::ZERO,
            recording: None,
            external: None,
            passed: None,
            felt: None,
            statistics: Arc::default(),
        }
    }

    /// The same, armed by another switch.
    #[must_use]
    pub fn with_switch(mut self, switch: Arc<ArmSwitch>) -> Self {
        self.switch = switch;
        self
    }

    /// The same, with every tick recorded.
    #[must_use]
    pub fn with_recording(mut self, tap: Option<Tap<HapticsRecord>>) -> Self {
        self.recording = tap;
        self
    }

    /// The same with a force from outside beside the contact's.
    #[must_use]
    pub fn with_external(mut self, external: Option<ExternalWrench>) -> Self {
        self.external = external.map(Box::new);
        self
    }

    /// The same, whose force from outside is added by the bridge of the device and not here.
    #[must_use]
    pub(crate) fn with_passed(mut self, passed: Option<PassedWriter>) -> Self {
        self.passed = passed;
        self
    }

    /// The same, with every tick told to the monitor.
    #[must_use]
    pub fn with_felt(mut self, felt: FeltWriter) -> Self {
        self.felt = Some(felt);
        self
    }

    /// The counters that this loop writes.
    pub fn statistics(&self) -> Arc<HapticsStatistics> {
        self.statistics.clone()
    }

    /// What stands between this loop and the device.
    pub fn port(&self) -> &DevicePort {
        &self.port
    }

    /// The device alone, for another loop.
    pub fn into_device(self) -> Box<dyn Device> {
        self.port.into_device()
    }

    /// One period: read, publish, wake the coupling, render the newest wrench.
    pub fn tick(&mut self, now: Duration) {
        if let Some(last) = self.last_tick.replace(now) {
            self.statistics.period.record_time(now.saturating_sub(last));
        }
        match self.switch.take() {
            Some(ArmWish::Arm) => self.port.ask_to_arm(),
            Some(ArmWish::Disarm) => self.port.ask_to_disarm(),
            None => {}
        }
        let (state, states, wrench) = (&mut self.state, &mut self.states, &mut self.wrench);
        let (known, coupling) = (&mut self.newest_sample, &self.coupling);
        let has_motors = self.port.info().actuated_degrees_of_freedom > 0;
        let rendered = *self.port.rendered();
        let (external, passed) = (&mut self.external, &mut self.passed);
        let report = self.port.tick(now, |reading| {
            follow(state, known, reading, now);
            // Others are shown what the hand feels: not what the coupling asks for while the port leads the force down.
            state.felt = reading.felt.or(Some(Felt {
                wrench: rendered,
                at_edge: false,
                set_made: None,
            }));
            states.publish(state);
            coupling.wake();
            // Beside a bridge that couples by itself this force is rendered by nobody.
            let at_edge = reading.felt.is_some_and(|felt| felt.at_edge);
            let mut command = newest_command(wrench, has_motors && !at_edge);
            if let Some(external) = external {
                let added = external.tick(now, &state.pose);
                match passed {
                    None => command.external = added,
                    Some(passed) => passed.write(external.judged()),
                }
            }
            Some(command)
        });
        self.count(now, &report);
    }

    /// Lets the force come down without reading the device; whether it is zero. Call it once per period until it is.
    pub fn release_step(&mut self, now: Duration) -> bool {
        self.port.release_step(now)
    }

    /// Publishes the work of the obstacles on the hand, and the energy that neither hand nor obstacles account for.
    fn publish_obstacle_work(&self) {
        let given = self.port.energy().delivered();
        let work = self.wrench.held().obstacle_work;
        let statistics = &self.statistics;
        let generated = (given - work).max(statistics.energy_generated.load()); // NaN: as before
        statistics.obstacle_work.store(work);
        statistics.energy_generated.store(generated);
    }

    /// What the force that was rendered now cost, and how old it is.
    fn count_cycle(&mut self, now: Duration) {
        let statistics = &self.statistics;
        let command = self.wrench.held();
        let coupling = command.cpu_time.saturating_sub(self.coupling_cpu_time);
        self.coupling_cpu_time = command.cpu_time;
        // The pose at the start was not read: what answers it has no age.
        if command.sample_read > Duration::ZERO {
            let latency = now.saturating_sub(command.sample_read);
            statistics.force_latency.record_time(latency);
        }
        if command.constraint_sample > Duration::ZERO {
            let latency = now.saturating_sub(command.constraint_sample);
            statistics.constraint_latency.record_time(latency);
        }
        if let Some(tension) = self.port.computing_time() {
            statistics.tension.record_time(tension);
            statistics
                .coupling_and_tension
                .record_time(coupling + tension);
        }
    }

    fn count(&mut self, now: Duration, report: &TickReport) {
        self.count_cycle(now);
        let statistics = &self.statistics;
        for event in report.events.iter() {
            statistics.incidents.count(event);
            if event.kind.is_warning() {
                let events = &statistics.safety_events;
                events.store(events.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
            }
        }
        self.state.safety.follow(report);
        statistics
            .device_faulty
            .store(report.reading.fault.is_some(), Ordering::Relaxed);
        statistics
            .energy_injected
            .store(self.port.energy().injected());
        statistics.count_felt(&report.felt);
        self.publish_obstacle_work();
        if let Some(felt) = &mut self.felt {
            felt.push(FeltTick {
                wrench: report.felt,
                constraint_age: self.wrench.held().constraint_age,
            });
        }
        if let Some(tap) = &mut self.recording {
            tap.push(HapticsRecord {
                sequence: self.state.sequence,
                time: self.state.time,
                tick: self.state.read,
                pose: self.state.pose,
                velocity: self.state.velocity,
                buttons: self.state.buttons,
                faulty: self.state.faulty,
                wrench: report.felt,
            });
        }
    }
}

/// Takes the reading over into the state that is published.
fn follow(
    state: &mut DeviceState,
    known: &mut Option<(Duration, Pose)>,
    reading: &Reading,
    now: Duration,
) {
    state.sequence += 1;
    let sample = Some((reading.sample.time, reading.sample.pose));
    if std::mem::replace(known, sample) != sample {
        state.sample = state.sequence;
    }
    state.read = now;
    state.faulty = reading.fault.is_some();
    // The clock of a bridge is corrected while it runs, by less than the port allows: what is published does not run back by that.
    state.time = state.time.max(reading.sample.time);
    state.pose = reading.sample.pose;
    state.velocity = reading.sample.velocity;
    state.buttons = reading.sample.buttons;
}

/// The newest wrench of the coupling, as the port takes it. One that is felt is as old as the device sample that it was computed from.
fn newest_command(wrench: &mut Subscriber<WrenchCommand>, is_felt: bool) -> Command {
    let command = wrench.newest();
    let origin = if is_felt {
        command.sample_time.min(command.time)
    } else {
        command.time
    };
    let constraints = command.time.saturating_sub(command.constraint_age);
    Command {
        constraint_age: origin.saturating_sub(constraints),
        obstacle_work: command.obstacle_work,
        ..Command::fresh(origin, command.wrench)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::{device_state, wrench_command};
    use god_object::nalgebra::Point3;
    use god_object::spatial::Vector6;
    use taut_bridge::{Device, DeviceFault, DeviceInfo, DeviceSample, SafetySettings};
    use taut_link::Distribution;

    const TENSIONS: Duration = Duration::from_micros(40);

    /// Strings whose arithmetic takes the same time in every tick.
    struct Strings(DeviceInfo);

    impl Device for Strings {
        fn info(&self) -> &DeviceInfo {
            &self.0
        }

        fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
            Ok(DeviceSample {
                time: now,
                pose: Pose::identity(),
                velocity: Vector6::zeros(),
                buttons: 0,
            })
        }

        fn write(&mut self, _now: Duration, _wrench: &Vector6) {}

        fn computing_time(&self) -> Option<Duration> {
            Some(TENSIONS)
        }
    }

    #[test]
    fn time_as_published_does_not_run_back_with_a_bridge_whose_clock_is_corrected() {
        let mut state = DeviceState::at_start(&Pose::identity());
        let (mut times, mut samples, mut known) = (Vec::new(), Vec::new(), None);
        for ms in [10, 12, 12, 11, 13] {
            let reading = Reading {
                sample: DeviceSample {
                    time: Duration::from_millis(ms),
                    pose: Pose::identity(),
                    velocity: Vector6::zeros(),
                    buttons: 0,
                },
                fault: None,
                felt: None,
            };
            follow(&mut state, &mut known, &reading, Duration::from_millis(20));
            times.push(state.time.as_millis());
            samples.push(state.sample);
        }
        assert_eq!(times, [10, 12, 12, 12, 13]);
        assert_eq!(state.sequence, 5);
        assert_eq!(
            samples,
            [1, 2, 2, 4, 5],
            "the third is the second, read again"
        );
    }

    #[test]
    fn a_cycle_costs_its_tensions_and_every_force_since_the_cycle_before() {
        let device = Strings(DeviceInfo::ideal("strings", 6));
        let start = Pose::identity();
        let (mut commands, [newest]) = wrench_command::channel();
        let (states, []) = device_state::channel(&start);
        let mut haptics = HapticsLoop::new(
            DevicePort::new(
                Box::new(device),
                SafetySettings::default(),
                Point3::origin(),
                &start,
            ),
            &start,
            newest,
            states,
            Waker::default(),
            Arc::default(),
        );
        let ms = Duration::from_millis;
        // The forces up to each tick, CPU time in all, us, and when the sample was read that the newest answers, ms.
        let cycles: [(&[u64], u64); 5] = [
            (&[], 0),      // no force yet
            (&[2], 0),     // one that answers the pose at the start, which nobody read
            (&[5], 2),     // one
            (&[7, 14], 3), // of a sample and of a constraint set
            (&[], 3),      // the coupling came too late: the same force again
        ];
        let mut costs = Vec::new();
        let mut sequence = 0;
        for (tick, (forces, read)) in (1..).zip(cycles) {
            for cpu_us in forces {
                sequence += 1;
                commands.publish(&WrenchCommand {
                    sequence,
                    time: ms(read),
                    sample_read: ms(read),
                    sample_time: ms(read),
                    constraint_sample: ms(read / 2),
                    cpu_time: Duration::from_micros(*cpu_us),
                    ..WrenchCommand::at_start()
                });
            }
            haptics.tick(ms(tick));
            costs.push(haptics.statistics.coupling_and_tension.newest_time());
        }
        let us = |us| TENSIONS + Duration::from_micros(us);
        assert_eq!(costs, [us(0), us(2), us(3), us(9), us(0)]);
        // Answers to the samples read at 2, 3 and 3 ms, rendered at 3, 4 and 5 ms.
        let Distribution {
            p50, max, count, ..
        } = haptics.statistics.force_latency.distribution_us();
        assert_eq!((max, count), (2000.0, 3));
        assert!((p50 / 1000.0 - 1.0).abs() < 0.016, "{p50}");
        // Constraints for the sample at 1 ms: in the forces that were rendered at 3, 4 and 5 ms.
        let constraints = haptics.statistics.constraint_latency.distribution_us();
        assert_eq!((constraints.max, constraints.count), (4000.0, 3));
    }
}
