//! A simulated device that fails on cue, behind its port, with a wall to press on.

use std::time::Duration;

use god_object::{Pose, Vector6};
use nalgebra::{Point3, Vector3};
use taut_bridge::{
    Command, Device, DeviceFault, DeviceInfo, DevicePort, DeviceSample, EventKind, SafetySettings,
    SimulatedDevice, TickReport,
};
use taut_plant::{Grip, Hand, MinJerkPath, ViaPoint};

use crate::closed_loop::PERIOD;

/// When things go wrong: the hand is fastest then.
pub(crate) const FAULT_AT: Duration = Duration::from_millis(1000);

/// Stiffness of the wall z < 0, N/m.
const STIFFNESS: f64 = 1000.0;

/// How a device can fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    /// It does not.
    None,
    /// One sample at the origin.
    OneAtOrigin,
    /// The same pose for 50 ms.
    Frozen,
    /// One sample that is not a number.
    NotANumber,
    /// 200 mm away for five samples.
    Jump,
    /// Time stamps go back by 0.5 s, and stay so.
    TimeBack,
    /// The cable is pulled, for 0.3 s.
    Unplugged,
}

/// Fails at [`FAULT_AT`].
struct FaultyDevice {
    inner: SimulatedDevice,
    failure: Failure,
    epoch: Option<Duration>,
    last: Option<DeviceSample>,
    buttons: u16,
}

impl Device for FaultyDevice {
    fn info(&self) -> &DeviceInfo {
        self.inner.info()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let epoch = *self.epoch.get_or_insert(now);
        let mut sample = self.inner.read(now)?;
        sample.buttons = self.buttons;
        let good = sample;
        let passed = now.saturating_sub(epoch);
        let Some(since) = passed.checked_sub(FAULT_AT) else {
            self.last = Some(good);
            return Ok(good);
        };
        let ticks = since.as_millis();
        match self.failure {
            Failure::OneAtOrigin if ticks < 1 => sample.pose = Pose::identity(),
            Failure::Frozen if ticks < 50 => {
                sample.pose = self.last.map_or(sample.pose, |last| last.pose);
            }
            Failure::NotANumber if ticks < 1 => sample.pose.translation.vector.y = f64::NAN,
            Failure::Jump if ticks < 5 => sample.pose.translation.vector.x += 0.2,
            Failure::TimeBack => {
                sample.time = sample.time.saturating_sub(Duration::from_millis(500))
            }
            Failure::Unplugged if ticks < 300 => return Err(DeviceFault::Lost { age: since }),
            _ => {}
        }
        Ok(sample)
    }

    fn write(&mut self, now: Duration, wrench: &Vector6) {
        self.inner.write(now, wrench);
    }
}

/// A hand that strokes a wall, and the port between.
pub(crate) struct Stroke {
    pub(crate) port: DevicePort,
    now: Duration,
    /// What was told, with its time since the begin.
    pub(crate) events: Vec<(EventKind, Duration)>,
    /// Norm of the force at each tick, N.
    pub(crate) forces: Vec<f64>,
    /// Largest change of the force in one tick, N.
    pub(crate) largest_step: f64,
    last: Vector3<f64>,
}

impl Stroke {
    /// Time of the first tick: the clock of a machine has run for a while.
    const BEGIN: Duration = Duration::from_secs(10);

    /// The hand goes along x at 10 mm in the wall, 0.3 m in 1.6 s, fastest at [`FAULT_AT`].
    pub(crate) fn new(failure: Failure, settings: SafetySettings, buttons: u16) -> Self {
        let via = |time_s, x| ViaPoint {
            time_s,
            pose: Pose::translation(x, 0.1, -0.01),
        };
        let path = MinJerkPath::new(
            vec![via(0.0, -0.15), via(0.2, -0.15), via(1.8, 0.15)],
            false,
        )
        .unwrap_or_else(|_| MinJerkPath::hold(Pose::identity()));
        let start = Pose::translation(-0.15, 0.1, -0.01);
        let device = FaultyDevice {
            inner: SimulatedDevice::new(Grip::workbench(), Hand::FIRM, path, Point3::origin()),
            failure,
            epoch: None,
            last: None,
            buttons,
        };
        Self {
            port: DevicePort::new(Box::new(device), settings, Point3::origin(), &start),
            now: Self::BEGIN,
            events: Vec::new(),
            forces: Vec::new(),
            largest_step: 0.0,
            last: Vector3::zeros(),
        }
    }

    /// Time since the begin.
    fn passed(&self) -> Duration {
        self.now - Self::BEGIN
    }

    /// One period: the wall's force is computed from the newest sample that may be trusted.
    pub(crate) fn tick(&mut self) -> TickReport {
        let now = self.now;
        let report = self.port.tick(now, |reading| {
            let depth = (-reading.sample.pose.translation.z).max(0.0);
            Some(Command::fresh(now, Vector6::z() * (STIFFNESS * depth)))
        });
        let since = self.passed();
        self.events
            .extend(report.events.iter().map(|event| (event.kind, since)));
        let force: Vector3<f64> = report.wrench.fixed_rows::<3>(0).into();
        self.largest_step = self.largest_step.max((force - self.last).norm());
        self.last = force;
        self.forces.push(force.norm());
        self.now += PERIOD;
        report
    }

    /// Ticks until `passed` since the begin.
    pub(crate) fn run_until(&mut self, passed: Duration) {
        while self.passed() < passed {
            let _ = self.tick();
        }
    }

    /// Whether something was told.
    pub(crate) fn has_event(&self, kind: EventKind) -> bool {
        self.events.iter().any(|(event, _)| *event == kind)
    }
}
