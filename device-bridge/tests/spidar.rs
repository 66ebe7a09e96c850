//! The whole chain of a string-driven device: true pose, counts, pose; wrench, tensions, wrench on the grip.

use std::time::Duration;

use nalgebra::{Isometry3, Point3, Vector3, Vector6};
use taut_bridge::{Device, DeviceFault, Pose, SpidarDevice, SpidarPlacement};
use taut_spidar::{
    Geometry, MotorState, SimulatedStrings, StringFault, StringLosses, TensionStatus,
};

type Simulated = SpidarDevice<SimulatedStrings>;

fn geometry(name: &str) -> Geometry {
    Geometry::shipped(name).unwrap_or_else(|| panic!("{name} is shipped"))
}

fn device(geometry: &Geometry, losses: StringLosses, placement: SpidarPlacement) -> Simulated {
    let strings = SimulatedStrings::new(geometry, losses, Pose::identity());
    let device =
        SpidarDevice::calibrated_at_centre(geometry.clone(), strings, placement, Duration::ZERO);
    device.unwrap_or_else(|fault| panic!("{fault}"))
}

fn placed() -> SpidarPlacement {
    SpidarPlacement {
        world_from_frame: Pose::new(Vector3::new(0.4, -0.2, 1.1), Vector3::new(0.2, 0.9, -0.4)),
        grip_from_body: Pose::new(Vector3::new(0.01, 0.0, -0.02), Vector3::new(0.0, 0.5, 0.1)),
        reference_point: Point3::new(0.02, 0.03, -0.01),
    }
}

/// A hand's motion at `time`, s.
fn hand(time: f64, reach: f64) -> Pose {
    let wave = |hz: f64, phase: f64| (std::f64::consts::TAU * hz * time).sin() * phase;
    Pose::new(
        reach * Vector3::new(wave(1.0, 1.0), wave(0.7, 0.8), wave(1.3, 0.6)),
        Vector3::new(wave(0.9, 0.2), wave(1.1, 0.25), wave(0.6, 0.2)),
    )
}

fn halves(six: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (six.fixed_rows::<3>(0).into(), six.fixed_rows::<3>(3).into())
}

#[test]
fn the_body_is_where_the_grip_carries_it() {
    for name in Geometry::shipped_names() {
        let geometry = geometry(name);
        let placement = placed();
        let mut device = device(&geometry, StringLosses::default(), placement);
        let reach = geometry.half_width() / 5.0;
        let count = geometry.metres_per_count[0].abs();
        let point = |time: f64| {
            let body = placement.world_from_frame * hand(time, reach) * placement.grip_from_body;
            (body, body * placement.reference_point)
        };
        for tick in 1..=1500_u32 {
            let now = Duration::from_millis(tick.into());
            let time = now.as_secs_f64();
            device.hardware_mut().advance(now, hand(time, reach));
            let Ok(sample) = device.read(now) else {
                panic!("{name}: {:?}", device.fault());
            };
            assert_eq!(sample.time, now);
            let (truth, g) = point(time);
            let off = (sample.pose * placement.reference_point - g).norm();
            let turned = sample.pose.rotation.angle_to(&truth.rotation);
            // A count at every string, as much as the weakest pose direction makes of it; G lies a few centimetres off.
            assert!(turned < 3.0 * count / geometry.arm(), "{name}: {turned}");
            assert!(off < 3.0 * count + 0.05 * turned, "{name}: {off}");
            if tick > 20 {
                let (_, before) = point(time - 5e-4);
                let (_, after) = point(time + 5e-4);
                let velocity: Vector3<f64> = sample.velocity.fixed_rows::<3>(0).into();
                let error = (velocity - (after - before) / 1e-3).norm();
                assert!(error < 0.06, "{name}: {error} m/s");
            }
        }
    }
}

#[test]
fn the_wrench_about_g_arrives_at_the_hand() {
    for name in Geometry::shipped_names() {
        let geometry = geometry(name);
        let placement = placed();
        let mut device = device(&geometry, StringLosses::default(), placement);
        let grip = Pose::new(
            Vector3::new(0.1, -0.05, 0.08) * geometry.half_width(),
            Vector3::new(0.1, -0.15, 0.1),
        );
        let ms = Duration::from_millis(1);
        device.hardware_mut().advance(ms, grip);
        assert!(device.read(ms).is_ok());
        let wanted = Vector6::new(1.0, -1.5, 0.8, 0.005, -0.01, 0.008);
        device.write(ms, &wanted);
        assert_eq!(
            device.tensions().map(|answer| answer.status),
            Some(TensionStatus::Rendered)
        );
        // Ten time constants of the motors later.
        device
            .hardware_mut()
            .advance(Duration::from_millis(11), grip);
        let frame_wrench = device.hardware_mut().wrench();
        let (force, torque) = halves(&frame_wrench);
        let turn = placement.world_from_frame.rotation;
        let body = placement.world_from_frame * grip * placement.grip_from_body;
        let centre = placement.world_from_frame * grip * Point3::origin();
        let g = body * placement.reference_point;
        let (force, torque) = (turn * force, turn * torque);
        let torque = torque - (g - centre).cross(&force);
        let (f, t) = halves(&wanted);
        // Within a thousandth: the lag leaves exp(-10), quantisation of the pose turns the force by less.
        assert!(
            (force - f).norm() < 2e-3 * f.norm(),
            "{name}: {force} for {f}"
        );
        assert!(
            (torque - t).norm() < 2e-3 * f.norm() * 0.1 + 2e-3 * t.norm(),
            "{name}: {torque} for {t}"
        );
    }
}

#[test]
fn friction_and_lag_stay_within_what_they_are() {
    let geometry = geometry("wb");
    let losses = StringLosses {
        coulomb: 0.05,
        loss: 0.02,
    };
    let mut device = device(&geometry, losses, SpidarPlacement::default());
    let wanted = Vector6::new(0.0, 3.0, 0.0, 0.0, 0.0, 0.0);
    let mut worst = 0.0_f64;
    for tick in 1..=1000_u32 {
        let now = Duration::from_millis(tick.into());
        device
            .hardware_mut()
            .advance(now, hand(now.as_secs_f64(), 0.05));
        if tick > 20 {
            let off = device.hardware_mut().wrench() - wanted;
            worst = worst.max(off.fixed_rows::<3>(0).norm());
        }
        assert!(device.read(now).is_ok());
        device.write(now, &wanted);
    }
    // Eight strings, each at most 0.05 N and 2 % of its tension off, and the pose a millisecond old.
    println!("worst error {worst:.3} N of 3 N");
    assert!(worst > 0.05 && worst < 1.0, "{worst}");
}

#[test]
fn faults_stop_the_pose_and_leave_the_force_to_the_port() {
    let geometry = geometry("g6x3r");
    let mut device = device(
        &geometry,
        StringLosses::default(),
        SpidarPlacement::default(),
    );
    let ms = Duration::from_millis;
    assert!(device.read(ms(1)).is_ok());
    // A string slips: not at once, but before 20 ms are over, the pose is refused.
    device.hardware_mut().slip(2, 3e-3);
    let first = (2..100).find(|tick| device.read(ms(*tick)).is_err());
    assert!(first.is_some_and(|tick| tick <= 22), "{first:?}");
    let fault = device.read(ms(100)).err();
    assert!(
        matches!(
            fault,
            Some(DeviceFault::Strings(StringFault::Inconsistent { .. }))
        ),
        "{fault:?}"
    );
    // What is commanded goes on, with the strings where they were: the port leads the force down, and nothing jumps.
    for force in [5.0, 2.5, 0.0] {
        device.write(ms(100), &Vector6::new(force, 0.0, 0.0, 0.0, 0.0, 0.0));
        let answer = device.tensions().expect("written");
        assert!(
            (answer.wrench[0] - force).abs() < 0.05,
            "{force} N: {answer:?}"
        );
        assert!(answer.tensions.iter().all(|t| *t >= geometry.tension_min));
    }
}

#[test]
fn without_one_motor_the_pose_goes_on() {
    let geometry = geometry("wb");
    let strings = SimulatedStrings::new(&geometry, StringLosses::default(), Pose::identity())
        .measuring_tensions();
    let made = SpidarDevice::calibrated_at_centre(
        geometry.clone(),
        strings,
        SpidarPlacement::default(),
        Duration::ZERO,
    );
    let mut device = made.expect("simulated strings answer");
    device.hardware_mut().set_dead(4, true);
    let mut fault = None;
    for tick in 1..=200_u32 {
        let now = Duration::from_millis(tick.into());
        device
            .hardware_mut()
            .advance(now, hand(now.as_secs_f64(), 0.03));
        if let Err(found) = device.read(now) {
            fault = Some(found);
            break;
        }
        device.write(now, &Vector6::zeros());
    }
    assert!(
        matches!(
            fault,
            Some(DeviceFault::Strings(StringFault::Slack { string: 4, .. }))
        ),
        "{fault:?}"
    );
    device.set_motor(4, MotorState::Dead);
    let now = Duration::from_millis(300);
    device.hardware_mut().advance(now, hand(0.3, 0.03));
    let Ok(sample) = device.read(now) else {
        panic!("seven strings are enough: {:?}", device.fault());
    };
    let truth: Isometry3<f64> = hand(0.3, 0.03);
    assert!((sample.pose.translation.vector - truth.translation.vector).norm() < 1e-4);
    device.write(now, &Vector6::zeros());
    assert!(
        device
            .tensions()
            .is_some_and(|answer| answer.tensions[4] == 0.0)
    );
}
