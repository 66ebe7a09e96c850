//! R23: a command far outside the limits keeps its direction; and what is inside them passes to the bit, at the rate of an ordinary
//! contact.

use std::time::Duration;

use god_object::{Pose, Vector6};
use nalgebra::{Point3, Vector3};
use taut_bridge::{
    Command, Device, DeviceFault, DeviceInfo, DeviceLimits, DevicePort, DeviceSample, EventKind,
    SafetySettings,
};

use crate::Row;
use crate::closed_loop::PERIOD;

/// Direction that limits may turn a wrench by, deg: rounding.
const EXACT_DEG: f64 = 1e-5;
/// Stiffness of an ordinary contact, N/m.
const STIFFNESS: f64 = 1000.0;

/// Moves along z as told.
struct Moving {
    info: DeviceInfo,
    height: fn(f64) -> f64,
}

impl Device for Moving {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        Ok(DeviceSample {
            time: now,
            pose: Pose::translation(0.0, 0.0, (self.height)(now.as_secs_f64())),
            velocity: Vector6::zeros(),
            buttons: 0,
        })
    }

    fn write(&mut self, _now: Duration, _wrench: &Vector6) {}
}

fn port(height: fn(f64) -> f64) -> DevicePort {
    let device = Moving {
        info: DeviceInfo {
            name: "moving".to_owned(),
            sensed_degrees_of_freedom: 6,
            actuated_degrees_of_freedom: 6,
            limits: DeviceLimits::UNLIMITED,
            rate_hz: 1000.0,
        },
        height,
    };
    let start = Pose::translation(0.0, 0.0, height(0.0));
    DevicePort::new(
        Box::new(device),
        SafetySettings::default(),
        Point3::origin(),
        &start,
    )
}

/// Direction, norms, and contact.
#[must_use]
pub fn run() -> Vec<Row> {
    let mut rows = saturated();
    // K v = 0.3 N/ms passes, 0.6 N/ms does not.
    let (differs, told) = contact(|t| 0.35 - 0.3 * t, Duration::from_millis(1230));
    rows.push(Row::at_most(
        "1000 N/m at 0.3 m/s: rendered - commanded",
        differs,
        0.0,
        "N",
    ));
    rows.push(Row::holds(
        "1000 N/m at 0.3 m/s: slew limit",
        if told { "acts" } else { "does not act" },
        "does not act",
        !told,
    ));
    let (differs, told) = contact(|t| 0.35 - 0.6 * t, Duration::from_millis(610));
    rows.push(Row::holds(
        "1000 N/m at 0.6 m/s: slew limit",
        if told { "acts" } else { "does not act" },
        "acts",
        told && differs > 0.0,
    ));
    rows
}

/// 100 N at 10 degrees from x, with 2 N m at 10 degrees from y.
fn saturated() -> Vec<Row> {
    let (sin, cos) = 10.0_f64.to_radians().sin_cos();
    let asked = Vector6::new(100.0 * cos, 100.0 * sin, 0.0, 0.0, 2.0 * cos, 2.0 * sin);
    let mut port = port(|_| 0.0);
    let mut felt = Vector6::zeros();
    for tick in 0..1000 {
        let now = PERIOD * tick;
        felt = port.tick(now, |_| Some(Command::fresh(now, asked))).wrench;
    }
    let part =
        |wrench: &Vector6, start: usize| -> Vector3<f64> { wrench.fixed_rows::<3>(start).into() };
    let mut rows = Vec::new();
    for (name, start, limit, unit) in [("force", 0, 20.0, "N"), ("torque", 3, 0.5, "N m")] {
        let (felt, asked) = (part(&felt, start), part(&asked, start));
        rows.push(Row::at_most(
            format!("{name} far above its limit: turned by"),
            felt.angle(&asked).to_degrees(),
            EXACT_DEG,
            "deg",
        ));
        rows.push(Row::within(
            format!("{name}: norm"),
            felt.norm(),
            limit,
            1e-12,
            unit,
        ));
    }
    // What is avoided.
    let clamped = part(&asked, 0).map(|x| x.clamp(-10.0, 10.0));
    let turned = clamped.angle(&part(&asked, 0)).to_degrees();
    rows.push(Row::within(
        "10 N per component instead: turned by",
        turned,
        35.0,
        1e-6,
        "deg",
    ));
    rows
}

/// Meets a wall z < 0: largest difference of what is rendered from what is commanded, and whether the slew limit acted, up to `end`.
fn contact(height: fn(f64) -> f64, end: Duration) -> (f64, bool) {
    let mut port = port(height);
    let (mut largest, mut told) = (0.0_f64, false);
    let mut tick = 0;
    while PERIOD * tick < end {
        let now = PERIOD * tick;
        let mut commanded = Vector6::zeros();
        let report = port.tick(now, |reading| {
            commanded = Vector6::z() * (STIFFNESS * (-reading.sample.pose.translation.z).max(0.0));
            Some(Command::fresh(now, commanded))
        });
        largest = largest.max((report.wrench - commanded).norm());
        told |= report
            .events
            .iter()
            .any(|event| event.kind == EventKind::ForceSlewLimited);
        tick += 1;
    }
    (largest, told)
}
