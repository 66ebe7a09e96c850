//! Residual monitor: eight lengths and six unknowns leave two equations over, which tell on a wrong string.
//!
//! | symbol | name in code | meaning                                                              |
//! |--------|--------------|----------------------------------------------------------------------|
//! | e      |              | constant error of one length, m                                      |
//! | r      | `residuals`  | computed minus measured lengths: `-P e` for an error e               |
//! | S      | `energy`     | faded sum of `|r|^2`                                                 |
//! | B_i    | `sums`       | faded sum of r_i                                                     |
//! | D_i    | `weights`    | faded sum of P_ii                                                    |
//!
//! If string i alone is wrong by e, the best estimate over many poses is `-B_i / D_i`, and it explains `B_i^2 / D_i` of S. At
//! one pose two strings may explain the same residual (by symmetry, opposite ones do at the centre); along a
//! motion only the right one goes on explaining it. That is why the sums are kept over a second, from the first alarm on, while the alarm looks
//! at the present residual.
//!
//! Source: Baarda 1968 (data snooping), with a constant error over many poses.

use crate::kinematics::PoseAnswer;
use crate::{PerString, STRINGS};

/// Residual at which lengths count as wrong, m: above quantisation of two counts of every device here, well below what
/// an error of a millimetre on one string leaves.
pub const DISAGREEMENT: f64 = 0.2e-3;
/// Samples over which the sums fade by 1/e: a second at 1 kHz.
const FADING_SAMPLES: f64 = 1000.0;
/// An alarm after so many quiet samples is a new fault, and what was seen before it says nothing about it.
const QUIET_SAMPLES: u32 = 1000;
/// A string is named if its error explains this share of the residuals ...
const EXPLAINED: f64 = 0.9;
/// ... leaves at most this share of what the next best leaves ...
const CLEARER_THAN_NEXT: f64 = 0.5;
/// ... and that is at least this share of all: more than what the curvature of a large error leaves.
const NEXT_LEAVES: f64 = 0.03;

/// The string whose error explains the residuals best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suspect {
    /// The string, from 0.
    pub string: usize,
    /// By how much it measures too long, m.
    pub error: f64,
    /// Whether it stands out from all others; if not, move the grip.
    pub certain: bool,
}

/// What the redundant lengths say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Consistency {
    /// Norm of the present residual, m.
    pub disagreement: f64,
    /// Whether it is above [`DISAGREEMENT`].
    pub alarm: bool,
    /// The string that explains the last second's residuals best; `None` if there is no redundancy.
    pub suspect: Option<Suspect>,
}

impl Consistency {
    /// The string to be named in a fault: one that stands out, while the alarm is on.
    #[must_use]
    pub fn culprit(&self) -> Option<usize> {
        self.suspect
            .filter(|suspect| self.alarm && suspect.certain)
            .map(|suspect| suspect.string)
    }
}

/// Keeps the faded sums. No allocation.
#[derive(Clone, Debug, Default)]
pub struct ResidualMonitor {
    energy: f64,
    sums: PerString,
    weights: PerString,
    /// Samples since the last alarm.
    quiet: u32,
}

impl ResidualMonitor {
    /// A monitor that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets everything, as after a calibration.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Takes one answer of the forward kinematics.
    pub fn step(&mut self, answer: &PoseAnswer) -> Consistency {
        let keep = 1.0 - 1.0 / FADING_SAMPLES;
        let disagreement = answer.disagreement();
        let agree = disagreement <= DISAGREEMENT; // false for NaN
        let alarm = !agree;
        if alarm && self.quiet >= QUIET_SAMPLES {
            self.reset();
        }
        self.quiet = if alarm {
            0
        } else {
            self.quiet.saturating_add(1)
        };
        self.energy = keep * self.energy + disagreement * disagreement;
        for i in 0..STRINGS {
            self.sums[i] = keep * self.sums[i] + answer.residuals[i];
            self.weights[i] = keep * self.weights[i] + answer.leverage[i];
        }
        Consistency {
            disagreement,
            alarm,
            suspect: self.suspect(),
        }
    }

    fn suspect(&self) -> Option<Suspect> {
        /// A string with less weight has not shown anything.
        const LEAST_WEIGHT: f64 = 1e-6;
        let mut best: Option<(usize, f64)> = None;
        let mut second = 0.0_f64;
        for i in 0..STRINGS {
            if self.weights[i] <= LEAST_WEIGHT {
                continue;
            }
            let explained = self.sums[i] * self.sums[i] / self.weights[i];
            match best {
                Some((_, most)) if explained <= most => second = second.max(explained),
                Some((_, most)) => {
                    second = most;
                    best = Some((i, explained));
                }
                None => best = Some((i, explained)),
            }
        }
        let (string, explained) = best?;
        let (left, left_by_next) = (self.energy - explained, self.energy - second);
        Some(Suspect {
            string,
            error: -self.sums[string] / self.weights[string],
            certain: explained >= EXPLAINED * self.energy
                && left <= CLEARER_THAN_NEXT * left_by_next
                && left_by_next >= NEXT_LEAVES * self.energy,
        })
    }
}
