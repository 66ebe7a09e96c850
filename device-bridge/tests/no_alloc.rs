//! What runs in a 1 kHz loop takes no memory from the heap.

use std::time::Duration;

use assert_no_alloc::assert_no_alloc;
use nalgebra::{Point3, Vector6};
use taut_bridge::edge::EdgeCoupler;
use taut_bridge::{
    ArmDevice, ArmPort, ArmState, AtEnd, Command, DEFAULT_MAX_AGE, Device, DeviceLimits,
    DevicePort, DeviceSample, Grip, Hand, HaplySettings, MinJerkPath, Passivity, PassivitySettings,
    Placement, Pose, RecordedDevice, RemoteDevice, SafetySettings, SimulatedDevice, TraceSample,
    Tremor,
};
use taut_link::DeviceInput;
use taut_link::proto::constraints::ConstraintRow;
use taut_link::proto::coupling::{EdgeAdaptation, EdgeSettings, EdgeSurface};
use taut_link::proto::{ConstraintSet, EdgeCoupling, InputSample, PoseF64};

/// Two seconds of ticks, with a silence in the middle, damping on, and events on the way.
fn drive(device: impl Device + 'static, before_tick: &mut dyn FnMut(u64)) {
    let settings = SafetySettings {
        passivity: PassivitySettings::of(Passivity::Control),
        ..SafetySettings::default()
    };
    let start = Pose::identity();
    let mut port = DevicePort::new(Box::new(device), settings, Point3::origin(), &start);
    let (mut good, mut felt, mut events) = (0, 0, 0);
    assert_no_alloc(|| {
        for tick in 0..2000 {
            let now = Duration::from_millis(tick);
            before_tick(tick);
            let report = port.tick(now, |reading| {
                let wrench = Vector6::repeat(reading.sample.pose.translation.vector.z * 1e3 + 1.0);
                let mut command = Command::fresh(now, wrench);
                if (500..900).contains(&tick) {
                    command.origin = Duration::ZERO;
                }
                Some(command)
            });
            good += u32::from(report.reading.fault.is_none());
            felt += u32::from(report.wrench != Vector6::zeros());
            events += report.events.iter().count();
        }
    });
    assert!(
        good > 1000 && felt > 500 && events > 2,
        "{good}, {felt}, {events}"
    );
}

#[test]
fn a_simulated_device_does_not_allocate() {
    let path = MinJerkPath::sway(Pose::translation(0.0, 0.1, 0.02), 0.03, 0.7);
    let device = SimulatedDevice::new(Grip::workbench(), Hand::LIGHT, path, Point3::origin())
        .with_tremor(Tremor::new(Tremor::TYPICAL_RMS, 4));
    drive(device, &mut |_| {});
}

#[test]
fn a_recorded_device_does_not_allocate() {
    let row = |index: u32| TraceSample {
        time: f64::from(index) * 0.013,
        pose: Pose::translation(0.0, 0.0, 1e-2 * f64::from(index % 3)),
        buttons: 0,
    };
    let trace = (0..100).map(row).collect();
    let device = RecordedDevice::new(trace, AtEnd::Loop, Point3::origin());
    drive(device.expect("a valid trace"), &mut |_| {});
}

/// What the thread of the Inverse service's client hands over.
struct Recorded(triple_buffer::Output<ArmState>, [f64; 3]);

impl ArmPort for Recorded {
    fn newest(&mut self) -> ArmState {
        *self.0.read()
    }

    fn push(&mut self, force: [f64; 3]) {
        self.1 = force;
    }
}

#[test]
fn a_haply_arm_does_not_allocate() {
    let (mut states, newest) = triple_buffer::TripleBuffer::new(&ArmState::default()).split();
    let placement = Placement::plain(Pose::identity(), Point3::origin());
    let arm = Box::new(Recorded(newest, [0.0; 3]));
    let device = ArmDevice::new(arm, HaplySettings::default().arm(), placement);
    drive(device, &mut |tick| {
        let height = 1e-3 * (tick as f64 * 0.01).sin();
        states.write(ArmState {
            reports: tick + 1,
            is_usable: true,
            position: [0.0, -0.1, 0.16 + height],
            orientation: Some([1.0, 0.0, 0.0, 0.0]),
            ..ArmState::default()
        });
    });
}

#[test]
fn a_remote_device_does_not_allocate() {
    let (mut inputs, output) = triple_buffer::TripleBuffer::new(&None).split();
    let (device, _commands) = RemoteDevice::new(output, DeviceLimits::UNLIMITED, DEFAULT_MAX_AGE);
    drive(device, &mut |tick| {
        inputs.write(Some(DeviceInput {
            sample: InputSample {
                sample_time_ns: tick * 1_000_000 + 1,
                clock_uncertainty_ns: 1000,
                index: tick + 1,
                pose: PoseF64::IDENTITY,
                velocity: [0.0; 6],
                buttons: 0,
                flags: 0,
                rendered: [0.0; 6],
                set_made_ns: 0,
            },
            received_ns: tick * 1_000_000,
            session: 1,
        }));
    });
}

fn offer() -> EdgeCoupling {
    let surface = |friction| EdgeSurface {
        pose: PoseF64::IDENTITY,
        friction,
        sine: None,
    };
    EdgeCoupling {
        mass: 1.0,
        inertia: [1e-3, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 1e-3],
        reference_point: [0.0; 3],
        radius: 0.02,
        settings: EdgeSettings {
            k_s: 0.5,
            k_h: 2000.0,
            damping_time: 0.01,
            radius_of_gyration: None,
            adaptation: Some(EdgeAdaptation {
                duration: 0.02,
                threshold: -1e-3,
            }),
            look_ahead: true,
            passive: true,
            force_limit: 20.0,
            torque_limit: 0.5,
            rest_distance: 4e-6,
            minimum_gap: 4e-7,
            gap_tolerance: 4e-8,
            activation_distance: 1.6e-4,
            look_ahead_limit: 0.16,
            look_ahead_pairs: 1000,
            motion_tolerance: 2e-8,
            max_constraints: 1024,
            max_substeps: 10,
            implicit_rounds: 2,
            max_advancement_steps: 200,
            work_budget: None,
        },
        set_rate_hz: 1000.0,
        obstacles: vec![surface(0.0), surface(0.3)],
    }
}

/// Rows come and go, up to the capacity; half of them are rough.
fn sets() -> Vec<ConstraintSet> {
    (0..200_u16)
        .map(|k| {
            let mut set = ConstraintSet::new();
            set.head.sequence = u64::from(k);
            let rows = if k == 100 { 1024 } else { k % 40 };
            set.rows.extend((0..rows).map(|row| ConstraintRow {
                obstacle: row % 2,
                arm: [f32::from(row % 7) * 1e-3, 0.0, -0.02],
                normal: [0.0, 0.0, 1.0],
                ..ConstraintRow::default()
            }));
            set.rows.sort_by_key(|row| row.obstacle);
            set
        })
        .collect()
}

#[test]
fn coupling_at_the_edge_does_not_allocate() {
    let mut coupler = EdgeCoupler::new(&offer()).expect("an offer");
    let sets = sets();
    let mut forces = 0;
    assert_no_alloc(|| {
        for (tick, set) in (0..).zip(&sets) {
            let now = Duration::from_millis(tick);
            let sample = DeviceSample {
                time: now,
                pose: Pose::translation(0.0, 1e-5 * tick as f64, -1e-3),
                velocity: Vector6::zeros(),
                buttons: 0,
            };
            let taken = coupler.take(set, now);
            let felt = coupler.step(now, &sample);
            let pushes = felt.is_some_and(|felt| felt.wrench[2] > 0.0);
            forces += u32::from(taken.is_ok() && pushes);
        }
    });
    assert!(forces > 100, "{forces}");
}
