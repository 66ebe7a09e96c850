//! An arm: a cursor with three degrees of freedom of force, and an orientation that is measured or not; some can turn it, too.
//!
//! | frame     | meaning                                                                                       |
//! |-----------|-----------------------------------------------------------------------------------------------|
//! | device    | the arm's, as its driver names it                                                             |
//! | workbench | what the user sees; `axes` and `scale` of [`SensorMapping`] lead to it, from the workspace's middle |
//! | world     | the scene's ([`Placement`])                                                                   |
//!
//! The cursor, where the arm pushes, is at G, the body's reference point: so a force at G is a force at the cursor. A torque about G is
//! what an arm without motors for it cannot render. It is dropped, never turned into force. The orientation turns the body about G.

use std::time::Duration;

use nalgebra::{Isometry3, Vector3, Vector6};
use taut_plant::stack;
use taut_vrpn::{PoseReport, SensorMapping};

use crate::device::{Device, DeviceFault, DeviceInfo, DeviceLimits, DeviceSample, Pose};
use crate::devices::{Anchor, ArmState};
use crate::placement::Placement;

/// Of the loop around it, Hz.
pub(crate) const RATE_HZ: f64 = 1000.0;
/// A state older than this is none.
const MAX_AGE: Duration = Duration::from_millis(20);
/// Time constant of the angular velocity, which is not measured, s.
const TURN_LAG_S: f64 = 0.01;

/// An arm, and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmSettings {
    /// For people.
    pub name: String,
    /// What it bears, in its own metres.
    pub limits: DeviceLimits,
    /// Whether it may measure an orientation.
    pub with_orientation: bool,
    /// Middle of its workspace, its own axes, m.
    pub centre: Vector3<f64>,
    /// From its axes to the workbench's.
    pub mapping: SensorMapping,
    /// How the body follows.
    pub anchor: Anchor,
}

/// What speaks to an arm: a thread of its driver, or a test.
pub trait ArmPort: Send {
    /// What the device said last; neither waits nor allocates.
    fn newest(&mut self) -> ArmState;

    /// The torque that goes with the next [`Self::push`], N m, the device's axes; nothing for an arm that cannot turn a hand.
    fn twist(&mut self, _torque: [f64; 3]) {}

    /// Wants a force, N, the device's axes; likewise.
    fn push(&mut self, force: [f64; 3]);

    /// See [`Device::let_go`].
    fn let_go(&mut self) -> bool {
        false
    }
}

/// The device.
pub struct ArmDevice {
    info: DeviceInfo,
    port: Box<dyn ArmPort>,
    centre: Vector3<f64>,
    mapping: SensorMapping,
    anchor: Anchor,
    placement: Placement,
    /// Pose of the cursor on the workbench when the first state came, and of the body's frame at G then.
    anchored: Option<(Pose, Pose)>,
    /// The newest state that was taken, and when it was measured.
    seen: (u64, Duration),
    /// The sample of the newest state, frame at G.
    at_g: Pose,
    velocity: Vector6<f64>,
    was_lost: bool,
}

impl ArmDevice {
    /// A device behind `port`.
    #[must_use]
    pub fn new(port: Box<dyn ArmPort>, arm: ArmSettings, placement: Placement) -> Self {
        let mut limits = arm.limits;
        // A metre of the device is so many of the world: the same force over another way.
        limits.max_stiffness *= placement.workbench_from_world.scaling() / arm.mapping.scale;
        Self {
            info: DeviceInfo {
                name: arm.name,
                sensed_degrees_of_freedom: if arm.with_orientation { 6 } else { 3 },
                actuated_degrees_of_freedom: actuated(&limits),
                limits,
                rate_hz: RATE_HZ,
            },
            port,
            centre: arm.centre,
            mapping: arm.mapping,
            anchor: arm.anchor,
            placement,
            anchored: None,
            seen: (0, Duration::ZERO),
            at_g: placement.at_reference_point(&placement.start),
            velocity: Vector6::zeros(),
            was_lost: false,
        }
    }

    /// Where the cursor is on the workbench; `None` where the state is no pose.
    fn on_workbench(&self, state: &ArmState) -> Option<Pose> {
        let [w, i, j, k] = state.orientation.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let norm = (w * w + i * i + j * j + k * k).sqrt();
        let from_centre = Vector3::from(state.position) - self.centre;
        self.mapping.pose(&PoseReport {
            sensor: 0,
            position: from_centre.into(),
            // Unit within what the wire's steps allow, and exactly so from here on; NaN is refused there.
            rotation: [i, j, k, w].map(|part| part / norm),
        })
    }

    /// Where the body's frame at G is for a cursor at `cursor` on the workbench.
    fn target(&mut self, cursor: &Pose, has_grip: bool) -> Pose {
        if self.anchor == Anchor::Workbench {
            let pose = self.placement.pose_in_world(cursor);
            // Without a grip nothing turns the body.
            let turned = if has_grip { pose } else { self.placement.start };
            return Isometry3::from_parts(pose.translation, turned.rotation);
        }
        let start = self.placement.at_reference_point(&self.placement.start);
        let (cursor_then, body_then) = *self.anchored.get_or_insert((*cursor, start));
        self.placement.carried(&body_then, &cursor_then, cursor)
    }

    fn take(&mut self, now: Duration, state: &ArmState) -> Result<(), DeviceFault> {
        let cursor = self.on_workbench(state).ok_or(DeviceFault::NotFinite)?;
        let next = self.target(&cursor, state.orientation.is_some());
        // Not before the one before it: ages are said more coarsely than states come.
        let measured = now.saturating_sub(state.age).max(self.seen.1);
        let passed = (measured - self.seen.1).as_secs_f64();
        let is_first = self.seen.0 == 0 || self.was_lost || passed > MAX_AGE.as_secs_f64();
        let turned = (next.rotation * self.at_g.rotation.inverse()).scaled_axis();
        let before: Vector3<f64> = self.velocity.fixed_rows::<3>(3).into();
        let turning = if let Some(measured) = state.turning {
            let turning = self.hand() * (self.mapping.axes.matrix() * Vector3::from(measured));
            let turning = self.mapping.origin.rotation * turning;
            self.placement.rotation_in_world(&turning)
        } else if is_first {
            Vector3::zeros()
        } else if passed > 0.0 {
            before + (turned / passed - before) * (passed / (passed + TURN_LAG_S))
        } else {
            before // measured when the last one was, as where a driver says a measurement again
        };
        let moving =
            self.mapping.axes.matrix() * Vector3::from(state.velocity) * self.mapping.scale;
        let moving = self.mapping.origin.rotation * moving;
        self.velocity = stack(&self.placement.vector_in_world(&moving), &turning);
        self.at_g = next;
        self.seen = (state.reports, measured);
        Ok(())
    }

    /// -1 where the axes are a mirror image: what turns one way is seen to turn the other.
    fn hand(&self) -> f64 {
        self.mapping.axes.matrix().determinant().signum()
    }

    /// A vector of the world in the arm's axes; a force has a direction, and no scale.
    fn in_arm(&self, in_world: Vector3<f64>) -> Vector3<f64> {
        let on_workbench = self.placement.workbench_from_world.isometry.rotation * in_world;
        let unturned = self.mapping.origin.rotation.inverse() * on_workbench;
        self.mapping.axes.matrix().transpose() * unturned
    }

    fn lose(&mut self, fault: DeviceFault) -> DeviceFault {
        self.was_lost = true;
        fault
    }
}

impl Device for ArmDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let state = self.port.newest();
        if state.reports == 0 {
            return Err(DeviceFault::NotStarted);
        }
        let is_new = state.reports != self.seen.0;
        let age = if is_new {
            state.age
        } else {
            now.saturating_sub(self.seen.1)
        };
        if !state.is_usable || age > MAX_AGE {
            return Err(self.lose(DeviceFault::Lost { age }));
        }
        if is_new && let Err(fault) = self.take(now, &state) {
            return Err(self.lose(fault));
        }
        if std::mem::replace(&mut self.was_lost, false) {
            return Err(DeviceFault::Reconnected);
        }
        Ok(DeviceSample {
            time: self.seen.1,
            pose: self.placement.from_reference_point(&self.at_g),
            velocity: self.velocity,
            buttons: state.buttons,
        })
    }

    fn write(&mut self, _now: Duration, wrench: &Vector6<f64>) {
        let is_finite = wrench.iter().all(|part| part.is_finite());
        let wrench = if is_finite { *wrench } else { Vector6::zeros() };
        if self.info.actuated_degrees_of_freedom == 6 {
            let torque = self.hand() * self.in_arm(wrench.fixed_rows::<3>(3).into());
            self.port.twist(torque.into());
        }
        self.port
            .push(self.in_arm(wrench.fixed_rows::<3>(0).into()).into());
    }

    fn scale(&self) -> f64 {
        self.mapping.scale * self.placement.scale()
    }

    fn let_go(&mut self) -> bool {
        self.port.let_go()
    }
}

/// Degrees of freedom of its motors.
fn actuated(limits: &DeviceLimits) -> u8 {
    match limits {
        limits if *limits == DeviceLimits::UNLIMITED => 0, // no motors
        limits if limits.max_torque > 0.0 => 6,
        _ => 3,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use nalgebra::Point3;

    use super::*;
    use crate::devices::PolhemSettings;
    use crate::ms;
    use crate::port::{ArmingState, Command, DevicePort, SafetySettings};

    struct Said(Arc<Mutex<ArmState>>);

    impl ArmPort for Said {
        fn newest(&mut self) -> ArmState {
            *self.0.lock().expect("whole")
        }

        fn push(&mut self, _force: [f64; 3]) {}
    }

    fn arm() -> (Arc<Mutex<ArmState>>, ArmDevice) {
        let said = Arc::<Mutex<ArmState>>::default();
        let placement = Placement::plain(Pose::identity(), Point3::origin());
        let arm = PolhemSettings::at("here").arm();
        let device = ArmDevice::new(Box::new(Said(Arc::clone(&said))), arm, placement);
        (said, device)
    }

    /// State number `reports`, of `age`: 0.1 m/s along an axis.
    fn state(reports: u64, age: Duration) -> ArmState {
        ArmState {
            reports,
            is_usable: true,
            age,
            position: [1e-4 * reports as f64, 0.0, 0.0],
            ..ArmState::default()
        }
    }

    #[test]
    fn a_sample_is_as_old_as_its_driver_says() {
        let (said, mut device) = arm();
        // The third says that it is older than the second: it is not.
        for (reports, age, measured) in [(1, 5, 96), (2, 5, 97), (3, 12, 97), (4, 0, 104)] {
            *said.lock().expect("whole") = state(reports, ms(age));
            let sample = device.read(ms(100 + reports)).expect("a sample");
            assert_eq!(sample.time, ms(measured), "{reports}");
        }
        *said.lock().expect("whole") = state(5, ms(19));
        assert!(device.read(ms(105)).is_ok());
        assert!(device.read(ms(124)).is_ok());
        assert_eq!(
            device.read(ms(125)),
            Err(DeviceFault::Lost { age: ms(21) }),
            "since it was measured"
        );
    }

    #[test]
    fn a_measurement_that_is_said_again_stops_no_turn() {
        let (said, mut device) = arm();
        let mut last = 0.0;
        for time in 0..100_u64 {
            // 2 rad/s, measured each 5 ms, and said each millisecond.
            let half = 1e-3 * (time / 5 * 5) as f64;
            *said.lock().expect("whole") = ArmState {
                orientation: Some([half.cos(), 0.0, 0.0, half.sin()]),
                ..state(1 + time, ms(time % 5))
            };
            let sample = device.read(ms(1000 + time)).expect("a sample");
            let turning = sample.velocity.fixed_rows::<3>(3).norm();
            assert!(turning >= last - 1e-9, "{turning} after {last} at {time}");
            last = turning;
        }
        assert!((1.8..2.001).contains(&last), "{last} rad/s");
    }

    #[test]
    fn no_force_120_ms_after_the_last_state_was_measured() {
        for age in [0, 10, 19] {
            let (said, device) = arm();
            let settings = SafetySettings::default();
            let start = Pose::identity();
            let mut port = DevicePort::new(Box::new(device), settings, Point3::origin(), &start);
            let push = Vector6::new(0.0, 0.0, 2.0, 0.0, 0.0, 0.0);
            for time in 1..1200 {
                if time <= 1000 {
                    *said.lock().expect("whole") = state(time, ms(age));
                }
                let now = ms(1000 + time);
                let report = port.tick(now, |_| Some(Command::fresh(now, push)));
                let felt = report.wrench.norm();
                if time == 1000 {
                    assert_eq!(report.state, ArmingState::Armed, "{age}");
                }
                if time >= 1120 - age {
                    assert_eq!(felt, 0.0, "{age} ms old, at {time} ms");
                }
            }
        }
    }
}
