//! One tick of the bridge: newest wrench in, through the port to the device, newest pose out.
//!
//! No sockets, threads or clocks: times are arguments, so a tick runs in real time and under a virtual clock.
//! No allocation after `new`.

use std::time::Duration;

use nalgebra::Vector6;
use taut_link::proto::constraints::ConstraintSet;
use taut_link::proto::input::{INPUT_AT_EDGE, INPUT_FAULT};
use taut_link::proto::wrench::WRENCH_PAUSED;
use taut_link::proto::{InputSample, PassedForce, PoseF64, SessionTime, WrenchCommand};

use crate::device::DeviceFault;
use crate::edge::{BrokenSet, EdgeCoupler, PassedWrench};
use crate::external::ExternalWrenchStatistics;
use crate::own_stamps::OwnStamps;
use crate::port::{
    Command, CommandSource, DevicePort, EdgeDetector, Events, Passivity, TickReport,
};
use crate::report::Durations;

/// The newest command, and when the device was read for what it comes from.
#[derive(Clone, Copy, Debug)]
struct Newest {
    command: WrenchCommand,
    origin: Duration,
}

/// What one tick gives.
#[derive(Clone, Copy, Debug)]
pub struct TickOutput {
    /// To be sent.
    pub input: InputSample,
    /// To be told.
    pub events: Events,
}

#[derive(Default)]
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
    /// Largest age of the reading that a force came from.
    pub(crate) max_force_age: Duration,
    pub(crate) max_force: f64,
    pub(crate) max_torque: f64,
    /// Given to the hand beyond what it had put in, and in all, by devices that were closed since, J.
    energy_before: [f64; 2],
}

/// What a loop has counted, for the one that comes after it.
pub(crate) struct Past {
    stats: TickStats,
    passed: Option<Box<PassedWrench>>,
}

/// The device side of a session.
pub struct BridgeLoop {
    port: DevicePort,
    stats: TickStats,
    /// Number of the next reading.
    next_index: u64,
    stamps: OwnStamps,
    newest: Option<Newest>,
    /// The coupling, where it is here and not at the server.
    edge: Option<Box<EdgeCoupler>>,
    /// A force from outside, where this port keeps its energy.
    passed: Option<Box<PassedWrench>>,
    /// One was refused, and that was told.
    unkept: bool,
    /// Number of the set that was refused last.
    refused: Option<u64>,
    refusals: EdgeDetector,
}

impl BridgeLoop {
    /// A loop without a session.
    #[must_use]
    pub fn new(port: DevicePort) -> Self {
        let settings = port.settings();
        let keeps_energy = settings.passivity.mode == Passivity::Control;
        Self {
            passed: keeps_energy.then(|| Box::new(PassedWrench::new(settings))),
            unkept: false,
            port,
            stats: TickStats::default(),
            next_index: 1,
            stamps: OwnStamps::default(),
            newest: None,
            edge: None,
            refused: None,
            refusals: EdgeDetector::default(),
        }
    }

    /// What stands between this loop and the device.
    #[must_use]
    pub fn port(&self) -> &DevicePort {
        &self.port
    }

    pub(crate) fn port_mut(&mut self) -> &mut DevicePort {
        &mut self.port
    }

    pub(crate) fn stats(&self) -> &TickStats {
        &self.stats
    }

    /// Closes the device; what was counted.
    pub(crate) fn close(mut self) -> Past {
        self.stats.energy_before = self.energy();
        Past {
            stats: self.stats,
            passed: self.passed,
        }
    }

    pub(crate) fn go_on_from(&mut self, past: Past) {
        self.stats = past.stats;
        self.passed = past.passed;
    }

    /// Given to the hand beyond what it had put in, and in all, J.
    pub(crate) fn energy(&self) -> [f64; 2] {
        let (now, before) = (self.port.energy(), self.stats.energy_before);
        [before[0] + now.injected(), before[1] + now.delivered()]
    }

    /// What became of a force from outside; `None` where none is felt.
    pub(crate) fn external(&self) -> Option<&ExternalWrenchStatistics> {
        self.passed.as_ref().map(|passed| passed.statistics())
    }

    pub(crate) fn fault(&self) -> Option<DeviceFault> {
        self.port.fault()
    }

    /// Forgets the last session: no force until a command or a constraint set of the new one, which ramps in. With `edge` the force
    /// is computed here.
    pub fn begin_session(&mut self, source: CommandSource, edge: Option<EdgeCoupler>) {
        self.newest = None;
        self.stamps = OwnStamps::default();
        self.edge = edge.map(Box::new);
        self.refused = None;
        if let Some(passed) = &mut self.passed {
            passed.restart();
        }
        self.port.restart(source);
    }

    pub(crate) fn couples(&self) -> bool {
        self.edge.is_some()
    }

    /// Takes the newest constraint set, once or again, before the tick at `now`. One that does not say which reading it answers is left alone.
    ///
    /// What is to be told: why it was refused, the first time in a run of refusals.
    pub fn take_set(
        &mut self,
        set: &ConstraintSet,
        now: Duration,
        session: Option<SessionTime>,
    ) -> Option<BrokenSet> {
        self.stamps.follow(now, session);
        let (Some(edge), Some(origin)) = (&mut self.edge, self.stamps.made(set.head.device_ns))
        else {
            return None;
        };
        let new = edge.sequence() != Some(set.head.sequence);
        match edge.take(set, origin) {
            Ok(()) if new => {
                self.stats.sets += 1;
                if let Some(session) = session {
                    let age = session.ns.saturating_sub(set.head.made_ns);
                    self.stats.set_age.record(Duration::from_nanos(age));
                }
            }
            Ok(()) => {}
            Err(broken) => {
                let sequence = Some(set.head.sequence);
                let another = std::mem::replace(&mut self.refused, sequence) != sequence;
                self.stats.broken_sets += u64::from(another);
                return self.refusals.begins(now, true).then_some(broken);
            }
        }
        None
    }

    /// Takes the newest force from outside, once or again, before the tick at `now`.
    ///
    /// Whether it is to be told that none is felt here, because this port does not keep the energy that one could give without end: once.
    pub fn take_passed(
        &mut self,
        passed: &PassedForce,
        now: Duration,
        session: Option<SessionTime>,
    ) -> bool {
        match &mut self.passed {
            Some(felt) => felt.take(passed, now, session),
            None => return !std::mem::replace(&mut self.unkept, true),
        }
        false
    }

    /// One tick at `now`. `session` is session time, `None` while the clock is not locked; `command` is the newest one, again and again
    /// until there is a newer one.
    pub fn tick(
        &mut self,
        now: Duration,
        session: Option<SessionTime>,
        command_heard: Option<WrenchCommand>,
    ) -> TickOutput {
        self.stats.ticks += 1;
        self.stamps.follow(now, session);
        let session_ns = session.map_or(0, |session| session.ns);
        self.adopt(now, session_ns, command_heard);

        let index = self.next_index;
        self.next_index += 1;
        let (newest, edge, passed) = (self.newest, &mut self.edge, &mut self.passed);
        let paused = match (&edge, &newest) {
            (Some(edge), _) => edge.is_paused(),
            (None, Some(newest)) => newest.command.flags & WRENCH_PAUSED != 0,
            (None, None) => true,
        };
        let report = self.port.tick(now, |reading| {
            let command = match edge {
                Some(edge) => edge.step(now, &reading.sample).map(|felt| Command {
                    obstacle_work: felt.obstacle_work,
                    paused: felt.paused,
                    ..Command::on_set(felt.origin, felt.wrench)
                }),
                None => newest.map(|newest| command(&newest)),
            };
            let external = match passed {
                Some(passed) if paused => passed.stop(),
                Some(passed) => passed.tick(now, &reading.sample.pose),
                None => Vector6::zeros(),
            };
            command.map(|command| Command {
                external,
                ..command
            })
        });

        self.note(now, &report);
        let reading = &report.reading;
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
                clock_uncertainty_ns: session.map_or(0, |session| session.uncertainty_ns),
                index,
                pose: PoseF64::from_isometry(&sample.pose),
                velocity: sample.velocity.into(),
                buttons: sample.buttons,
                flags: faulty | at_edge,
                rendered: report.wrench.into(),
                set_made_ns: self.edge.as_ref().map_or(0, |edge| edge.set_made_ns()),
            },
            events: report.events,
        }
    }

    fn note(&mut self, now: Duration, report: &TickReport) {
        let (stats, wrench) = (&mut self.stats, &report.wrench);
        stats.max_force = stats.max_force.max(wrench.fixed_rows::<3>(0).norm());
        stats.max_torque = stats.max_torque.max(wrench.fixed_rows::<3>(3).norm());
        if let Some(origin) = self.port.origin()
            && *wrench != Vector6::zeros()
        {
            stats.max_force_age = stats.max_force_age.max(now.saturating_sub(origin));
        }
        let events = report.events.iter();
        stats.safety_events += events.filter(|e| e.kind.is_warning()).count() as u64;
        stats.faulty_ticks += u64::from(report.reading.fault.is_some());
    }

    /// Takes a command that is newer than the last one, if it says what it comes from.
    fn adopt(&mut self, now: Duration, session_ns: u64, command: Option<WrenchCommand>) {
        let known = self.newest.map(|newest| newest.command.time_ns);
        let Some(command) = command.filter(|command| Some(command.time_ns) > known) else {
            return;
        };
        let Some(origin) = self.stamps.made(command.origin_ns) else {
            return;
        };
        self.newest = Some(Newest { command, origin });
        self.stats.wrenches += 1;
        let age = session_ns.saturating_sub(command.time_ns);
        self.stats.wrench_age.record(Duration::from_nanos(age));
        self.stats.round_trip.record(now.saturating_sub(origin));
    }
}

fn command(newest: &Newest) -> Command {
    let wrench = if newest.command.flags & WRENCH_PAUSED == 0 {
        Vector6::from(newest.command.wrench)
    } else {
        Vector6::zeros()
    };
    Command {
        obstacle_work: newest.command.obstacle_work,
        ..Command::fresh(newest.origin, wrench)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Device, Pose};
    use crate::devices::{AtEnd, Grip, Hand, MinJerkPath, RecordedDevice, SimulatedDevice};
    use crate::edge::{floor, offer};
    use crate::ms;
    use crate::port::{EventKind, SafetySettings};
    use nalgebra::Point3;
    use taut_recording::TraceSample;

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

    /// Session time is that of the ticks, exactly.
    fn session(time_ms: u64) -> Option<SessionTime> {
        Some(SessionTime {
            ns: time_ms * 1_000_000,
            uncertainty_ns: 1000,
        })
    }

    /// What was computed at `time_ms` from the reading of `origin_ms`.
    fn push(time_ms: u64, newtons: f64, origin_ms: u64) -> WrenchCommand {
        WrenchCommand {
            time_ns: time_ms * 1_000_000,
            origin_ns: origin_ms * 1_000_000,
            wrench: [0.0, 0.0, newtons, 0.0, 0.0, 0.0],
            obstacle_work: 0.0,
            flags: 0,
        }
    }

    /// The same of the reading before, which a bridge ticks on at `time_ms`.
    fn at_once(time_ms: u64, newtons: f64) -> WrenchCommand {
        push(time_ms, newtons, time_ms)
    }

    /// A bridge whose server has commanded 5 N for a second.
    fn pushed() -> BridgeLoop {
        let mut bridge = bridge(simulated());
        for tick in 1..=1000 {
            let _ = bridge.tick(ms(tick), session(tick), Some(at_once(tick, 5.0)));
        }
        bridge
    }

    #[test]
    fn a_wrench_from_the_far_end_moves_the_hand_and_its_pose_goes_back() {
        let mut bridge = bridge(simulated());
        let mut z = 0.0;
        for tick in 1..2000 {
            let command = push(tick, 2.0, tick.saturating_sub(3));
            let output = bridge.tick(ms(tick), session(tick), Some(command));
            assert_eq!((output.input.index, output.input.flags), (tick, 0));
            z = output.input.pose.position[2];
        }
        assert!((z - 2.0 / Hand::LIGHT.stiffness).abs() < 1e-3, "{z} m");
        // The first three come from no reading.
        assert_eq!(bridge.stats().wrenches, 1996);
        // The histogram keeps three digits.
        let round_trip = bridge.stats().round_trip.summary().expect("measured");
        assert!(round_trip.p50.abs_diff(3000) <= 3, "{} us", round_trip.p50);
        assert!((bridge.stats().max_force - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_server_that_falls_silent_is_felt_no_longer_than_120_ms() {
        let mut bridge = pushed();
        let mut events = Vec::new();
        for tick in 1001..=1300 {
            let output = bridge.tick(ms(tick), session(tick), Some(at_once(1000, 5.0)));
            events.extend(output.events.iter().copied());
            let felt = bridge.port().rendered().norm();
            // 5 ms before the promise: the margin for a loop that is late.
            assert_eq!(felt == 0.0, tick >= 1115, "{felt} N at {tick} ms");
        }
        let events: Vec<_> = events.iter().map(|e| (e.kind, e.time, e.value)).collect();
        assert_eq!(events, [(EventKind::ForceStale, ms(1021), 0.021)]);
        // The same command sent again is no new one.
        assert_eq!(bridge.stats().wrenches, 1000);
    }

    #[test]
    fn a_paused_server_gives_no_force() {
        let mut bridge = bridge(simulated());
        for tick in 1..=1000 {
            let mut command = at_once(tick, 5.0);
            command.flags = WRENCH_PAUSED;
            let _ = bridge.tick(ms(tick), session(tick), Some(command));
        }
        assert_eq!(bridge.stats().max_force, 0.0);
        assert_eq!(bridge.stats().wrenches, 1000);
    }

    #[test]
    fn a_faulty_device_is_told_once_and_flagged_on_every_reading() {
        let row = |time| TraceSample {
            time,
            pose: Pose::translation(0.0, 0.0, time),
            buttons: 0,
        };
        let trace = vec![row(0.0), row(0.01)];
        let device = RecordedDevice::new(trace, AtEnd::Fault, Point3::origin());
        let mut bridge = bridge(device.expect("a valid trace"));
        let outputs: Vec<_> = (0..20)
            .map(|tick| bridge.tick(ms(tick), session(tick), None))
            .collect();
        assert!(outputs[..11].iter().all(|output| output.input.flags == 0));
        assert!(
            outputs[11..]
                .iter()
                .all(|output| output.input.flags == INPUT_FAULT)
        );
        let events: Vec<_> = outputs
            .iter()
            .flat_map(|output| output.events.iter().map(|event| event.kind))
            .collect();
        assert_eq!(events, [EventKind::DeviceEnded]);
        assert_eq!(bridge.fault(), Some(DeviceFault::Ended));
        // The last good pose goes on being sent, flagged.
        assert_eq!(outputs[19].input.pose.position[2], 0.01);
    }

    #[test]
    fn a_new_session_starts_without_force() {
        let mut bridge = pushed();
        bridge.begin_session(CommandSource::Other, None);
        // The new server's clock starts at zero: its commands count although their time is smaller. What was felt goes by the slew
        // limit, and what comes ramps in.
        let mut lowest = f64::INFINITY;
        for tick in 1001..=1100 {
            let first = Some(at_once(tick - 1000, 5.0));
            let _ = bridge.tick(ms(tick), session(tick - 1000), first);
            lowest = lowest.min(bridge.port().rendered().norm());
        }
        assert!(lowest < 0.2, "{lowest} N");
        assert!(bridge.port().rendered().norm() < 1.01);
        assert_eq!(bridge.stats().wrenches, 1100);
    }

    #[test]
    fn refused_sets_are_each_counted_and_told_once_a_run() {
        let mut bridge = bridge(simulated());
        let edge = EdgeCoupler::new(&offer()).expect("an offer");
        bridge.begin_session(CommandSource::Other, Some(edge));
        let _ = bridge.tick(ms(1), session(1), None);
        let mut events = Vec::new();
        // A good set, twenty broken ones in three ticks each, a pause, and another broken one.
        for tick in 2..400 {
            let number = match tick {
                2..62 => tick / 3,
                62..300 => continue,
                _ => 100,
            };
            let mut set = floor(number, 0);
            set.head.device_ns = 1_000_000;
            if number > 0 {
                set.rows[0].normal = [0.0, 0.0, 0.5];
            }
            let refused = bridge.take_set(&set, ms(tick), session(tick));
            events.extend(refused.map(|broken| (tick, broken)));
        }
        let normal = BrokenSet::Normal;
        assert_eq!(events, [(3, normal), (300, normal)]);
        assert_eq!((bridge.stats().sets, bridge.stats().broken_sets), (1, 21));
    }

    /// Force that is felt, N, when every command comes from a reading that is `age` old, ms.
    fn felt_at(mut age: impl FnMut(u64) -> u64, ticks: u64) -> (Vec<f64>, Vec<EventKind>, u128) {
        let mut bridge = bridge(simulated());
        let (mut felt, mut events) = (Vec::new(), Vec::new());
        for tick in 1..=ticks {
            let command = push(tick, 5.0, tick.saturating_sub(age(tick)));
            let output = bridge.tick(ms(tick), session(tick), Some(command));
            events.extend(output.events.iter().map(|event| event.kind));
            felt.push(bridge.port().rendered().norm());
        }
        (felt, events, bridge.stats().max_force_age.as_millis())
    }

    #[test]
    fn a_delay_that_grows_under_new_commands_is_felt_no_longer_than_a_silence() {
        let growing = |tick: u64| 2 + tick.saturating_sub(1000) / 10;
        let (felt, events, oldest) = felt_at(growing, 3000);
        assert!((felt[999] - 5.0).abs() < 1e-12);
        // 20 ms old after 180 ms; then the fade of a silence, which does not wait for the delay.
        let last = felt
            .iter()
            .rposition(|force| *force > 0.0)
            .expect("a force");
        assert!((1180..1300).contains(&last), "{last}");
        assert!(oldest < 120, "{oldest} ms");
        assert!(events.contains(&EventKind::ForceStale), "{events:?}");
    }

    #[test]
    fn commands_that_come_from_no_reading_are_none() {
        // Without a clock, from the future, from before the clock was known.
        let mut unlocked = bridge(simulated());
        for tick in 1..=1000 {
            let output = unlocked.tick(ms(tick), None, Some(at_once(tick, 5.0)));
            assert_eq!(output.input.sample_time_ns, 0);
        }
        assert_eq!(unlocked.stats().max_force, 0.0);
        for origin in [|tick| tick + 3, |_| 0] {
            let mut bridge = bridge(simulated());
            for tick in 1..=1000 {
                let command = push(tick, 5.0, origin(tick));
                let _ = bridge.tick(ms(tick), session(tick), Some(command));
            }
            assert_eq!(bridge.stats().max_force, 0.0);
        }
    }
}
