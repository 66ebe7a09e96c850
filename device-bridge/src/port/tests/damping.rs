//! The energy of a hand: damping where the device measures less often than the port ticks, and what moving obstacles are granted.

use super::*;
use crate::device::Felt;

/// A hand at 0.2 m/s that the force pushes on has been given energy without end, so the damping is all that it may be: 20 N s/m, 4 of 10 N.
#[test]
fn damping_keeps_its_cap_where_the_device_measures_less_often() {
    for ticks in 1..=5 {
        let settings = SafetySettings {
            period: TICK / ticks,
            passivity: PassivitySettings {
                max_debt: 10.0, // nothing but the damping takes any
                ..PassivitySettings::of(Passivity::Control)
            },
            ..SafetySettings::default()
        };
        let mut stage = Stage::new(settings);
        let mut measured = stage.now;
        let mut felt = 0.0;
        for tick in 0..700 * ticks {
            let now = stage.now + stage.period;
            if tick % ticks == 0 {
                measured = now;
            }
            let command = Command::fresh(now, force(10.0));
            felt = stage.tick(Ok(sample(measured)), Some(command)).wrench[0];
            assert!(felt >= 0.0, "{felt} N, a sample in {ticks} ticks");
        }
        assert_eq!(stage.port.state(), ArmingState::Armed, "{:?}", stage.events);
        assert!(
            (felt - 6.0).abs() < 1e-6,
            "{felt} N, a sample in {ticks} ticks"
        );
    }
}

/// Renders half of what it is told and says so, as strings do beyond what they bear.
struct Weak {
    info: DeviceInfo,
    rendered: Vector6<f64>,
}

impl Device for Weak {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, now: Duration) -> Answer {
        Ok(sample_at(now, 0.1))
    }

    fn write(&mut self, _now: Duration, wrench: &Vector6<f64>) {
        self.rendered = wrench * 0.5;
    }

    fn felt(&self) -> Option<Felt> {
        Some(Felt {
            wrench: self.rendered,
            at_edge: false,
            set_made: None,
        })
    }
}

#[test]
fn a_moving_obstacle_is_granted_what_its_force_gave_at_the_device() {
    let device = Weak {
        info: DeviceInfo::ideal("weak", 6),
        rendered: Vector6::zeros(),
    };
    let settings = SafetySettings {
        passivity: PassivitySettings::of(Passivity::Control),
        ..SafetySettings::default()
    };
    let start = Pose::identity();
    let mut port = DevicePort::new(Box::new(device), settings, Point3::origin(), &start);
    let mut with_plate = 0.0;
    for tick in 1..=2500_u32 {
        let now = TICK * tick;
        // A plate goes along with 4 N for a second and a half; then the force goes on without it.
        let command = Command {
            obstacle_work: 4.0 * 1e-4 * f64::from(tick.min(1500)),
            ..Command::fresh(now, force(4.0))
        };
        let _ = port.tick(now, |_| Some(command));
        if tick == 1500 {
            with_plate = port.energy().delivered();
        }
    }
    assert!(with_plate > 0.2, "{with_plate} J of the plate are felt");
    let without = port.energy().delivered() - with_plate;
    assert!(without < 0.015, "{without} J: there is only the reserve");
}
