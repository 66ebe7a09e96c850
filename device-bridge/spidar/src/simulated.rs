//! Simulated strings: from a true pose to encoder counts, and from commanded tensions to the wrench on the grip.
//!
//! | symbol | name in code    | unit | meaning                                                           |
//! |--------|-----------------|------|-------------------------------------------------------------------|
//! | tau    | `motor_time_constant` | s | lag of tension behind command                                  |
//! | c      | `coulomb`       | N    | friction of drum and eyelet, against the string's motion          |
//! | eta    | `loss`          | -    | share of the tension lost (or gained) over the eyelet, likewise   |
//!
//! The grip and the hand that hold it are simulated elsewhere; here a pose comes in and a wrench goes out. A motor that does not
//! pull lets its string out, but does not wind it up: its count only grows, as on a real device.

use std::time::Duration;

use nalgebra::Vector6;

use crate::fault::StringFault;
use crate::hardware::{Reading, StringHardware};
use crate::string_matrix::StringMatrix;
use crate::{Geometry, PerString, Pose, STRINGS};

/// Rate of a length at which friction has reached most of its value, m/s: it keeps sign changes smooth.
const FRICTION_SPEED: f64 = 1e-3;

/// What gets lost between motor and grip. All zero is an ideal device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StringLosses {
    /// Coulomb friction per string, N.
    pub coulomb: f64,
    /// Share of the tension lost over the eyelet, 0 to 1.
    pub loss: f64,
}

/// Eight strings with motors and encoders; the grip is where it was last put.
#[derive(Clone, Debug)]
pub struct SimulatedStrings {
    /// The true geometry, which may differ from the one that the driver believes in.
    geometry: Geometry,
    losses: StringLosses,
    /// True length at count zero, m.
    zeros: PerString,
    pose: Pose,
    strings: StringMatrix,
    /// Length that the drum has let out, m: what the encoder sees.
    paid_out: PerString,
    command: PerString,
    motor_tensions: PerString,
    /// Tension at the grip, N.
    tensions: PerString,
    dead: [bool; STRINGS],
    measures_tensions: bool,
    time: Duration,
}

impl SimulatedStrings {
    /// Strings that are taut with the grip at `frame_from_grip`, with counters at zero there.
    #[must_use]
    pub fn new(geometry: &Geometry, losses: StringLosses, frame_from_grip: Pose) -> Self {
        let strings = StringMatrix::at(geometry, &frame_from_grip);
        let least = [geometry.tension_min; STRINGS];
        Self {
            geometry: geometry.clone(),
            losses,
            zeros: strings.lengths,
            pose: frame_from_grip,
            strings,
            paid_out: strings.lengths,
            command: least,
            motor_tensions: least,
            tensions: least,
            dead: [false; STRINGS],
            measures_tensions: false,
            time: Duration::ZERO,
        }
    }

    /// Lets readings carry the tensions, as electronics do that measure motor currents.
    #[must_use]
    pub fn measuring_tensions(mut self) -> Self {
        self.measures_tensions = true;
        self
    }

    /// Makes the encoder of a string show `error` metres more than there are.
    pub fn slip(&mut self, string: usize, error: f64) {
        self.zeros[string] -= error;
    }

    /// Takes the power from a motor, or gives it back.
    pub fn set_dead(&mut self, string: usize, dead: bool) {
        self.dead[string] = dead;
    }

    /// Moves the grip to where it is at `now`, and the tensions with it.
    pub fn advance(&mut self, now: Duration, frame_from_grip: Pose) {
        let step = now.saturating_sub(self.time).as_secs_f64();
        let strings = StringMatrix::at(&self.geometry, &frame_from_grip);
        let lag = self.geometry.motor_time_constant;
        // The exact response to a command that is held over the step.
        let reached = if lag > 0.0 {
            1.0 - (-step / lag).exp()
        } else {
            1.0
        };
        for i in 0..STRINGS {
            let wanted = if self.dead[i] {
                0.0
            } else {
                self.command[i].clamp(0.0, self.geometry.tension_max)
            };
            self.motor_tensions[i] += (wanted - self.motor_tensions[i]) * reached;
            let rate = if step > 0.0 {
                (strings.lengths[i] - self.strings.lengths[i]) / step
            } else {
                0.0
            };
            let against = (rate / FRICTION_SPEED).tanh();
            let friction = self.losses.coulomb + self.losses.loss * self.motor_tensions[i];
            // Pulled out against friction the string pulls harder at the grip than at the motor.
            self.tensions[i] = (self.motor_tensions[i] + friction * against).max(0.0);

            // A motor without power does not wind up; a string that is not wound up does not pull.
            let taut = strings.lengths[i] >= self.paid_out[i];
            if taut || !self.dead[i] {
                self.paid_out[i] = strings.lengths[i];
            } else {
                self.tensions[i] = 0.0;
            }
        }
        self.strings = strings;
        self.pose = frame_from_grip;
        self.time = self.time.max(now);
    }

    /// Where the grip is.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Tension of each string at the grip, N.
    #[must_use]
    pub fn tensions(&self) -> &PerString {
        &self.tensions
    }

    /// The wrench of the strings on the grip: N, N m about its centre, frame axes.
    #[must_use]
    pub fn wrench(&self) -> Vector6<f64> {
        self.strings.wrench(&self.tensions)
    }
}

impl StringHardware for SimulatedStrings {
    fn read_counts(&mut self, now: Duration) -> Result<Reading, StringFault> {
        let pose = self.pose;
        self.advance(now, pose);
        let counts = std::array::from_fn(|i| {
            let turned = (self.paid_out[i] - self.zeros[i]) / self.geometry.metres_per_count[i];
            // Saturates at the ends; NaN is 0.
            turned.floor() as i32
        });
        Ok(Reading {
            time: now,
            counts,
            tensions: self.measures_tensions.then_some(self.tensions),
            buttons: 0,
        })
    }

    fn write_tensions(&mut self, now: Duration, tensions: &PerString) {
        let pose = self.pose;
        self.advance(now, pose);
        self.command = *tensions;
    }
}
