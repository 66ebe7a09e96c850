//! The simulated hand and device in closed loop with a virtual wall, under a virtual clock.

use std::time::Duration;

use nalgebra::{Point3, Vector3, Vector6};
use taut_bridge::{
    Device, DeviceSample, EnergyObserver, Grip, Hand, MinJerkPath, Pose, SimulatedDevice, Tremor,
    ViaPoint,
};

const TICK: Duration = Duration::from_millis(1);
const TICK_S: f64 = 1e-3;

/// The device of the published stability figures: 0.2 kg, no saturation.
fn grip(damping: f64) -> Grip {
    Grip {
        damping: Vector3::repeat(damping),
        ..Grip::ball(0.2, 0.06, 2.0)
    }
}

fn read(device: &mut SimulatedDevice, now: Duration) -> DeviceSample {
    device.read(now).expect("a simulated device has no faults")
}

/// How much a kick against a two-sided wall at x = 0 has grown from the first to the last part of 2 s.
fn growth(device: &mut SimulatedDevice, stiffness: f64, damping: f64, delay: Duration) -> f64 {
    let kick = |tick: u32| if tick < 10 { 1.0 } else { 0.0 };
    let delay_ticks = (delay.as_micros() / TICK.as_micros()) as usize;
    let rest = delay - TICK * delay_ticks as u32;

    let (mut early, mut late) = (0.0_f64, 0.0_f64);
    let mut pending = vec![0.0; delay_ticks];
    let mut last = 0.0;
    for tick in 0..2000 {
        let now = TICK * tick;
        let x = read(device, now).pose.translation.vector.x;
        pending.push(kick(tick) - stiffness * x - damping * (x - last) / TICK_S);
        let force = pending.remove(0);
        device.write(now + rest, &(Vector6::x() * force));
        match tick {
            200..500 => early = early.max((x - last).abs()),
            1700.. => late = late.max((x - last).abs()),
            _ => {}
        }
        last = x;
    }
    assert!(early > 0.0);
    late / early
}

fn at_origin(grip: Grip, hand: Hand) -> SimulatedDevice {
    let path = MinJerkPath::hold(Pose::identity());
    SimulatedDevice::new(grip, hand, path, Point3::origin())
}

/// Critical stiffness from the exact eigenvalues of the sampled loop: (device damping, wall damping,
/// [delay 0, 0.5, 1, 2 ms]), N/m.
const CRITICAL: [(f64, f64, [f64; 4]); 6] = [
    (1.0, 0.0, [2002.0, 1001.0, 668.0, 401.0]),
    (1.0, 2.0, [5945.0, 2973.0, 1981.0, 1186.0]),
    (1.0, 5.0, [11714.0, 5857.0, 3895.0, 2321.0]),
    (1.0, 10.0, [20947.0, 10466.0, 6936.0, 4097.0]),
    (5.0, 0.0, [10042.0, 5026.0, 3356.0, 2021.0]),
    (5.0, 5.0, [19594.0, 9805.0, 6530.0, 3905.0]),
];

#[test]
fn a_released_device_turns_unstable_within_2_percent_of_the_critical_stiffness() {
    for (damping, wall_damping, critical) in CRITICAL {
        for (half_ms, critical) in [0_u32, 1, 2, 4].into_iter().zip(critical) {
            let delay = Duration::from_micros(500) * half_ms;
            let run = |stiffness| {
                let mut device = at_origin(grip(damping), Hand::RELEASED);
                growth(&mut device, stiffness, wall_damping, delay)
            };
            let (below, above) = (run(0.98 * critical), run(1.02 * critical));
            let case = format!("b {damping}, B {wall_damping}, delay {delay:?}");
            assert!(below < 1.0, "{case}: grows by {below} below {critical} N/m");
            assert!(
                above > 1.0,
                "{case}: decays by {above} above {critical} N/m"
            );
        }
    }
}

#[test]
fn a_light_hand_raises_the_critical_stiffness_by_its_damping() {
    for (delay, critical) in [(Duration::ZERO, 10_024.0), (TICK, 3347.0)] {
        let run = |stiffness| {
            growth(
                &mut at_origin(grip(1.0), Hand::LIGHT),
                stiffness,
                0.0,
                delay,
            )
        };
        assert!(run(0.96 * critical) < 1.0 && run(1.04 * critical) > 1.0);
    }
}

/// A reach to a pose 0.2 m and 1 rad away, in the body's own frame.
fn reach() -> (MinJerkPath, Pose) {
    let start = Pose::new(Vector3::new(0.0, 0.1, 0.3), Vector3::x() * 0.2);
    let end = Pose::new(Vector3::new(0.2, 0.1, 0.25), Vector3::new(0.0, 0.6, 0.8));
    let via_points = vec![
        ViaPoint {
            time_s: 0.0,
            pose: start,
        },
        ViaPoint {
            time_s: 1.0,
            pose: end,
        },
    ];
    (
        MinJerkPath::new(via_points, false).expect("a valid path"),
        end,
    )
}

const REFERENCE_POINT: Point3<f64> = Point3::new(0.03, -0.02, 0.05);

#[test]
fn in_free_space_the_device_comes_to_rest_at_the_intention() {
    for hand in [Hand::LIGHT, Hand::FIRM, Hand::ARM] {
        let (path, end) = reach();
        let mut device = SimulatedDevice::new(Grip::workbench(), hand, path, REFERENCE_POINT);
        for tick in 0..5000 {
            read(&mut device, TICK * tick);
        }
        let sample = read(&mut device, TICK * 5000);
        let off = sample.pose.inverse() * end;
        assert!(off.translation.vector.norm() < 1e-9, "{hand:?}: {off}");
        assert!(off.rotation.angle() < 1e-9, "{hand:?}: {off}");
        assert!(sample.velocity.norm() < 1e-8);
    }
}

#[test]
fn a_constant_wrench_pushes_the_hand_away_by_its_compliance() {
    let mut device = at_origin(Grip::workbench(), Hand::FIRM);
    let wrench = Vector6::new(0.0, 3.0, 0.0, 0.0, 0.0, 0.12);
    for tick in 0..4000 {
        let now = TICK * tick;
        read(&mut device, now);
        device.write(now, &wrench);
    }
    let pose = read(&mut device, TICK * 4000).pose;
    let expected = 3.0 / Hand::FIRM.stiffness;
    assert!((pose.translation.vector - Vector3::y() * expected).norm() < 1e-9);
    let turn = pose.rotation.scaled_axis();
    assert!((turn - Vector3::z() * (0.12 / Hand::FIRM.rotational_stiffness)).norm() < 1e-9);
}

#[test]
fn the_reported_velocity_is_the_derivative_of_the_reference_point() {
    let (path, _) = reach();
    let mut device = SimulatedDevice::new(Grip::workbench(), Hand::LIGHT, path, REFERENCE_POINT);
    read(&mut device, Duration::ZERO);
    let before = read(&mut device, Duration::from_micros(499_900));
    let here = read(&mut device, Duration::from_micros(500_000));
    let after = read(&mut device, Duration::from_micros(500_100));
    let travel = after.pose * REFERENCE_POINT - before.pose * REFERENCE_POINT;
    let turn = (after.pose.rotation * before.pose.rotation.inverse()).scaled_axis();
    assert!((travel / 2e-4 - here.velocity.fixed_rows::<3>(0)).norm() < 1e-6);
    assert!((turn / 2e-4 - here.velocity.fixed_rows::<3>(3)).norm() < 1e-5);
    assert!(here.velocity.norm() > 0.1);
}

/// Pushes 20 mm into a one-sided wall z < 0 of 1000 N/m, the force one tick late, for 4 s.
/// Returns the trace and the observer.
fn push_into_wall(hand: Hand, stiffness: f64) -> (Vec<DeviceSample>, EnergyObserver) {
    let via = |time_s, z| ViaPoint {
        time_s,
        pose: Pose::translation(0.0, 0.0, z),
    };
    let path = MinJerkPath::new(vec![via(0.0, 0.05), via(1.0, -0.02)], false);
    let mut device = SimulatedDevice::new(
        Grip::workbench(),
        hand,
        path.expect("a valid path"),
        Point3::origin(),
    );
    let mut energy = EnergyObserver::new(Point3::origin());
    let mut wrench = Vector6::zeros();
    let mut trace = Vec::new();
    for tick in 0..4000 {
        let now = TICK * tick;
        let sample = read(&mut device, now);
        device.write(now, &wrench);
        energy.step(&sample.pose, device.rendered_wrench());
        let depth = (-sample.pose.translation.vector.z).max(0.0);
        wrench = Vector6::z() * (stiffness * depth);
        trace.push(sample);
    }
    (trace, energy)
}

#[test]
fn a_light_hand_rests_quietly_on_a_wall_of_1000_newtons_per_metre() {
    let (trace, energy) = push_into_wall(Hand::LIGHT, 1000.0);
    let end: Vec<f64> = trace[3500..]
        .iter()
        .map(|s| s.pose.translation.vector.z)
        .collect();
    let (low, high) = (
        end.iter().copied().fold(f64::INFINITY, f64::min),
        end.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    );
    assert!(high - low < 1e-7, "still moves by {} m", high - low);
    // Where hand and wall balance: k_h (0.02 - d) = K d.
    let depth = Hand::LIGHT.stiffness * 0.02 / (1000.0 + Hand::LIGHT.stiffness);
    assert!((high + depth).abs() < 1e-6);
    // One bounce at 0.1 m/s may leak about K v^2 (1.5 T) for the 30 ms of its way out.
    assert!(energy.injected() < 1e-3, "injected {} J", energy.injected());
}

#[test]
fn the_same_push_without_damping_enough_never_rests() {
    // Far above (b + b_h) / (T/2 + t_d) = 4000 N/m.
    let (trace, energy) = push_into_wall(Hand::LIGHT, 12_000.0);
    let fastest = trace[3500..]
        .iter()
        .map(|s| s.velocity.norm())
        .fold(0.0, f64::max);
    assert!(fastest > 0.05, "{fastest} m/s");
    assert!(energy.injected() > 1e-2, "injected {} J", energy.injected());
}

#[test]
fn in_free_space_the_grip_trembles_by_60_micrometres() {
    let tremor = Tremor::new(Tremor::TYPICAL_RMS, 42);
    let mut device = at_origin(Grip::workbench(), Hand::LIGHT).with_tremor(tremor);
    // 2 s for the start to die away, then whole periods of every component.
    let samples: Vec<f64> = (0..12_000)
        .map(|tick| {
            read(&mut device, TICK * tick)
                .pose
                .translation
                .vector
                .norm_squared()
        })
        .skip(2000)
        .collect();
    let rms = (samples.iter().sum::<f64>() / samples.len() as f64).sqrt();
    assert!((rms / Tremor::TYPICAL_RMS - 1.0).abs() < 0.01, "{rms} m");
}

#[test]
fn a_hand_that_lets_go_trembles_no_more_and_the_device_stops() {
    let tremor = Tremor::new(Tremor::TYPICAL_RMS, 42);
    let mut device = at_origin(Grip::workbench(), Hand::FIRM).with_tremor(tremor);
    for tick in 0..1000 {
        read(&mut device, TICK * tick);
    }
    assert!(read(&mut device, TICK * 1000).velocity.norm() > 1e-4);
    device.set_hand(Hand::RELEASED);
    for tick in 1000..4000 {
        read(&mut device, TICK * tick);
    }
    assert!(read(&mut device, TICK * 4000).velocity.norm() < 1e-10);
}

fn bits(sample: &DeviceSample) -> Vec<u64> {
    let pose = sample
        .pose
        .translation
        .vector
        .iter()
        .chain(sample.pose.rotation.coords.iter());
    pose.chain(sample.velocity.iter())
        .map(|x| x.to_bits())
        .collect()
}

#[test]
fn the_same_inputs_give_the_same_bytes() {
    let run = |every: u32| {
        let (path, _) = reach();
        let mut device =
            SimulatedDevice::new(Grip::workbench(), Hand::LIGHT, path, REFERENCE_POINT)
                .with_tremor(Tremor::new(Tremor::TYPICAL_RMS, 9));
        let mut last = Vec::new();
        for tick in 0..=1400 {
            let now = TICK * tick;
            if tick % every == 0 {
                last = bits(&read(&mut device, now));
            }
            if tick == 700 {
                device.write(now, &Vector6::new(1.0, -2.0, 0.5, 0.01, 0.0, -0.02));
            }
        }
        last
    };
    assert_eq!(run(1), run(1));
    // Nor does it matter how often the device is looked at.
    assert_eq!(run(1), run(7));
}

#[test]
fn a_wrench_that_is_not_finite_moves_nothing() {
    let mut device = at_origin(Grip::workbench(), Hand::LIGHT);
    read(&mut device, Duration::ZERO);
    device.write(Duration::ZERO, &Vector6::repeat(f64::NAN));
    let sample = read(&mut device, TICK * 100);
    assert_eq!(sample.pose, Pose::identity());
    device.write(TICK * 100, &Vector6::repeat(f64::INFINITY));
    assert_eq!(read(&mut device, TICK * 200).pose, Pose::identity());
}

#[test]
fn after_a_long_silence_the_hand_takes_up_where_it_was() {
    let (path, _) = reach();
    let mut device = SimulatedDevice::new(Grip::workbench(), Hand::LIGHT, path, REFERENCE_POINT);
    let before = read(&mut device, TICK);
    // An hour: one second of it is simulated, in bounded time.
    let hour = Duration::from_secs(3600);
    let after = read(&mut device, hour);
    assert!(after.time <= hour && after.time + TICK > hour);
    assert!((after.pose.translation.vector - before.pose.translation.vector).norm() < 0.3);
    let next = read(&mut device, hour + TICK);
    assert!((next.pose.translation.vector - after.pose.translation.vector).norm() < 1e-3);
}
