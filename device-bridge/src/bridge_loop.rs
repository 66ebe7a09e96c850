//! One tick of the bridge: newest wrench in, through the port to the device, newest pose out.
//!
//! No sockets, threads or clocks: times are arguments, so a tick runs in real time and under a virtual clock.
//! No allocation after `new`.

use std::time::Duration;

use nalgebra::Vector6;
use taut_link::proto::constraints::ConstraintSet;
use taut_link::proto::input::{INPUT_AT_EDGE, INPUT_FAULT};
use taut_link::proto::wrench::WRENCH_PAUSED;
use taut_link::proto::{InputSample, PoseF64, WrenchCommand};

use crate::device::DeviceFault;
use crate::edge::EdgeCoupler;
use crate::port::{Command, CommandSource, DevicePort, Events};
use crate::report::Durations;

/// How many ticks a round trip may take to be measured: 1 s at 1 kHz.
const REMEMBERED_TICKS: usize = 1024;

/// A command and when it arrived here.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    pub(crate) command: WrenchCommand,
    pub(crate) received: Duration,
}

/// What one tick gives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TickOutput {
    /// To be sent.
    pub(crate) input: InputSample,
    /// To be told.
    pub(crate) events: Events,
}

/// What the ticks have seen.
pub(crate) struct TickStats {
    pub(crate) ticks: u64,
    pub(crate) wrenches: u64,
    /// Constraint sets taken, and those that were none.
    pub(crate) sets: u64,
    pub(crate) broken_sets: u64,
    /// Session time now minus that of the set's making, at its first use.
    pub(crate) set_age: Durations,
    pub(crate) safety_events: u64,
    pub(crate) faulty_ticks: u64,
    /// Session time now minus session time of the command, at arrival.
    pub(crate) wrench_age: Durations,
    /// From reading the device to holding the wrench that answers it.
    pub(crate) round_trip: Durations,
    /// Longest that a force outlived what it came from.
    pub(crate) max_force_age: Duration,
    pub(crate) max_force: f64,
    pub(crate) max_torque: f64,
}

/// The device side of a session.
pub(crate) struct BridgeLoop {
    port: DevicePort,
    stats: TickStats,
    /// Number of the next reading; the first is 1, because 0 answers none.
    next_index: u64,
    /// When reading i was taken, at i modulo the length.
    sent: [Duration; REMEMBERED_TICKS],
    newest: Option<Arrival>,
    /// When what the force comes from last arrived in this session: a command, or a constraint set.
    heard: Option<Duration>,
    /// The coupling, where it is here and not at the server.
    edge: Option<Box<EdgeCoupler>>,
}

impl BridgeLoop {
    pub(crate) fn new(port: DevicePort) -> Self {
        Self {
            port,
            stats: TickStats {
                ticks: 0,
                wrenches: 0,
                sets: 0,
                broken_sets: 0,
                set_age: Durations::new(),
                safety_events: 0,
                faulty_ticks: 0,
                wrench_age: Durations::new(),
                round_trip: Durations::new(),
                max_force_age: Duration::ZERO,
                max_force: 0.0,
                max_torque: 0.0,
            },
            next_index: 1,
            sent: [Duration::ZERO; REMEMBERED_TICKS],
            newest: None,
            heard: None,
            edge: None,
        }
    }

    /// What stands between this loop and the device.
    pub(crate) fn port(&self) -> &DevicePort {
        &self.port
    }

    pub(crate) fn port_mut(&mut self) -> &mut DevicePort {
        &mut self.port
    }

    pub(crate) fn stats(&self) -> &TickStats {
        &self.stats
    }

    /// The fault that the device is in.
    pub(crate) fn fault(&self) -> Option<DeviceFault> {
        self.port.fault()
    }

    /// Forgets the last session: no force until a command or a constraint set of the new one, which ramps in. With `edge` the force
    /// is computed here.
    pub(crate) fn begin_session(&mut self, source: CommandSource, edge: Option<EdgeCoupler>) {
        self.newest = None;
        self.heard = None;
        self.edge = edge.map(Box::new);
        self.port.restart(source);
    }

    /// Whether constraint sets are wanted.
    pub(crate) fn couples(&self) -> bool {
        self.edge.is_some()
    }

    /// Takes the newest constraint set, that was completed or confirmed at `received`; once or again. `session_ns` is
    /// session time, 0 while unknown.
    pub(crate) fn take_set(&mut self, set: &ConstraintSet, received: Duration, session_ns: u64) {
        let Some(edge) = &mut self.edge else {
            return;
        };
        self.heard = self.heard.max(Some(received));
        let new = edge.sequence() != Some(set.head.sequence);
        match edge.take(set, received) {
            Ok(()) if new => {
                self.stats.sets += 1;
                if session_ns > 0 {
                    let age = session_ns.saturating_sub(set.head.made_ns);
                    self.stats.set_age.record(Duration::from_nanos(age));
                }
            }
            Ok(()) => {}
            Err(_) => self.stats.broken_sets += 1,
        }
    }

    /// One tick at `now`. `session_ns` is session time, 0 while unknown; `arrival` is the newest command,
    /// again and again until there is a newer one.
    pub(crate) fn tick(
        &mut self,
        now: Duration,
        session_ns: u64,
        arrival: Option<Arrival>,
    ) -> TickOutput {
        self.stats.ticks += 1;
        self.adopt(now, session_ns, arrival);

        let index = self.next_index;
        self.next_index += 1;
        self.sent[index as usize % REMEMBERED_TICKS] = now;
        let (newest, edge) = (self.newest, &mut self.edge);
        let report = self.port.tick(now, |reading| match edge {
            Some(edge) => edge
                .step(now, &reading.sample.pose)
                .map(|felt| Command::fresh(felt.received, felt.wrench)),
            None => newest.map(|arrival| command(&arrival)),
        });

        let wrench = &report.wrench;
        self.stats.max_force = self.stats.max_force.max(wrench.fixed_rows::<3>(0).norm());
        self.stats.max_torque = self.stats.max_torque.max(wrench.fixed_rows::<3>(3).norm());
        if let Some(heard) = self.heard
            && *wrench != Vector6::zeros()
        {
            let age = now.saturating_sub(heard);
            self.stats.max_force_age = self.stats.max_force_age.max(age);
        }
        self.stats.safety_events += report
            .events
            .iter()
            .filter(|event| !event.kind.is_good_news())
            .count() as u64;
        let reading = &report.reading;
        self.stats.faulty_ticks += u64::from(reading.fault.is_some());
        let sample = &reading.sample;
        let age = match reading.fault {
            None => now.saturating_sub(sample.time).as_nanos() as u64,
            Some(_) => 0,
        };
        let faulty = reading.fault.map_or(0, |_| INPUT_FAULT);
        let at_edge = self.edge.as_ref().map_or(0, |_| INPUT_AT_EDGE);
        TickOutput {
            input: InputSample {
                sample_time_ns: session_ns.saturating_sub(age),
                index,
                pose: PoseF64::from_isometry(&sample.pose),
                velocity: sample.velocity.into(),
                buttons: sample.buttons,
                flags: faulty | at_edge,
                rendered: report.wrench.into(),
                set_sequence: self
                    .edge
                    .as_ref()
                    .and_then(|edge| edge.sequence())
                    .unwrap_or(0),
            },
            events: report.events,
        }
    }

    /// Takes a command that is newer than the last one.
    fn adopt(&mut self, now: Duration, session_ns: u64, arrival: Option<Arrival>) {
        let known = self.newest.map(|newest| newest.command.time_ns);
        let Some(arrival) = arrival.filter(|arrival| Some(arrival.command.time_ns) > known) else {
            return;
        };
        self.newest = Some(arrival);
        if self.edge.is_none() {
            self.heard = self.heard.max(Some(arrival.received));
        }
        self.stats.wrenches += 1;
        if session_ns > 0 {
            let age = session_ns.saturating_sub(arrival.command.time_ns);
            self.stats.wrench_age.record(Duration::from_nanos(age));
        }
        let answered = arrival.command.input_index;
        let remembered = answered > 0
            && answered < self.next_index
            && self.next_index - answered < REMEMBERED_TICKS as u64;
        if remembered {
            let taken = self.sent[answered as usize % REMEMBERED_TICKS];
            self.stats.round_trip.record(now.saturating_sub(taken));
        }
    }
}

/// The command that arrived, for the port.
fn command(arrival: &Arrival) -> Command {
    let wrench = if arrival.command.flags & WRENCH_PAUSED == 0 {
        Vector6::from(arrival.command.wrench)
    } else {
        Vector6::zeros()
    };
    Command::fresh(arrival.received, wrench)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Device, Pose};
    use crate::devices::{
        AtEnd, Grip, Hand, MinJerkPath, RecordedDevice, SimulatedDevice, TraceRow,
    };
    use crate::port::{EventKind, SafetySettings};
    use nalgebra::Point3;

    fn ms(time: u64) -> Duration {
        Duration::from_millis(time)
    }

    fn bridge(device: impl Device + 'static) -> BridgeLoop {
        BridgeLoop::new(DevicePort::new(
            Box::new(device),
            SafetySettings::default(),
            Point3::origin(),
            &Pose::identity(),
        ))
    }

    fn simulated() -> SimulatedDevice {
        let path = MinJerkPath::hold(Pose::translation(0.1, 0.0, 0.0));
        SimulatedDevice::new(Grip::workbench(), Hand::LIGHT, path, Point3::origin())
    }

    fn push(time_ms: u64, newtons: f64, input_index: u64) -> Arrival {
        Arrival {
            command: WrenchCommand {
                time_ns: time_ms * 1_000_000,
                input_index,
                wrench: [0.0, 0.0, newtons, 0.0, 0.0, 0.0],
                flags: 0,
            },
            received: ms(time_ms),
        }
    }

    #[test]
    fn a_wrench_from_the_far_end_moves_the_hand_and_its_pose_goes_back() {
        let mut bridge = bridge(simulated());
        let mut z = 0.0;
        for tick in 1..2000 {
            let arrival = push(tick, 2.0, tick.saturating_sub(3));
            let output = bridge.tick(ms(tick), tick * 1_000_000, Some(arrival));
            assert_eq!((output.input.index, output.input.flags), (tick, 0));
            z = output.input.pose.position[2];
        }
        assert!((z - 2.0 / Hand::LIGHT.stiffness).abs() < 1e-3, "{z} m");
        assert_eq!(bridge.stats().wrenches, 1999);
        // The histogram keeps three digits.
        let round_trip = bridge.stats().round_trip.summary().expect("measured");
        assert!(round_trip.p50.abs_diff(3000) <= 3, "{} us", round_trip.p50);
        assert!((bridge.stats().max_force - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_server_that_falls_silent_is_felt_no_longer_than_120_ms() {
        let mut bridge = bridge(simulated());
        for tick in 1..=1000 {
            let _ = bridge.tick(ms(tick), 0, Some(push(tick, 5.0, 0)));
        }
        let mut told = Vec::new();
        for tick in 1001..=1300 {
            let output = bridge.tick(ms(tick), 0, Some(push(1000, 5.0, 0)));
            told.extend(output.events.iter().copied());
            let felt = bridge.port().rendered().norm();
            // 5 ms before the promise: the margin for a loop that is late.
            assert_eq!(felt == 0.0, tick >= 1115, "{felt} N at {tick} ms");
        }
        let told: Vec<_> = told.iter().map(|e| (e.kind, e.time, e.value)).collect();
        assert_eq!(told, [(EventKind::ForceStale, ms(1021), 0.021)]);
    }

    #[test]
    fn the_same_command_sent_again_is_no_new_one() {
        let mut bridge = bridge(simulated());
        for tick in 1..=1000 {
            let _ = bridge.tick(ms(tick), 0, Some(push(tick, 5.0, 0)));
        }
        for tick in 1001..=1200 {
            let repeated = Arrival {
                received: ms(tick),
                ..push(1000, 5.0, 0)
            };
            let _ = bridge.tick(ms(tick), 0, Some(repeated));
        }
        assert_eq!(*bridge.port().rendered(), Vector6::zeros());
        assert_eq!(bridge.stats().wrenches, 1000);
    }

    #[test]
    fn a_paused_server_gives_no_force() {
        let mut bridge = bridge(simulated());
        for tick in 1..=1000 {
            let mut arrival = push(tick, 5.0, 0);
            arrival.command.flags = WRENCH_PAUSED;
            let _ = bridge.tick(ms(tick), 0, Some(arrival));
        }
        assert_eq!(bridge.stats().max_force, 0.0);
        assert_eq!(bridge.stats().wrenches, 1000);
    }

    #[test]
    fn a_faulty_device_is_told_once_and_flagged_on_every_reading() {
        let row = |time_s| TraceRow {
            time_s,
            pose: Pose::translation(0.0, 0.0, time_s),
            buttons: 0,
        };
        let trace = vec![row(0.0), row(0.01)];
        let device = RecordedDevice::new(trace, AtEnd::Fault, Point3::origin());
        let mut bridge = bridge(device.expect("a valid trace"));
        let outputs: Vec<_> = (0..20).map(|tick| bridge.tick(ms(tick), 0, None)).collect();
        assert!(outputs[..11].iter().all(|output| output.input.flags == 0));
        assert!(
            outputs[11..]
                .iter()
                .all(|output| output.input.flags == INPUT_FAULT)
        );
        let told: Vec<_> = outputs
            .iter()
            .flat_map(|output| output.events.iter().map(|event| event.kind))
            .collect();
        assert_eq!(told, [EventKind::DeviceEnded]);
        assert_eq!(bridge.fault(), Some(DeviceFault::Ended));
        // The last good pose goes on being sent, flagged.
        assert_eq!(outputs[19].input.pose.position[2], 0.01);
    }

    #[test]
    fn a_new_session_starts_without_force() {
        let mut bridge = bridge(simulated());
        for tick in 1..=1000 {
            let _ = bridge.tick(ms(tick), 0, Some(push(tick, 5.0, 0)));
        }
        bridge.begin_session(CommandSource::Other, None);
        // The new server's clock starts at zero: its commands count although their time is smaller. What was felt goes by the slew
        // limit, and what comes ramps in.
        let mut lowest = f64::INFINITY;
        for tick in 1001..=1100 {
            let first = Arrival {
                received: ms(tick),
                ..push(tick - 1000, 5.0, 0)
            };
            let _ = bridge.tick(ms(tick), 0, Some(first));
            lowest = lowest.min(bridge.port().rendered().norm());
        }
        assert!(lowest < 0.2, "{lowest} N");
        assert!(bridge.port().rendered().norm() < 1.01);
        assert_eq!(bridge.stats().wrenches, 1100);
    }
}
