//! R23: a command far outside the limits keeps its direction; and what is inside them passes to the bit, as fast as R11 meets its wall. What no motion
//! explains is slow.

use std::time::Duration;

use god_object::{Pose, Vector6};
use nalgebra::{Point3, Vector3};
use taut_bridge::{
    Command, Device, DeviceFault, DeviceInfo, DevicePort, DeviceSample, EventKind, SafetySettings,
    TickReport,
};

use crate::closed_loop::PERIOD;
use crate::row::{Row, Rows};

/// Direction that limits may turn a wrench by, deg: rounding.
const EXACT_DEG: f64 = 1e-5;
/// Stiffness of an ordinary contact, N/m.
const STIFFNESS: f64 = 1000.0;

/// When the wall z < 0 is met: the force has ramped in by then.
const MET_AT: f64 = 0.7;
/// How deep it is pressed, m: below the largest force.
const DEPTH: f64 = 0.018;

/// Moves down along z at a constant speed, m/s.
struct Moving {
    info: DeviceInfo,
    speed: f64,
}

impl Moving {
    fn height(&self, time_s: f64) -> f64 {
        self.speed * (MET_AT - time_s)
    }
}

impl Device for Moving {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        Ok(DeviceSample {
            time: now,
            pose: Pose::translation(0.0, 0.0, self.height(now.as_secs_f64())),
            velocity: Vector6::zeros(),
            buttons: 0,
        })
    }

    fn write(&mut self, _now: Duration, _wrench: &Vector6) {}
}

fn port(speed: f64) -> DevicePort {
    let device = Moving {
        info: DeviceInfo::ideal("moving", 6),
        speed,
    };
    let start = Pose::translation(0.0, 0.0, device.height(0.0));
    DevicePort::new(
        Box::new(device),
        SafetySettings::default(),
        Point3::origin(),
        &start,
    )
}

/// Direction, norms, and contact.
pub(crate) fn run() -> Vec<Row> {
    let mut all = saturated();
    let told = |acts| if acts { "acts" } else { "does not act" };
    // R11's speeds, and one between: up to 1 N/ms.
    for speed in [0.05, 0.3, 0.6, 1.0] {
        let mut rows = Rows::of(format!("1000 N/m at {speed} m/s"));
        let (differs, acts) = contact(speed);
        rows.at_most("rendered - commanded", differs, 0.0, "N");
        rows.holds("slew limit", told(acts), told(false), !acts);
        all.extend(rows.all);
    }
    let mut rows = Rows::of("20 N at once on a hand that rests");
    let (step, acts) = unexplained();
    rows.at_most("largest step", step, 0.5 + 1e-9, "N/ms");
    rows.holds("slew limit", told(acts), told(true), acts);
    all.extend(rows.all);
    all
}

/// 100 N at 10 degrees from x, with 2 N m at 10 degrees from y.
fn saturated() -> Vec<Row> {
    let (sin, cos) = 10.0_f64.to_radians().sin_cos();
    let asked = Vector6::new(100.0 * cos, 100.0 * sin, 0.0, 0.0, 2.0 * cos, 2.0 * sin);
    let mut port = port(0.0);
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

fn is_limited(report: &TickReport) -> bool {
    let mut events = report.events.iter();
    events.any(|event| event.kind == EventKind::ForceSlewLimited)
}

/// Meets the wall: largest difference of what is rendered from what is commanded, and whether the slew limit acted.
fn contact(speed: f64) -> (f64, bool) {
    let mut port = port(speed);
    let (mut largest, mut acts) = (0.0_f64, false);
    let mut tick = 0;
    while (PERIOD * tick).as_secs_f64() < MET_AT + DEPTH / speed {
        let now = PERIOD * tick;
        let mut commanded = Vector6::zeros();
        let report = port.tick(now, |reading| {
            commanded = Vector6::z() * (STIFFNESS * (-reading.sample.pose.translation.z).max(0.0));
            Some(Command::fresh(now, commanded))
        });
        largest = largest.max((report.wrench - commanded).norm());
        acts |= is_limited(&report);
        tick += 1;
    }
    (largest, acts)
}

/// A command that jumps while the hand rests: largest change of what is rendered, and whether the slew limit acted.
fn unexplained() -> (f64, bool) {
    let mut port = port(0.0);
    let (mut largest, mut acts, mut before) = (0.0_f64, false, Vector6::zeros());
    for tick in 0..1000 {
        let now = PERIOD * tick;
        let asked = Vector6::z() * if tick < 800 { 0.0 } else { 20.0 };
        let report = port.tick(now, |_| Some(Command::fresh(now, asked)));
        largest = largest.max((report.wrench - before).norm());
        before = report.wrench;
        acts |= is_limited(&report);
    }
    (largest, acts)
}
