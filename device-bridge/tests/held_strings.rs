//! Strings in a simulated hand: the loop closes through counts and tensions, and a hand that rests is not taken for a frozen device.

use std::time::Duration;

use nalgebra::{Point3, UnitQuaternion, Vector3, Vector6};
use taut_bridge::{
    Command, Device, DeviceFault, DeviceInfo, DevicePort, DeviceSample, EventKind, Hand,
    HeldStrings, MinJerkPath, Pose, Rearm, SafetySettings, SpidarDevice, SpidarPlacement,
    StringsError, ViaPoint, simulated_spidar, string_geometry,
};
use taut_spidar::{Encoders, Geometry, Reading, StringFault, StringHardware, StringLosses};

use crate::support::ms;

/// G in the body's frame, off the grip's centre on purpose.
fn reference_point() -> Point3<f64> {
    Point3::new(0.004, -0.003, 0.002)
}

/// Axes of the frame in the world.
fn turned() -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::new(0.2, -0.4, 0.7))
}

fn path(points: &[(f64, Vector3<f64>)]) -> MinJerkPath {
    let via = |(time_s, position): &(f64, Vector3<f64>)| ViaPoint {
        time_s: *time_s,
        pose: Pose::from_parts(
            (*position).into(),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.1, -0.2)),
        ),
    };
    let points = points.iter().map(via).collect();
    MinJerkPath::new(points, false).unwrap_or_else(|error| panic!("{error}"))
}

fn held(name: &str, hand: Hand, path: MinJerkPath) -> SpidarDevice<HeldStrings> {
    let geometry = string_geometry(name).unwrap_or_else(|error| panic!("{error}"));
    let made = simulated_spidar(geometry, turned(), reference_point(), hand, path, None);
    made.unwrap_or_else(|error| panic!("{error}")).device
}

#[test]
fn a_wall_is_felt_through_counts_and_tensions() {
    const STIFFNESS: f64 = 500.0;
    for name in Geometry::shipped_names() {
        // 20 mm into the wall z < 0.
        let intention = path(&[
            (0.0, Vector3::z() * 0.02),
            (0.5, Vector3::z() * -0.02),
            (2.0, Vector3::z() * -0.02),
        ]);
        let mut device = held(name, Hand::FIRM, intention);
        let geometry = string_geometry(name).expect("shipped");
        let count = geometry.metres_per_count[0].abs();
        let (mut depth, mut off, mut turn) = (0.0, 0.0_f64, 0.0_f64);
        for tick in 0..2000 {
            let sample = device.read(ms(tick)).unwrap_or_else(|f| panic!("{f}"));
            let truth = device.hardware_mut().true_pose();
            let measured = sample.pose * reference_point();
            off = off.max((measured - truth * reference_point()).norm());
            turn = turn.max(sample.pose.rotation.angle_to(&truth.rotation));
            depth = -measured.z;
            device.write(ms(tick), &(Vector6::z() * (STIFFNESS * depth.max(0.0))));
        }
        // Within the encoders' steps.
        assert!(off < 4.0 * count, "{name}: {off} m");
        assert!(turn < 4.0 * count / geometry.arm(), "{name}: {turn} rad");
        // 500 N/m of the hand against 500 N/m of the wall: half-way. What the strings pull with nothing asked is not nothing.
        let felt = device.felt().expect("strings tell").wrench;
        let pulled = *device.hardware_mut().true_wrench();
        assert!((depth - 0.010).abs() < 1e-3, "{name}: {depth} m");
        assert!((felt[2] - 5.0).abs() < 0.6, "{name}: {felt}");
        let difference = (felt - pulled).fixed_rows::<3>(0).norm();
        assert!(difference < 0.05, "{name}: {difference} N");
    }
}

#[test]
fn what_the_motors_cannot_give_is_not_said_to_be_felt() {
    let mut device = held("g6x5r", Hand::ARM, path(&[(0.0, Vector3::zeros())]));
    let _ = device.read(ms(0));
    device.write(ms(0), &(Vector6::x() * 100.0));
    let felt = device.felt().expect("strings tell").wrench;
    let force: Vector3<f64> = felt.fixed_rows::<3>(0).into();
    assert!(force.norm() < 20.0 && force.x > 5.0, "{force}");
    assert!(force.yz().norm() < 0.01 * force.x, "the direction is kept");
}

/// What happens to a hand that moves.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    /// It comes to rest.
    Rests,
    /// It lets go at this tick.
    LetsGo(u64),
    /// From this tick on the counters stand still.
    CountersStop(u64),
}

/// A held device to which something happens.
struct Fated {
    device: SpidarDevice<Counting>,
    fate: Fate,
    tick: u64,
}

/// Electronics whose counters may stop.
struct Counting {
    held: HeldStrings,
    stopped: Option<[i32; 8]>,
    stop: bool,
}

impl StringHardware for Counting {
    fn read_counts(&mut self, now: Duration) -> Result<Reading, StringFault> {
        let reading = self.held.read_counts(now)?;
        let counts = if self.stop {
            *self.stopped.get_or_insert(reading.counts)
        } else {
            reading.counts
        };
        Ok(Reading { counts, ..reading })
    }

    fn write_tensions(&mut self, now: Duration, tensions: &[f64; 8]) {
        self.held.write_tensions(now, tensions);
    }
}

impl Device for Fated {
    fn info(&self) -> &DeviceInfo {
        self.device.info()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        self.tick += 1;
        let hardware = self.device.hardware_mut();
        match self.fate {
            Fate::LetsGo(tick) if tick == self.tick => hardware.held.set_hand(Hand::RELEASED),
            Fate::CountersStop(tick) => hardware.stop = self.tick >= tick,
            _ => {}
        }
        self.device.read(now)
    }

    fn write(&mut self, now: Duration, wrench: &Vector6<f64>) {
        self.device.write(now, wrench);
    }
}

/// What the port saw of 60 mm within `moving` s and a rest of 3 s: whether it told of a freeze, the largest speed (m/s), and how
/// many samples were the one before them to the bit.
fn seen(name: &str, hand: Hand, moving: f64, losses: StringLosses, fate: Fate) -> (bool, f64, u64) {
    let rest = moving + 3.0;
    let (from, to) = (Vector3::x() * -0.03, Vector3::x() * 0.03);
    let intention = path(&[(0.0, from), (moving, to), (rest, to)]);
    let geometry = string_geometry(name).unwrap_or_else(|error| panic!("{error}"));
    let (start, _) = intention.at(0.0);
    let placement = SpidarPlacement::around(
        Point3::origin(),
        turned(),
        start.rotation,
        reference_point(),
    );
    let hardware = Counting {
        held: HeldStrings::new(&geometry, losses, placement, hand, intention, None),
        stopped: None,
        stop: false,
    };
    let encoders = Encoders::calibrated(&geometry, &Pose::identity(), &[0; 8]);
    let device = Fated {
        device: SpidarDevice::calibrated(geometry, hardware, placement, encoders),
        fate,
        tick: 0,
    };
    let settings = SafetySettings {
        rearm: Rearm::Automatic,
        ..SafetySettings::default()
    };
    let mut port = DevicePort::new(Box::new(device), settings, reference_point(), &start);
    let (mut frozen, mut fastest, mut same) = (false, 0.0_f64, 0);
    let mut last = start;
    for tick in 1..(rest * 1e3) as u64 {
        let report = port.tick(ms(tick), |_| {
            Some(Command::fresh(ms(tick), Vector6::zeros()))
        });
        let mut kinds = report.events.iter().map(|event| event.kind);
        frozen |= kinds.any(|kind| kind == EventKind::DeviceFrozen);
        let sample = report.reading.sample;
        fastest = fastest.max(sample.velocity.fixed_rows::<3>(0).norm());
        same += u64::from(sample.pose == last);
        last = sample.pose;
    }
    (frozen, fastest, same)
}

#[test]
fn a_hand_that_comes_to_rest_is_no_frozen_device() {
    for name in Geometry::shipped_names() {
        for hand in [Hand::LIGHT, Hand::FIRM, Hand::ARM] {
            for moving in [0.08, 0.15, 0.3, 0.5] {
                let losses = StringLosses::default();
                let (frozen, fastest, same) = seen(name, hand, moving, losses, Fate::Rests);
                assert!(fastest > 0.1, "{name}: it moved at {fastest} m/s only");
                assert!(same > 500, "{name}: equal samples came: {same}");
                assert!(!frozen, "{name} in {moving} s");
            }
        }
    }
}

#[test]
fn a_grip_that_friction_stops_is_no_frozen_device() {
    for name in Geometry::shipped_names() {
        for coulomb in [0.02, 0.05, 0.1, 0.2, 0.4] {
            let losses = StringLosses {
                coulomb,
                loss: 0.02,
            };
            // Let go at the fastest of the movement: the strings' friction alone brakes.
            let fate = Fate::LetsGo(150);
            let (frozen, fastest, same) = seen(name, Hand::LIGHT, 0.3, losses, fate);
            assert!(fastest > 0.1, "{name}: it moved at {fastest} m/s only");
            assert!(
                !frozen,
                "{name} with {coulomb} N per string, {same} equal samples"
            );
        }
    }
}

#[test]
fn counters_that_stop_in_a_movement_are_a_frozen_device() {
    for name in Geometry::shipped_names() {
        let losses = StringLosses::default();
        let fate = Fate::CountersStop(150);
        let (frozen, ..) = seen(name, Hand::FIRM, 0.3, losses, fate);
        assert!(frozen, "{name}");
    }
}

#[test]
fn a_path_that_leaves_the_frame_is_told_before_anything_starts() {
    let refused = |name: &str, path: MinJerkPath| {
        let geometry = string_geometry(name).unwrap_or_else(|error| panic!("{error}"));
        simulated_spidar(
            geometry,
            turned(),
            reference_point(),
            Hand::FIRM,
            path,
            None,
        )
        .err()
    };
    let wide = path(&[(0.0, Vector3::zeros()), (1.0, Vector3::x() * 0.3)]);
    let Some(StringsError::PathOutside { mm, .. }) = refused("g6x3r", wide.clone()) else {
        panic!("0.3 m do not fit into 0.17 m");
    };
    assert!(mm > 0.0);
    assert!(refused("wb", wide).is_none());
    let via = |time_s, angle: f64| ViaPoint {
        time_s,
        pose: Pose::new(Vector3::zeros(), Vector3::x() * angle),
    };
    let turning = |angle| {
        let points = vec![via(0.0, 0.0), via(1.0, 0.5 * angle), via(2.0, angle)];
        MinJerkPath::new(points, false).unwrap_or_else(|error| panic!("{error}"))
    };
    // Half-way is rest, so 150 degrees in all are 75 to either side.
    assert!(refused("wb", turning(150_f64.to_radians())).is_none());
    let error = refused("wb", turning(175_f64.to_radians()));
    assert!(error.is_none(), "{error:?}");
    let error = string_geometry("no-such-device").expect_err("there is none");
    assert!(error.to_string().contains("g6x3r"));
}
