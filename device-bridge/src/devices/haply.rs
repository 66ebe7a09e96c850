//! A Haply Inverse arm, with or without a VerseGrip: three degrees of freedom of force, six (or three) of motion.
//!
//! | frame     | meaning                                                                                    |
//! |-----------|--------------------------------------------------------------------------------------------|
//! | device    | the arm's: x right, y away from the user, z up (the service's basis XYZ), origin at its base |
//! | workbench | what the user sees; `axes` and `scale` of [`SensorMapping`] lead to it                      |
//! | world     | the scene's ([`Placement`])                                                                 |
//!
//! The cursor, where the arm pushes, is at G, the body's reference point: so a force at G is a force at the cursor, and a torque about G is
//! what this device cannot render. It is dropped, never turned into force. The grip turns the body about G.
//!
//! Force limit, damping, mass and axes are assumed: no device was at hand, and the vendor publishes none of them with its protocol.

use std::time::Duration;

use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector3, Vector6};
use taut_plant::Grip;
use taut_vrpn::{PoseReport, SensorMapping};

use crate::choice::ForceDevice;
use crate::device::{Device, DeviceFault, DeviceInfo, DeviceLimits, DeviceSample, Pose};
use crate::devices::Anchor;
use crate::haply::{
    ExchangeSettings, HaplyClient, HaplyError, HaplyState, ServiceAddress, workspace_centre,
};
use crate::placement::{Placement, stacked};

/// The client's messages, and the loop around them, Hz.
const RATE_HZ: f64 = 1000.0;
/// From a reading to the force that answers it: a period in the loop, as much on the wire.
const DELAY_S: f64 = 2.0 / RATE_HZ;
/// A state older than this is none.
const MAX_AGE: Duration = Duration::from_millis(20);
/// Time constant of the angular velocity, which the grip does not measure, s.
const TURN_LAG_S: f64 = 0.01;

/// The arm's mechanics as they are assumed: to be measured on a real one.
#[must_use]
pub(crate) fn haply_grip() -> Grip {
    Grip {
        mass: 0.1,                                 // kg
        damping: Vector3::repeat(1.0),             // N s/m
        rotational_inertia: 2e-5,                  // kg m^2
        rotational_damping: Vector3::repeat(1e-4), // N m s/rad
        coulomb_force: Vector3::zeros(),
        coulomb_torque: Vector3::zeros(),
        string_inertia: Matrix6::zeros(),
        max_force: 5.0, // N
        max_torque: 0.0,
    }
}

/// What an arm of this kind bears, N and N/m in the device's own metres.
#[must_use]
pub fn haply_limits() -> DeviceLimits {
    let (max_stiffness, _) = haply_grip().critical_stiffness(1.0 / RATE_HZ, DELAY_S);
    DeviceLimits {
        max_stiffness,
        max_rotational_stiffness: 0.0,
        max_force: haply_grip().max_force,
        max_torque: 0.0,
    }
}

/// An arm as a device.
#[derive(Clone, Debug, PartialEq)]
pub struct HaplySettings {
    /// Of the service.
    pub address: ServiceAddress,
    /// Which arm, which grip.
    pub exchange: ExchangeSettings,
    /// From the arm's frame to the workbench's.
    pub mapping: SensorMapping,
    /// How the body follows.
    pub anchor: Anchor,
}

impl HaplySettings {
    /// What the arm is assumed to bear.
    #[must_use]
    pub fn force_device(&self) -> ForceDevice {
        ForceDevice {
            grip: haply_grip(),
            delay_s: DELAY_S - 1.0 / RATE_HZ,
            scale: self.mapping.scale,
            renders_torque: false,
        }
    }
}

impl Default for HaplySettings {
    fn default() -> Self {
        Self {
            address: ServiceAddress::default(),
            exchange: ExchangeSettings::default(),
            mapping: SensorMapping::identity(),
            anchor: Anchor::default(),
        }
    }
}

/// What speaks to the service: a [`HaplyClient`], or a test.
pub trait HaplyPort: Send {
    /// What the device said last; neither waits nor allocates.
    fn newest(&mut self) -> HaplyState;

    /// Wants a force, N, the device's axes; likewise.
    fn push(&mut self, force: [f64; 3]);
}

impl HaplyPort for HaplyClient {
    fn newest(&mut self) -> HaplyState {
        *Self::newest(self)
    }

    fn push(&mut self, force: [f64; 3]) {
        Self::push(self, force);
    }
}

/// The device.
pub struct HaplyDevice {
    info: DeviceInfo,
    port: Box<dyn HaplyPort>,
    mapping: SensorMapping,
    anchor: Anchor,
    placement: Placement,
    /// Pose of the cursor on the workbench when the first state came, and of the body's frame at G then.
    anchored: Option<(Pose, Pose)>,
    seen: (u64, Duration),
    /// The sample of the newest state, frame at G.
    at_g: Pose,
    velocity: Vector6<f64>,
    was_lost: bool,
}

impl HaplyDevice {
    /// Connects to the service.
    ///
    /// # Errors
    /// [`HaplyError`]: it is not there, or too old. An arm that is not there yet is waited for.
    pub fn open(
        settings: &HaplySettings,
        placement: Placement,
        priority: u8,
    ) -> Result<Self, HaplyError> {
        let client = HaplyClient::start(
            settings.address.clone(),
            settings.exchange.clone(),
            priority,
        )?;
        Ok(Self::new(Box::new(client), settings, placement))
    }

    /// A device behind `port`.
    #[must_use]
    pub fn new(port: Box<dyn HaplyPort>, settings: &HaplySettings, placement: Placement) -> Self {
        let mut limits = haply_limits();
        // A metre of the device is so many of the world: the same force over another way.
        limits.max_stiffness *= placement.workbench_from_world.scaling() / settings.mapping.scale;
        Self {
            info: DeviceInfo {
                name: format!("Haply Inverse at {}", settings.address),
                sensed_degrees_of_freedom: if settings.exchange.with_grip { 6 } else { 3 },
                actuated_degrees_of_freedom: 3,
                limits,
                rate_hz: RATE_HZ,
            },
            port,
            mapping: settings.mapping,
            anchor: settings.anchor,
            placement,
            anchored: None,
            seen: (0, Duration::ZERO),
            at_g: placement.at_reference_point(&placement.start),
            velocity: Vector6::zeros(),
            was_lost: false,
        }
    }

    /// Where the cursor is on the workbench; `None` where the state is no pose.
    fn on_workbench(&self, state: &HaplyState) -> Option<Pose> {
        let [w, i, j, k] = state.orientation.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let norm = (w * w + i * i + j * j + k * k).sqrt();
        let from_centre = Vector3::from(state.position) - workspace_centre().coords;
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
            let rotation = if has_grip {
                pose.rotation
            } else {
                self.placement.start.rotation
            };
            return Isometry3::from_parts(pose.translation, rotation);
        }
        let start = self.placement.at_reference_point(&self.placement.start);
        let (cursor_then, body_then) = *self.anchored.get_or_insert((*cursor, start));
        let travel = cursor.translation.vector - cursor_then.translation.vector;
        let turn = (cursor.rotation * cursor_then.rotation.inverse()).scaled_axis();
        let turn = self.placement.rotation_in_world(&turn);
        Isometry3::from_parts(
            (body_then.translation.vector + self.placement.vector_in_world(&travel)).into(),
            UnitQuaternion::from_scaled_axis(turn) * body_then.rotation,
        )
    }

    fn take(&mut self, now: Duration, state: &HaplyState) -> Result<(), DeviceFault> {
        let cursor = self.on_workbench(state).ok_or(DeviceFault::NotFinite)?;
        let next = self.target(&cursor, state.orientation.is_some());
        let passed = now.saturating_sub(self.seen.1).as_secs_f64();
        let is_first = self.seen.0 == 0 || self.was_lost || passed > MAX_AGE.as_secs_f64();
        let turned = (next.rotation * self.at_g.rotation.inverse()).scaled_axis();
        let before: Vector3<f64> = self.velocity.fixed_rows::<3>(3).into();
        let turning = if is_first || passed <= 0.0 {
            Vector3::zeros()
        } else {
            before + (turned / passed - before) * (passed / (passed + TURN_LAG_S))
        };
        let moving =
            self.mapping.axes.matrix() * Vector3::from(state.velocity) * self.mapping.scale;
        let moving = self.mapping.origin.rotation * moving;
        self.velocity = stacked(&self.placement.vector_in_world(&moving), &turning);
        self.at_g = next;
        self.seen = (state.reports, now);
        Ok(())
    }

    fn lose(&mut self, fault: DeviceFault) -> DeviceFault {
        self.was_lost = true;
        fault
    }
}

impl Device for HaplyDevice {
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
            Duration::ZERO
        } else {
            now.saturating_sub(self.seen.1)
        };
        if state.unusable.is_some() || age > MAX_AGE {
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
        let force: Vector3<f64> = wrench.fixed_rows::<3>(0).into();
        let is_finite = force.iter().all(|part| part.is_finite());
        let force = if is_finite { force } else { Vector3::zeros() };
        // A force has a direction in the world, and no scale.
        let on_workbench = self.placement.workbench_from_world.isometry.rotation * force;
        let unturned = self.mapping.origin.rotation.inverse() * on_workbench;
        self.port
            .push((self.mapping.axes.matrix().transpose() * unturned).into());
    }
}
