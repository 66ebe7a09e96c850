//! A simulated six-degree-of-freedom impedance device in a simulated hand: a closed loop without hardware.
//!
//! The hand follows its scripted intention and trembles; the wrench written to the device pushes it back.
//! The simulation ([`taut_plant::Plant`]) advances on a fixed grid of 0.1 ms from the first call on, so a sample lies less than
//! one step before `now`, and the same sequence of calls gives the same bytes.

use std::time::Duration;

use nalgebra::{Point3, Vector6};
use taut_plant::{Grip, Hand, MinJerkPath, Plant, Tremor};

use crate::device::{Device, DeviceFault, DeviceInfo, DeviceLimits, DeviceSample};
use crate::placement::{at_point, off_point};

/// Grid of the simulation: a tenth of a 1 kHz tick.
const STEP: Duration = Duration::from_micros(100);

const RATE_HZ: f64 = 1000.0;

/// Delay of the force by the loop itself, assumed for the stated stability limits: one tick, as in a loop that computes the
/// force of a sample while the previous force is rendered.
const LOOP_DELAY_S: f64 = 1.0 / RATE_HZ;

/// Most that is simulated in one call. After a longer silence the hand's time has stood still.
const LONGEST_SILENCE: Duration = Duration::from_secs(1);

/// A grip in a hand, moved by an intention and a wrench.
#[derive(Clone, Debug)]
pub struct SimulatedDevice {
    info: DeviceInfo,
    plant: Plant,
    reference_point: Point3<f64>,
    /// Time of the first call.
    epoch: Option<Duration>,
    /// Time since `epoch` on the grid, simulated or skipped.
    elapsed: Duration,
}

impl SimulatedDevice {
    /// A device at rest where `path` begins. `path` holds poses of the body's own frame; `reference_point`
    /// is G in that frame. The path's time 0 is the first call of [`Device::read`].
    #[must_use]
    pub fn new(grip: Grip, hand: Hand, path: MinJerkPath, reference_point: Point3<f64>) -> Self {
        let path = path.map(|pose| at_point(pose, &reference_point));
        Self {
            info: DeviceInfo {
                limits: limits(&grip),
                rate_hz: RATE_HZ,
                ..DeviceInfo::ideal("simulated", 6)
            },
            plant: Plant::new(grip, hand, path),
            reference_point,
            epoch: None,
            elapsed: Duration::ZERO,
        }
    }

    /// Lets the hand tremble: in free space the grip moves by exactly this displacement. Only a hand that
    /// holds the grip trembles.
    #[must_use]
    pub fn with_tremor(mut self, tremor: Tremor) -> Self {
        self.plant = self.plant.with_tremor(tremor);
        self
    }

    /// Replaces the hand, such as by [`Hand::RELEASED`]; pose and velocity go on.
    pub fn set_hand(&mut self, hand: Hand) {
        self.plant.set_hand(hand);
    }

    /// The wrench that the motors render now: the last one written, saturated as the motors are.
    #[must_use]
    pub fn rendered_wrench(&self) -> &Vector6<f64> {
        self.plant.rendered_wrench()
    }

    /// Simulates the whole steps that fit before `now`.
    fn advance(&mut self, now: Duration) {
        let epoch = *self.epoch.get_or_insert(now);
        let passed = now.saturating_sub(epoch).as_nanos();
        let grid = Duration::from_nanos((passed - passed % STEP.as_nanos()) as u64);
        let due = grid.saturating_sub(self.elapsed);
        self.plant
            .advance(self.plant.time() + due.min(LONGEST_SILENCE));
        self.elapsed += due;
    }
}

impl Device for SimulatedDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        self.advance(now);
        Ok(DeviceSample {
            time: self.epoch.unwrap_or(now) + self.elapsed,
            pose: off_point(&self.plant.measured_pose(), &self.reference_point),
            velocity: *self.plant.velocity(),
            buttons: 0,
        })
    }

    fn write(&mut self, now: Duration, wrench: &Vector6<f64>) {
        self.advance(now);
        self.plant.command(wrench);
    }
}

/// What the device renders faithfully with nobody to hold it: the largest stable stiffnesses of the loop and the motors' limits.
fn limits(grip: &Grip) -> DeviceLimits {
    let (max_stiffness, max_rotational_stiffness) =
        grip.critical_stiffness(1.0 / RATE_HZ, LOOP_DELAY_S);
    DeviceLimits {
        max_stiffness,
        max_rotational_stiffness,
        max_force: grip.max_force,
        max_torque: grip.max_torque,
    }
}
