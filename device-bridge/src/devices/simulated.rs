//! A simulated six-degree-of-freedom impedance device in a simulated hand: a closed loop without hardware.
//!
//! The hand follows its scripted intention and trembles; the wrench written to the device pushes it back.
//! The simulation advances on a fixed grid of 0.1 ms from the first call on, so a sample lies less than
//! one step before `now`, and the same sequence of calls gives the same bytes.

use std::time::Duration;

use nalgebra::{Isometry3, Point3, Vector3, Vector6};

use super::grip::{Drive, Grip, GripInHand, STEP};
use super::hand::Hand;
use super::min_jerk::MinJerkPath;
use super::tremor::Tremor;
use crate::device::{Device, DeviceFault, DeviceInfo, DeviceLimits, DeviceSample, Pose};

/// Sample rate of the simulated device.
const RATE_HZ: f64 = 1000.0;

/// Delay of the force assumed for the stated stability limits: one tick, as in a loop that computes the
/// force of a sample while the previous force is rendered.
const DELAY_S: f64 = 1.0 / RATE_HZ;

/// Most internal steps in one call (1 s). After a longer silence the hand's time has stood still.
const MAX_STEPS: u64 = 10_000;

/// A grip in a hand, moved by an intention and a wrench.
#[derive(Clone, Debug)]
pub struct SimulatedDevice {
    info: DeviceInfo,
    grip: Grip,
    state: GripInHand,
    /// Intention of G.
    path: MinJerkPath,
    tremor: Option<Tremor>,
    reference_point: Point3<f64>,
    wrench: Vector6<f64>,
    /// Time of the first call.
    epoch: Option<Duration>,
    /// Grid steps since `epoch`, simulated or skipped.
    elapsed: u64,
    /// Grid steps simulated.
    simulated: u64,
}

impl SimulatedDevice {
    /// A device at rest where `path` begins. `path` holds poses of the body's own frame; `reference_point`
    /// is G in that frame. The path's time 0 is the first call of [`Device::read`].
    #[must_use]
    pub fn new(grip: Grip, hand: Hand, path: MinJerkPath, reference_point: Point3<f64>) -> Self {
        let path = path.map(|pose| at_reference_point(pose, &reference_point));
        let (start, _) = path.at(0.0);
        let (max_stiffness, max_rotational_stiffness) =
            grip.critical_stiffness(1.0 / RATE_HZ, DELAY_S);
        let info = DeviceInfo {
            name: "simulated".to_owned(),
            sensed_degrees_of_freedom: 6,
            actuated_degrees_of_freedom: 6,
            limits: DeviceLimits {
                max_stiffness,
                max_rotational_stiffness,
                max_force: grip.max_force,
                max_torque: grip.max_torque,
            },
            rate_hz: RATE_HZ,
        };
        Self {
            info,
            grip,
            state: GripInHand::new(grip, hand, start),
            path,
            tremor: None,
            reference_point,
            wrench: Vector6::zeros(),
            epoch: None,
            elapsed: 0,
            simulated: 0,
        }
    }

    /// Lets the hand tremble: in free space the grip moves by exactly this displacement. Only a hand that
    /// holds the grip trembles.
    #[must_use]
    pub fn with_tremor(mut self, tremor: Tremor) -> Self {
        self.tremor = self.state.is_held().then_some(tremor);
        self
    }

    /// Replaces the hand, such as by [`Hand::RELEASED`]; pose and velocity go on.
    pub fn set_hand(&mut self, hand: Hand) {
        self.state.set_hand(hand);
        if !self.state.is_held() {
            self.tremor = None;
        }
    }

    /// The wrench that the motors render now: the last one written, saturated.
    #[must_use]
    pub fn rendered_wrench(&self) -> &Vector6<f64> {
        &self.wrench
    }

    /// Simulates the whole steps that fit before `now`.
    fn advance(&mut self, now: Duration) {
        let epoch = *self.epoch.get_or_insert(now);
        let target = (now.saturating_sub(epoch).as_nanos() / STEP.as_nanos()) as u64;
        let due = target.saturating_sub(self.elapsed);
        for _ in 0..due.min(MAX_STEPS) {
            self.step();
        }
        self.elapsed += due;
    }

    fn step(&mut self) {
        // The intention at the middle of the step stands for the whole step: second-order accurate.
        let time_s = (self.simulated as f64 + 0.5) * STEP.as_secs_f64();
        let (intended_pose, intended_velocity) = self.path.at(time_s);
        let tremor_force = self.tremor.as_ref().map_or(Vector3::zeros(), |tremor| {
            let motion = tremor.at(time_s);
            self.state
                .force_for(&motion.displacement, &motion.velocity, &motion.acceleration)
        });
        self.state.step(&Drive {
            wrench: self.wrench,
            intended_pose,
            intended_velocity,
            tremor_force,
        });
        self.simulated += 1;
    }
}

impl Device for SimulatedDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        self.advance(now);
        let grid = Duration::from_nanos(self.elapsed * STEP.as_nanos() as u64);
        Ok(DeviceSample {
            time: self.epoch.unwrap_or(now) + grid,
            pose: from_reference_point(&self.state.pose, &self.reference_point),
            velocity: self.state.velocity,
            buttons: 0,
        })
    }

    fn write(&mut self, now: Duration, wrench: &Vector6<f64>) {
        self.advance(now);
        self.wrench = self.grip.saturated(wrench);
    }
}

/// World from a frame at G, parallel to the body's, of a body whose own frame is at `pose`.
fn at_reference_point(pose: &Pose, reference_point: &Point3<f64>) -> Pose {
    Isometry3::from_parts((pose * reference_point).into(), pose.rotation)
}

/// The inverse of [`at_reference_point`].
fn from_reference_point(pose: &Pose, reference_point: &Point3<f64>) -> Pose {
    let lever = pose.rotation * reference_point.coords;
    Isometry3::from_parts((pose.translation.vector - lever).into(), pose.rotation)
}
