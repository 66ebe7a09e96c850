//! Every limit and time of the port, with unit and default.

use std::time::Duration;

use super::passivity::PassivitySettings;
use super::validation::ValidationSettings;
use crate::device::{Device, DeviceInfo};

/// Limits and times of a [`DevicePort`](super::DevicePort).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetySettings {
    /// Largest norm of the force, N.
    pub max_force: f64,
    /// Largest norm of the torque, N m.
    pub max_torque: f64,
    /// Fastest change of the rendered force that the device's motion does not explain, N/s.
    pub force_rate: f64,
    /// The same for the torque, N m/s.
    pub torque_rate: f64,
    /// What the device's motion explains.
    pub contact: ContactBound,
    /// Age up to which the newest good input (sample of the device, command) is rendered in full.
    pub hold: Duration,
    /// Age of the constraints that a command rests on from which the force fades.
    pub max_constraint_age: Duration,
    /// Time from full force to none.
    pub ramp_out: Duration,
    /// Time from no force to full force on arming.
    pub ramp_in: Duration,
    /// Time between two ticks that are on time.
    pub period: Duration,
    /// Who arms.
    pub rearm: Rearm,
    /// Number of the button that must be held for any force; `None` does without.
    pub dead_man: Option<u8>,
    /// Number of the button whose press arms; `None` leaves it to the dead-man's button and to commands.
    pub arm_button: Option<u8>,
    /// What a sample of the device must be like.
    pub validation: ValidationSettings,
    /// What is done about energy that comes out of the port.
    pub passivity: PassivitySettings,
}

/// The stiffest contact that this port renders, by its own knowledge: of the scene, of the device, of whoever started it. Never by what the
/// commands say.
///
/// In a contact of stiffness K the coupling is a projection, which never makes a distance longer: a device that moves by `d` changes the force by at
/// most `K d` and the torque by at most `K r d`, where `d^2` is the square of the displacement of the reference point plus `r^2` times that of the
/// angle, and `r` the radius of gyration of the metric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactBound {
    /// K, N/m. Zero: motion explains nothing.
    pub stiffness: f64,
    /// r, m.
    pub radius_of_gyration: f64,
}

impl Default for ContactBound {
    /// 1000 N/m and 0.1 m: the stiffness of an ordinary contact, and the lever of the torque's limits.
    fn default() -> Self {
        Self {
            stiffness: 1000.0,
            radius_of_gyration: 0.1,
        }
    }
}

/// Who arms at the start, after a fault and after an outage: more than a second without good commands, or another process or session that commands. After a
/// shorter silence the force ramps in by itself in both cases.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rearm {
    /// The port itself, once its inputs are in order: for devices that cannot hurt anybody, and for runs without people.
    #[default]
    Automatic,
    /// A person, by command or button.
    Manual,
}

impl SafetySettings {
    /// 0.5 N/ms, beside what the device's motion explains.
    pub const FORCE_RATE: f64 = 500.0;
    /// 0.05 N m/ms: what 0.5 N/ms do at a lever of 0.1 m.
    pub const TORQUE_RATE: f64 = 50.0;
    /// The promise to the hand: no force is felt that rests on a good input older than this.
    pub const ZERO_AFTER: Duration = Duration::from_millis(120);
    /// Age up to which the last force is held.
    pub const HOLD: Duration = Duration::from_millis(20);
    /// What is kept of the promise for a loop that ticks late and a device that is slow to take a wrench.
    pub const LATENESS: Duration = Duration::from_millis(4);
    /// The rest at 1 kHz, without the period for which the last write holds: time from full force to none, 95 ms. A slower loop has less.
    pub const RAMP_OUT: Duration = Self::ramp_out_at(Duration::from_millis(1));
    /// Longest time that one write may use up of the slew limit: a loop that was late makes no larger step than this.
    pub const LONGEST_STEP: Duration = Duration::from_millis(2);

    /// Time from full force to none that a loop of this period has.
    #[must_use]
    pub const fn ramp_out_at(period: Duration) -> Duration {
        Self::ZERO_AFTER
            .saturating_sub(Self::HOLD)
            .saturating_sub(Self::LATENESS)
            .saturating_sub(period)
    }

    /// The same with limits that are not above those of the device: no torque where it has no motors for one.
    #[must_use]
    pub fn within(mut self, info: &DeviceInfo) -> Self {
        let limits = &info.limits;
        self.max_force = self.max_force.min(limits.max_force);
        self.max_torque = match info.actuated_degrees_of_freedom {
            3 => 0.0,
            _ => self.max_torque.min(limits.max_torque),
        };
        self.contact.stiffness = self.contact.stiffness.min(limits.max_stiffness);
        self
    }

    /// The same for a port of this device: within its limits, that can fade, and with what is said of the hand's speed, which is one at the device, in the
    /// scene's metres, in which the port sees it.
    pub(super) fn for_device(self, device: &dyn Device) -> Self {
        let mut settings = self.within(device.info()).that_can_fade();
        let scale = device.scale();
        settings.validation.max_speed *= scale;
        settings.validation.frozen_speed *= scale;
        settings.passivity.max_damping /= scale;
        settings
    }

    /// The same with a ramp-out that its period leaves time for, and with limits from which the force can come down in it without breaking the slew
    /// limit: only so can both promises be kept at once.
    pub(crate) fn that_can_fade(mut self) -> Self {
        self.ramp_out = self.ramp_out.min(Self::ramp_out_at(self.period));
        // A write uses up one period at most, and not all of a long one.
        let time = if self.period > Self::LONGEST_STEP {
            let writes = self.ramp_out.as_nanos() / self.period.as_nanos();
            Self::LONGEST_STEP.as_secs_f64() * writes as f64 // some dozens
        } else {
            self.ramp_out.as_secs_f64()
        };
        self.max_force = self.max_force.min(self.force_rate * time);
        self.max_torque = self.max_torque.min(self.torque_rate * time);
        self
    }

    /// Longest time without a new sample: over a network samples may be as far apart as they may be old, and it is the device that says when that is too
    /// long.
    pub(super) fn longest_silence(&self) -> Duration {
        self.hold.max(self.validation.time_slack)
    }

    /// Age of the newest input from which on the last force is said to be held: longer than any gap of a loop that works.
    pub(super) fn late(&self) -> Duration {
        LATE.max(2 * self.period)
    }
}

/// See [`SafetySettings::late`]: at 1 kHz.
const LATE: Duration = Duration::from_millis(5);

impl Default for SafetySettings {
    /// 20 N, 0.5 N m; 0.5 N/ms, 0.05 N m/ms beside contacts of 1000 N/m; hold 20 ms, out in 95 ms, in over 0.5 s; constraints of 100 ms; 1 kHz;
    /// automatic, without buttons.
    fn default() -> Self {
        Self {
            max_force: 20.0,
            max_torque: 0.5,
            force_rate: Self::FORCE_RATE,
            torque_rate: Self::TORQUE_RATE,
            contact: ContactBound::default(),
            hold: Self::HOLD,
            max_constraint_age: Duration::from_millis(100),
            ramp_out: Self::RAMP_OUT,
            ramp_in: Duration::from_millis(500),
            period: Duration::from_millis(1),
            rearm: Rearm::Automatic,
            dead_man: None,
            arm_button: None,
            validation: ValidationSettings::default(),
            passivity: PassivitySettings::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector6};

    use super::*;
    use crate::device::{DeviceFault, DeviceSample, Pose};
    use crate::port::{Command, DevicePort, Passivity};

    /// A hand of `speed` m/s along x, at a device whose metre is `scale` of the scene.
    struct Scaled {
        info: DeviceInfo,
        scale: f64,
        speed: f64,
    }

    impl Device for Scaled {
        fn info(&self) -> &DeviceInfo {
            &self.info
        }

        fn scale(&self) -> f64 {
            self.scale
        }

        fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
            let speed = self.speed * self.scale;
            Ok(DeviceSample {
                time: now,
                pose: Pose::translation(speed * now.as_secs_f64(), 0.0, 0.0),
                velocity: Vector6::x() * speed,
                buttons: 0,
            })
        }

        fn write(&mut self, _now: Duration, _wrench: &Vector6<f64>) {}
    }

    /// Whether the samples are believed, and the force along x, N, that is felt where 10 N give energy without end.
    fn felt(scale: f64, speed: f64) -> (bool, f64) {
        let device = Scaled {
            info: DeviceInfo::ideal("scaled", 3),
            scale,
            speed,
        };
        let settings = SafetySettings {
            passivity: PassivitySettings {
                max_debt: 10.0, // nothing but the damping takes any
                ..PassivitySettings::of(Passivity::Control)
            },
            ..SafetySettings::default()
        };
        let start = Pose::identity();
        let mut port = DevicePort::new(Box::new(device), settings, Point3::origin(), &start);
        for tick in 1..=1000 {
            let now = Duration::from_millis(tick);
            let command = Command::fresh(now, Vector6::x() * 10.0);
            let _ = port.tick(now, |_| Some(command));
        }
        (port.fault().is_none(), port.rendered().x)
    }

    #[test]
    fn the_speed_of_a_hand_is_that_at_the_device_however_it_is_scaled() {
        for scale in [0.1, 1.0, 10.0] {
            // 20 N s/m at 0.2 m/s.
            let (believed, force) = felt(scale, 0.2);
            assert!(believed && (force - 6.0).abs() < 1e-6, "{force} at {scale}");
            assert!(felt(scale, 2.9).0, "{scale}");
            assert!(!felt(scale, 3.1).0, "{scale}");
        }
    }
}
