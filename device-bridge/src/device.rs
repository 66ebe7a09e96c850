//! A haptic device: a pose comes in, a wrench goes out.
//!
//! Every driver is one type that implements [`Device`]. Time is an argument, so the same driver runs in
//! the 1 kHz loop and under a virtual clock. A device pose is the pose of the held *body's own frame* in
//! the world; wrenches and velocities are at the body's reference point G, in world axes, linear then
//! angular. A driver knows G (its constructor takes it), so nothing after it has to convert.

use std::time::Duration;

use nalgebra::Vector6;

pub use taut_plant::Pose;

/// A source of device poses that can be pushed with a wrench.
///
/// `now` never goes back between calls; both methods are called from one thread and neither allocates,
/// locks, logs or waits.
pub trait Device: Send {
    /// What the device is and what it can bear.
    fn info(&self) -> &DeviceInfo;

    /// The newest sample at `now`.
    ///
    /// # Errors
    /// A [`DeviceFault`]: there is no pose that may be trusted, and the caller must stop the force.
    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault>;

    /// Renders `wrench` on the user's hand from `now` until the next call (zero-order hold).
    ///
    /// The one caller is [`crate::DevicePort`], which has made the wrench safe; a driver still refuses what is not finite.
    fn write(&mut self, now: Duration, wrench: &Vector6<f64>);

    /// Whether the driver has taken the force away of its own accord since this was asked last: nobody wrote in time, or the device was lost. What is
    /// written renders nothing until this was asked, so that the caller begins again at zero. `false` for a driver that never does.
    fn let_go(&mut self) -> bool {
        false
    }

    /// Tells, before a write, when the device was read for what that write comes from, `None` where it comes from nothing; and the net work of moving
    /// obstacles on the hand so far, J. For a device at the far end of a network, which counts the age of a force and its energy from there.
    fn comes_from(&mut self, _origin: Option<Duration>, _obstacle_work: f64) {}

    /// Metres of the scene that a metre of the device's motion is: speeds and damping of a hand are those at the device.
    fn scale(&self) -> f64 {
        1.0
    }

    /// What the hand feels as far as the device knows, where that may differ from what [`Device::write`] was given: what a device at
    /// the far end of a network told with its last reading, or what the motors here can render of the last write. `None` where
    /// there is nothing to tell.
    fn felt(&self) -> Option<Felt> {
        None
    }

    /// Thread CPU time of the driver's own arithmetic in the last [`Device::read`] and [`Device::write`] together, its hardware left
    /// out; `None` where nobody measures it.
    fn computing_time(&self) -> Option<Duration> {
        None
    }
}

/// What a device renders, where that is not simply what it was told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Felt {
    /// Force then torque on the hand at the reference point, N and N m, world axes.
    pub wrench: Vector6<f64>,
    /// It is computed at the far end of a network, from constraint sets.
    pub at_edge: bool,
    /// When the set that it rests on was made, on the clock of `now`; `None` where there is no set, or the bridge does not say.
    pub set_made: Option<Duration>,
}

/// What a device is: its name and its limits.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceInfo {
    /// For logs, reports and the monitor.
    pub name: String,
    /// Degrees of freedom in which a pose is measured: 3 or 6.
    pub sensed_degrees_of_freedom: u8,
    /// Degrees of freedom in which force or torque is rendered: 0, 3 or 6.
    pub actuated_degrees_of_freedom: u8,
    /// What it may be asked to render.
    pub limits: DeviceLimits,
    /// Rate at which it wants to be read and written, in Hz.
    pub rate_hz: f64,
}

impl DeviceInfo {
    /// Of a device that renders whatever it is asked to, in the degrees of freedom that it senses, at 1 kHz.
    #[must_use]
    pub fn ideal(name: impl Into<String>, degrees_of_freedom: u8) -> Self {
        Self {
            name: name.into(),
            sensed_degrees_of_freedom: degrees_of_freedom,
            actuated_degrees_of_freedom: degrees_of_freedom,
            limits: DeviceLimits::UNLIMITED,
            rate_hz: 1000.0,
        }
    }

    /// Of a device that measures a whole pose and renders no force.
    #[must_use]
    pub fn without_force(name: impl Into<String>) -> Self {
        Self {
            actuated_degrees_of_freedom: 0,
            ..Self::ideal(name, 6)
        }
    }

    /// What to tell a user once of a device that pushes and cannot turn; `None` for every other.
    #[must_use]
    pub fn renders_no_torque(&self) -> Option<String> {
        (self.actuated_degrees_of_freedom == 3).then(|| {
            format!(
                "{} renders force and no torque ({} degrees of freedom sensed, 3 actuated): torques are dropped, not turned into force",
                self.name, self.sensed_degrees_of_freedom
            )
        })
    }
}

/// The largest commands that a device renders faithfully. Infinite where there is no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceLimits {
    /// Largest stable translational stiffness, in N/m.
    pub max_stiffness: f64,
    /// Largest stable rotational stiffness, in N m/rad.
    pub max_rotational_stiffness: f64,
    /// Largest norm of the force, in N.
    pub max_force: f64,
    /// Largest norm of the torque, in N m.
    pub max_torque: f64,
}

impl DeviceLimits {
    /// No limit at all: a device without motors, such as a recorded trace.
    pub const UNLIMITED: Self = Self {
        max_stiffness: f64::INFINITY,
        max_rotational_stiffness: f64::INFINITY,
        max_force: f64::INFINITY,
        max_torque: f64::INFINITY,
    };
}

/// One reading of a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceSample {
    /// When the pose was measured, on the clock of `now`; never after `now`.
    pub time: Duration,
    /// Pose of the held body's own frame, world from body.
    pub pose: Pose,
    /// Velocity of the reference point G (m/s), then angular velocity (rad/s), world axes.
    pub velocity: Vector6<f64>,
    /// One bit per button, bit 0 the first; 1 is pressed.
    pub buttons: u16,
}

/// Why a device has no pose that may be trusted. The force must go to zero.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DeviceFault {
    /// No sample has ever arrived.
    #[error(
        "the device has not sent a sample yet; start it, or check its cable or its network link"
    )]
    NotStarted,
    /// Samples stopped.
    #[error(
        "the device was lost: its last sample is {} ms old; check its cable or its network link",
        age.as_millis()
    )]
    Lost {
        /// Age of the last sample.
        age: Duration,
    },
    /// A sample with NaN, an infinity or a rotation that is not a unit quaternion.
    #[error("the device sent a pose that is not finite; restart the device and calibrate it")]
    NotFinite,
    /// The device's time stamps went back or lie in the future.
    #[error("the device's time stamps are not on this clock; restart the device")]
    TimeNotOnClock,
    /// The device at the far end of the network says that it is faulty.
    #[error("the device at the far end reports a fault; look at the bridge's messages there")]
    ReportedFault,
    /// Another bridge, or the same one anew, has taken over: the pose may have jumped.
    #[error("the device bridge has just reconnected; the force ramps in again")]
    Reconnected,
    /// A string-driven device has no pose that may be trusted.
    #[error("{0}")]
    Strings(taut_spidar::StringFault),
    /// A recorded trace came to its end.
    #[error("the recorded trace ended; loop it or hold its last pose to go on")]
    Ended,
    /// The pose jumped faster than a hand moves.
    #[error(
        "the device jumped at {speed:.1} m/s, faster than a hand moves; check its sensors and calibrate it"
    )]
    Teleported {
        /// Distance over time since the sample before, m/s.
        speed: f64,
    },
    /// The pose turned faster than a hand turns.
    #[error(
        "the device turned at {rate:.1} rad/s, faster than a hand turns; check its sensors and calibrate it"
    )]
    SpunTooFast {
        /// Angle over time since the sample before, rad/s.
        rate: f64,
    },
    /// Out of a movement, the same pose to the bit again and again.
    #[error(
        "the device froze {} ms ago in the middle of a movement; check its cable, or move it if it stands at an end stop",
        time.as_millis()
    )]
    Frozen {
        /// Since the last change of the pose.
        time: Duration,
    },
    /// A sample is older than the one before it.
    #[error("the device's time stamps went back by {:.1} ms; restart the device", by.as_secs_f64() * 1e3)]
    TimeWentBack {
        /// By how much.
        by: Duration,
    },
}
