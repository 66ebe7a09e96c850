//! What one tick of the device port costs: thread CPU time of validation, watchdog, arming, passivity, clamp, slew and energy.
//!
//! `cargo run --release -p taut --no-default-features --example port_cost`

use std::time::Duration;

use god_object::nalgebra::{Point3, Vector3};
use god_object::{Pose, Vector6};
use taut::loops::realtime::thread_cpu_time;
use taut::shared::timing::distribution_of;
use taut_bridge::{
    Command, Device, DeviceFault, DeviceInfo, DeviceLimits, DevicePort, DeviceSample, Passivity,
    PassivitySettings, SafetySettings,
};

/// Ticks that are measured, each on its own.
const TICKS: u32 = 1_000_000;

/// Costs next to nothing itself.
struct Circling(DeviceInfo);

impl Device for Circling {
    fn info(&self) -> &DeviceInfo {
        &self.0
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let phase = (now.as_secs_f64() * 3.0).sin();
        Ok(DeviceSample {
            time: now,
            pose: Pose::new(Vector3::x() * (0.05 * phase), Vector3::y() * phase),
            velocity: Vector6::zeros(),
            buttons: 0,
        })
    }

    fn write(&mut self, _now: Duration, _wrench: &Vector6) {}
}

fn main() {
    let device = Circling(DeviceInfo {
        name: "circling".to_owned(),
        sensed_degrees_of_freedom: 6,
        actuated_degrees_of_freedom: 6,
        limits: DeviceLimits::UNLIMITED,
        rate_hz: 1000.0,
    });
    let settings = SafetySettings {
        passivity: PassivitySettings {
            mode: Passivity::Control,
            ..PassivitySettings::default()
        },
        ..SafetySettings::default()
    };
    let start = Pose::identity();
    let mut port = DevicePort::new(Box::new(device), settings, Point3::origin(), &start);
    // What reading the clock twice costs is in every figure.
    let (mut cost, mut clock_only) = (Vec::new(), Vec::new());
    for tick in 0..TICKS {
        let now = Duration::from_millis(u64::from(tick));
        let before = thread_cpu_time();
        let between = thread_cpu_time();
        let report = port.tick(now, |reading| {
            let push = Vector6::x() * (-2000.0 * reading.sample.pose.translation.x);
            Some(Command::fresh(now, push))
        });
        let after = thread_cpu_time();
        let _ = std::hint::black_box(report);
        let us = |time: Duration| time.as_secs_f64() * 1e6;
        clock_only.push(us(between.saturating_sub(before)));
        cost.push(us(after.saturating_sub(between)));
    }
    for (name, times) in [("port tick", &cost), ("clock alone", &clock_only)] {
        let seen = distribution_of(times);
        println!(
            "{name:12} p50 {:.2} us, p99 {:.2} us, p99.9 {:.2} us, max {:.1} us",
            seen.p50, seen.p99, seen.p999, seen.max
        );
    }
}
