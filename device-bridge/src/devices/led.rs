//! A body led to poses that another thread names, such as the mouse of a window: six degrees of freedom in, no force.
//!
//! | symbol | name in code        | unit | meaning                                        |
//! |--------|---------------------|------|------------------------------------------------|
//! | tau    | [`LAG_S`]           | s    | time constant of the approach to the target    |
//!
//! A mouse is read some tens of times a second and jumps. The body approaches its target with a time constant and a
//! bounded speed: v = (target - pose) / tau, no faster than [`SPEED`] on the workbench.

use std::time::Duration;

use nalgebra::{Vector3, Vector6};
use taut_plant::{displaced, stack};

use crate::device::{Device, DeviceFault, DeviceInfo, DeviceSample, Pose};
use crate::placement::Placement;

/// tau: two frames of a slow window.
const LAG_S: f64 = 0.04;
/// Fastest motion, m/s on the workbench.
const SPEED: f64 = 0.5;
/// Fastest turn, rad/s.
const TURN_RATE: f64 = 4.0;
/// Longest time that one step integrates.
const MAX_STEP: Duration = Duration::from_millis(20);

/// Where the body is to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// World from body.
    pub pose: Pose,
    /// One bit per button.
    pub buttons: u16,
}

/// The device. A target that is not finite is not followed.
pub struct LedDevice {
    info: DeviceInfo,
    targets: triple_buffer::Output<Target>,
    placement: Placement,
    /// World from a frame at G.
    pose: Pose,
    last: Option<Duration>,
}

impl LedDevice {
    /// A body at rest at its start, which goes where the newest of `targets` says.
    #[must_use]
    pub fn new(name: &str, targets: triple_buffer::Output<Target>, placement: Placement) -> Self {
        Self {
            info: DeviceInfo::without_force(name),
            targets,
            placement,
            pose: placement.at_reference_point(&placement.start),
            last: None,
        }
    }

    /// Velocity of G and angular velocity towards `target`, world axes.
    fn approach(&self, target: &Pose) -> (Vector3<f64>, Vector3<f64>) {
        let target = self.placement.at_reference_point(target);
        let missing = target.translation.vector - self.pose.translation.vector;
        let turn = (target.rotation * self.pose.rotation.inverse()).scaled_axis();
        let slower = self.placement.scale();
        (
            (missing / LAG_S).cap_magnitude(SPEED * slower),
            (turn / LAG_S).cap_magnitude(TURN_RATE),
        )
    }
}

impl Device for LedDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn scale(&self) -> f64 {
        self.placement.scale()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let last = self.last.replace(now).unwrap_or(now);
        let passed = now.saturating_sub(last).min(MAX_STEP).as_secs_f64();
        let target = *self.targets.read();
        let (linear, angular) = if target.pose.to_homogeneous().iter().all(|x| x.is_finite()) {
            self.approach(&target.pose)
        } else {
            (Vector3::zeros(), Vector3::zeros())
        };
        self.pose = displaced(&self.pose, &(linear * passed), &(angular * passed));
        Ok(DeviceSample {
            time: now,
            pose: self.placement.from_reference_point(&self.pose),
            velocity: stack(&linear, &angular),
            buttons: target.buttons,
        })
    }

    fn write(&mut self, _now: Duration, _wrench: &Vector6<f64>) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    fn led() -> (triple_buffer::Input<Target>, LedDevice) {
        let start = Pose::new(Vector3::new(0.0, 0.0, 0.1), Vector3::x() * 0.2);
        let first = Target {
            pose: start,
            buttons: 0,
        };
        let (input, output) = triple_buffer::TripleBuffer::new(&first).split();
        let placement = Placement::plain(start, Point3::new(0.01, 0.0, 0.02));
        (input, LedDevice::new("mouse", output, placement))
    }

    proptest! {
        #[test]
        fn it_arrives_at_any_target_and_is_never_too_fast(
            x in -0.3..0.3_f64, z in -0.3..0.3_f64, angle in -2.5..2.5_f64,
        ) {
            let (mut input, mut device) = led();
            let pose = Pose::new(Vector3::new(x, 0.0, z), Vector3::new(0.0, angle, 0.0));
            input.write(Target { pose, buttons: 3 });
            let mut last = device.placement.start;
            let g = device.placement.reference_point;
            for tick in 0..3000 {
                let sample = device.read(Duration::from_millis(tick)).expect("no fault");
                let step = (sample.pose * g - last * g).norm();
                prop_assert!(step <= SPEED * 1e-3 + 1e-12);
                prop_assert!(sample.pose.rotation.angle_to(&last.rotation) <= TURN_RATE * 1e-3 + 1e-9);
                last = sample.pose;
                prop_assert_eq!(sample.buttons, 3);
            }
            prop_assert!((last.translation.vector - pose.translation.vector).norm() < 1e-9);
            prop_assert!(last.rotation.angle_to(&pose.rotation) < 1e-7);
        }
    }

    #[test]
    fn a_target_that_is_not_finite_stops_it() {
        let (mut input, mut device) = led();
        let mut pose = Pose::identity();
        pose.translation.vector.y = f64::NAN;
        input.write(Target { pose, buttons: 0 });
        let before = device.read(Duration::ZERO).expect("no fault").pose;
        let after = device.read(Duration::from_millis(9)).expect("no fault");
        assert_eq!((after.pose, after.velocity), (before, Vector6::zeros()));
    }
}
