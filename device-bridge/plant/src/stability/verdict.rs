//! The calculator: how stiff a wall one axis of a declared device bears, and what limits it.

use std::fmt;

use super::formulas::resolution_limit;
use super::{SampledLoop, passive_damping};

/// Relative width in which the largest passive stiffness is told.
const BRACKET: f64 = 1e-6;
/// Stiffest wall that is looked at.
const STIFFEST: f64 = 1e12;

/// One axis of a device as it is declared, with the loop around it and the hand that holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeclaredAxis {
    /// The linear part.
    pub sampled: SampledLoop,
    /// Coulomb friction, N or N m.
    pub coulomb: f64,
    /// Resolution of the encoder, m or rad; 0 measures exactly.
    pub resolution: f64,
}

/// What limits the largest stable stiffness most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StableLimit {
    /// No damping, no stable wall.
    NoDamping,
    /// The damping of the wall itself is more than the sampling bears.
    VirtualDamping,
    /// The hold over a sample is longer than the delay.
    Hold,
    /// The delay of the force, with the motors' lag.
    Delay,
}

/// What limits the largest passive stiffness most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PassiveLimit {
    /// The device's damping is less than the wall's own.
    VirtualDamping,
    /// Damping of the device against hold, delay and lag.
    Damping,
    /// Friction of the device against the steps of the encoder.
    Resolution,
}

/// The largest stiffnesses of one axis, N/m or N m/rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Every softer wall is stable with this hand.
    pub stable: f64,
    /// What limits it.
    pub stable_limit: StableLimit,
    /// No softer wall gives energy to any hand.
    pub passive: f64,
    /// What limits it.
    pub passive_limit: PassiveLimit,
}

impl DeclaredAxis {
    /// States both limits and their reasons. The stable one counts with the hand as declared, the passive one with any.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let axis = &self.sampled;
        let stable = axis.critical_stiffness();
        let late = axis.delay + axis.motor_lag;
        let damped = axis.damping + axis.hand_damping + axis.virtual_damping > 0.0;
        let stable_limit = match (damped, stable > 0.0) {
            (false, _) => StableLimit::NoDamping,
            (true, false) => StableLimit::VirtualDamping,
            (true, true) if late > 0.5 * axis.period => StableLimit::Delay,
            (true, true) => StableLimit::Hold,
        };

        let by_damping = self.passive_by_damping();
        let by_resolution = resolution_limit(self.coulomb, self.resolution);
        let passive_limit = if by_resolution < by_damping {
            PassiveLimit::Resolution
        } else if by_damping == 0.0 && axis.virtual_damping > 0.0 {
            PassiveLimit::VirtualDamping
        } else {
            PassiveLimit::Damping
        };
        Verdict {
            stable,
            stable_limit,
            passive: by_damping.min(by_resolution),
            passive_limit,
        }
    }

    /// The device's damping alone, against hold, delay and lag (taken as a delay), by bisection.
    fn passive_by_damping(&self) -> f64 {
        let axis = &self.sampled;
        let late = axis.delay + axis.motor_lag;
        let passive = |stiffness: f64| {
            passive_damping(stiffness, axis.virtual_damping, axis.period, late) <= axis.damping
        };
        let (mut good, mut bad) = (0.0, STIFFEST);
        if !passive(good) {
            return 0.0;
        }
        // From the rule upwards it is never passive: at w = 0 the condition is the rule.
        bad = bad.min(super::linear_limit(
            axis.damping,
            axis.virtual_damping,
            axis.period,
            late,
        ));
        while bad - good > BRACKET * bad {
            let middle = 0.5 * (good + bad);
            if passive(middle) {
                good = middle;
            } else {
                bad = middle;
            }
        }
        good
    }
}

impl fmt::Display for StableLimit {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::NoDamping => "the lack of damping in device and hand",
            Self::VirtualDamping => "the wall's own damping, more than the sampling bears",
            Self::Hold => "the hold of a sample, against the damping of device and hand",
            Self::Delay => "the delay of the force, against the damping of device and hand",
        })
    }
}

impl fmt::Display for PassiveLimit {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::VirtualDamping => "the wall's own damping, more than the device's",
            Self::Damping => "the device's damping, against hold and delay",
            Self::Resolution => "the device's friction, against the steps of its encoder",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand::Hand;

    fn axis(damping: f64, coulomb: f64, resolution: f64) -> DeclaredAxis {
        DeclaredAxis {
            sampled: SampledLoop {
                mass: 0.2,
                damping,
                ..SampledLoop::at_period(1e-3)
            },
            coulomb,
            resolution,
        }
    }

    #[test]
    fn the_reasons_follow_the_numbers() {
        let hold = axis(1.0, 0.0, 0.0).verdict();
        assert_eq!(hold.stable_limit, StableLimit::Hold);
        assert_eq!(hold.passive_limit, PassiveLimit::Damping);
        assert!((hold.passive - 2000.0).abs() < 0.1);

        let counted = axis(1.0, 0.02, 29.24e-6).verdict();
        assert_eq!(counted.passive_limit, PassiveLimit::Resolution);
        assert!((counted.passive - 2.0 * 0.02 / 29.24e-6).abs() < 1e-9);
        assert!(counted.passive < counted.stable);

        let mut late = axis(1.0, 0.0, 0.0);
        late.sampled.delay = 1e-3;
        let late = late.verdict();
        assert_eq!(late.stable_limit, StableLimit::Delay);
        assert!((late.passive - 1.0 / 1.5e-3).abs() < 0.1);

        assert_eq!(
            axis(0.0, 0.0, 0.0).verdict().stable_limit,
            StableLimit::NoDamping
        );
    }

    #[test]
    fn a_hand_helps_stability_and_not_passivity() {
        let alone = axis(1.0, 0.0, 0.0);
        let held = DeclaredAxis {
            sampled: alone.sampled.held_along(&Hand::LIGHT),
            ..alone
        };
        assert!(held.verdict().stable > 4.0 * alone.verdict().stable);
        assert_eq!(held.verdict().passive, alone.verdict().passive);
    }
}
