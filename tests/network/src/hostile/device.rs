//! The hand: arming, ends of processes, limits of the force.
//!
//! A port with a simulated device under a virtual clock; the server that commands it is the attacker. Whole processes are in `program.rs`.

use std::time::Duration;

use nalgebra::{Point3, Vector6};
use taut_bridge::{
    Command, CommandSource, DevicePort, EventKind, Grip, Hand, MinJerkPath, Pose, Rearm,
    SafetySettings, SimulatedDevice,
};

use super::{Attack, Finding};
use crate::bench::BenchError;
use crate::report::Extent;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[
    Attack {
        name: "arms itself after an outage",
        tried: "a server that a person armed falls silent for 0.9 and 5 s, or is replaced by another process, and commands 10 N again",
        promised: "within 1 s it ramps in; after that, and from another process, no force until a person arms",
        run: outage,
    },
    Attack {
        name: "a server that commands jumps",
        tried: "20 N in another direction every 50 ms, at 100, 300, 1000 and 4000 Hz, on a hand that rests and on one that moves",
        promised: "0.5 N/ms and what the motion explains, never more than 2.5 N/ms and 5 N at once",
        run: jumps,
    },
];

/// A port and its clock.
struct Rig {
    port: DevicePort,
    now: Duration,
    period: Duration,
    /// Largest change of the force in a write, N, and in a millisecond, N/ms.
    step: (f64, f64),
    fastest: f64,
    events: Vec<EventKind>,
}

impl Rig {
    fn new(rearm: Rearm, rate_hz: u32, sway: f64) -> Self {
        let period = Duration::from_secs(1) / rate_hz;
        let path = MinJerkPath::sway(Pose::identity(), sway, 1.0);
        let device = SimulatedDevice::new(Grip::workbench(), Hand::FIRM, path, Point3::origin());
        let settings = SafetySettings {
            rearm,
            period,
            ..SafetySettings::default()
        };
        Self {
            port: DevicePort::new(
                Box::new(device),
                settings,
                Point3::origin(),
                &Pose::identity(),
            ),
            now: Duration::from_secs(1),
            period,
            step: (0.0, 0.0),
            fastest: 0.0,
            events: Vec::new(),
        }
    }

    /// Ticks for `time`; `made` of the command if it is not of now.
    fn run(&mut self, time: Duration, made: Option<Duration>, wrench: Vector6<f64>) {
        let end = self.now + time;
        while self.now < end {
            self.now += self.period;
            let before = *self.port.rendered();
            let command = Command {
                origin: made.unwrap_or(self.now),
                ..Command::fresh(self.now, wrench)
            };
            let report = self.port.tick(self.now, |_| Some(command));
            self.events
                .extend(report.events.iter().map(|event| event.kind));
            let change = (report.wrench - before).fixed_rows::<3>(0).norm();
            let rate = change / self.period.as_secs_f64();
            self.step.0 = self.step.0.max(change);
            self.step.1 = self.step.1.max(rate * 1e-3);
            let speed = report.reading.sample.velocity.fixed_rows::<3>(0).norm();
            self.fastest = self.fastest.max(speed);
        }
    }

    fn force(&self) -> f64 {
        self.port.rendered().fixed_rows::<3>(0).norm()
    }
}

fn outage(_extent: &Extent) -> Result<Finding, BenchError> {
    let push = Vector6::x() * 10.0;
    let armed = || {
        let mut rig = Rig::new(Rearm::Manual, 1000, 0.02);
        rig.run(Duration::from_millis(10), None, push);
        rig.port.ask_to_arm();
        rig.run(Duration::from_secs(1), None, push);
        rig
    };
    let after_silence = |milliseconds| {
        let mut rig = armed();
        let made = rig.now;
        rig.run(Duration::from_millis(milliseconds), Some(made), push);
        rig.run(Duration::from_secs(2), None, push);
        rig
    };
    let (before, short, long) = (armed().force(), after_silence(900), after_silence(5000));
    let mut replaced = armed();
    replaced.port.restart(CommandSource::Other);
    replaced.run(Duration::from_secs(2), None, push);
    let asked = |rig: &Rig| rig.events.contains(&EventKind::RearmNeeded);
    Ok(Finding {
        happened: format!(
            "armed {before:.1} N; 2 s after 0.9 s of silence {:.1} N, after 5 s {:.1} N, from another process {:.1} N",
            short.force(),
            long.force(),
            replaced.force()
        ),
        kept: before > 9.9
            && short.force() > 9.9
            && long.force() == 0.0
            && replaced.force() == 0.0
            && asked(&long)
            && asked(&replaced),
    })
}

fn jumps(_extent: &Extent) -> Result<Finding, BenchError> {
    let mut happened = Vec::new();
    let mut kept = true;
    for rate_hz in [100, 300, 1000, 4000] {
        for sway in [0.0, 0.1] {
            let mut rig = Rig::new(Rearm::Automatic, rate_hz, sway);
            rig.run(Duration::from_secs(1), None, Vector6::zeros());
            for turn in 0..40 {
                let (sin, cos) = f64::from(turn).sin_cos();
                let push = Vector6::new(20.0 * cos, 20.0 * sin, 0.0, 0.0, 0.0, 0.0);
                rig.run(Duration::from_millis(50), None, push);
            }
            let (step, rate) = rig.step;
            kept &= step <= 5.0 + 1e-9 && rate <= 2.5 + 1e-9 && rig.force() > 0.0;
            happened.push(format!(
                "{rate_hz} Hz, up to {:.2} m/s: {rate:.2} N/ms, {step:.2} N at once",
                rig.fastest
            ));
        }
    }
    Ok(Finding {
        happened: happened.join("; "),
        kept,
    })
}
