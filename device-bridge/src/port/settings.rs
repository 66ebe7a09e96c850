//! Every limit and time of the port, with unit and default.

use std::time::Duration;

use super::passivity::PassivitySettings;
use super::validation::ValidationSettings;
use crate::device::DeviceLimits;

/// Limits and times of a [`DevicePort`](super::DevicePort).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetySettings {
    /// Largest norm of the force, N.
    pub max_force: f64,
    /// Largest norm of the torque, N m.
    pub max_torque: f64,
    /// Fastest change of the rendered force, N/s. Contact of stiffness K at speed v changes it by K v.
    pub force_rate: f64,
    /// Fastest change of the rendered torque, N m/s.
    pub torque_rate: f64,
    /// Age up to which the newest good input (sample of the device, command) is rendered in full.
    pub hold: Duration,
    /// Age of the constraints that a command rests on from which the force fades.
    pub max_constraint_age: Duration,
    /// Time from full force to none.
    pub ramp_out: Duration,
    /// Time from no force to full force on arming.
    pub ramp_in: Duration,
    /// Time between two ticks: a tick that comes late earns no more change of the force than this.
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

/// Who arms at the start and after a fault. After a mere silence of commands the force ramps in by itself in both cases.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rearm {
    /// The port itself, once its inputs are in order: for devices that cannot hurt anybody, and for runs without people.
    #[default]
    Automatic,
    /// A person, by command or button.
    Manual,
}

impl SafetySettings {
    /// 0.5 N/ms: a contact of 1000 N/m may be met at 0.5 m/s before the limit acts.
    pub const FORCE_RATE: f64 = 500.0;
    /// 0.05 N m/ms: what 0.5 N/ms do at a lever of 0.1 m.
    pub const TORQUE_RATE: f64 = 50.0;
    /// The promise to the hand: no force is felt that rests on a good input older than this.
    pub const ZERO_AFTER: Duration = Duration::from_millis(120);
    /// Age up to which the last force is held.
    pub const HOLD: Duration = Duration::from_millis(20);
    /// What is kept of the promise for a loop that ticks late and a device that is slow to take a wrench: five periods at 1 kHz.
    pub const MARGIN: Duration = Duration::from_millis(5);
    /// The rest: time from full force to none, 95 ms.
    pub const RAMP_OUT: Duration = Self::ZERO_AFTER
        .saturating_sub(Self::HOLD)
        .saturating_sub(Self::MARGIN);

    /// The same with limits that are not above those of the device.
    #[must_use]
    pub fn within(mut self, limits: &DeviceLimits) -> Self {
        self.max_force = self.max_force.min(limits.max_force);
        self.max_torque = self.max_torque.min(limits.max_torque);
        self
    }

    /// The same with limits from which the force can come down in `ramp_out` without breaking the slew limit: only so can both
    /// promises be kept at once.
    pub(super) fn that_can_fade(mut self) -> Self {
        let time = self.ramp_out.as_secs_f64();
        self.max_force = self.max_force.min(self.force_rate * time);
        self.max_torque = self.max_torque.min(self.torque_rate * time);
        self
    }
}

impl Default for SafetySettings {
    /// 20 N, 0.5 N m; 0.5 N/ms, 0.05 N m/ms; hold 20 ms, out in 95 ms, in over 0.5 s; constraints of 100 ms; 1 kHz;
    /// automatic, without buttons.
    fn default() -> Self {
        Self {
            max_force: 20.0,
            max_torque: 0.5,
            force_rate: Self::FORCE_RATE,
            torque_rate: Self::TORQUE_RATE,
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
