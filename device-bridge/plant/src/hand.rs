//! The hand that holds a simulated device: mass, damping and stiffness towards its intention.
//!
//! `m x" + b (x' - x_d') + k (x - x_d) = F`, the same in rotation: the wrench F that the device renders
//! pushes the hand away from its intention x_d.
//!
//! The form is that of published hand models (Hasser & Cutkosky; Fu & Çavuşoğlu). The presets' numbers are
//! the middles of the ranges given at each and are **assumptions**, to be swept and not trusted: people
//! vary by a factor of two and more. The light and the released hand are the dangerous ones: a firm grip
//! damps what an unstable coupling would let go.

use std::fmt;
use std::str::FromStr;

use nalgebra::{Matrix6, Vector3, Vector6};

use crate::spatial::stack;

/// Second-order impedance of a hand, the same along every axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// Mass that moves with the grip, in kg.
    pub mass: f64,
    /// Damping towards the intended velocity, in N s/m.
    pub damping: f64,
    /// Stiffness towards the intended position, in N/m.
    pub stiffness: f64,
    /// Moment of inertia that turns with the grip, in kg m^2.
    pub rotational_inertia: f64,
    /// Damping towards the intended angular velocity, in N m s/rad.
    pub rotational_damping: f64,
    /// Stiffness towards the intended rotation, in N m/rad.
    pub rotational_stiffness: f64,
}

impl Hand {
    /// Nobody holds the grip. Exact, not an assumption.
    pub const RELEASED: Self = Self {
        mass: 0.0,
        damping: 0.0,
        stiffness: 0.0,
        rotational_inertia: 0.0,
        rotational_damping: 0.0,
        rotational_stiffness: 0.0,
    };

    /// A pinch with two or three fingers. Assumption: 0.10-0.20 kg, 2-5 N s/m, 50-200 N/m.
    pub const LIGHT: Self = Self {
        mass: 0.15,
        damping: 4.0,
        stiffness: 120.0,
        rotational_inertia: 1e-4,
        rotational_damping: 2e-3,
        rotational_stiffness: 0.2,
    };

    /// The whole hand closed on the grip. Assumption: 0.4-0.8 kg, 6-15 N s/m, 300-800 N/m.
    pub const FIRM: Self = Self {
        mass: 0.6,
        damping: 10.0,
        stiffness: 500.0,
        rotational_inertia: 5e-4,
        rotational_damping: 1e-2,
        rotational_stiffness: 1.5,
    };

    /// The arm moves with the hand. Assumption: 1.5-3 kg, 15-40 N s/m, 300-1000 N/m.
    pub const ARM: Self = Self {
        mass: 2.0,
        damping: 25.0,
        stiffness: 600.0,
        rotational_inertia: 2e-3,
        rotational_damping: 5e-2,
        rotational_stiffness: 3.5,
    };

    /// True when the hand holds the grip at all.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.stiffness > 0.0 || self.rotational_stiffness > 0.0
    }

    /// What moves with the grip, about and along every axis: kg, kg m^2.
    #[must_use]
    pub fn inertia(&self) -> Matrix6<f64> {
        Matrix6::from_diagonal(&uniform(self.mass, self.rotational_inertia))
    }

    /// Damping of all six axes.
    #[must_use]
    pub fn damping6(&self) -> Vector6<f64> {
        uniform(self.damping, self.rotational_damping)
    }

    /// Stiffness of all six axes.
    #[must_use]
    pub fn stiffness6(&self) -> Vector6<f64> {
        uniform(self.stiffness, self.rotational_stiffness)
    }
}

fn uniform(linear: f64, angular: f64) -> Vector6<f64> {
    stack(&Vector3::repeat(linear), &Vector3::repeat(angular))
}

/// The named hands of the command line and the workbench file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HandPreset {
    /// [`Hand::RELEASED`].
    Released,
    /// [`Hand::LIGHT`].
    #[default]
    Light,
    /// [`Hand::FIRM`].
    Firm,
    /// [`Hand::ARM`].
    Arm,
}

impl HandPreset {
    /// Every preset, weakest first, with its name in files and on the command line.
    pub const NAMED: [(&'static str, Self); 4] = [
        ("released", Self::Released),
        ("light", Self::Light),
        ("firm", Self::Firm),
        ("arm", Self::Arm),
    ];

    /// The preset's name in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        let named = Self::NAMED.iter().find(|(_, preset)| *preset == self);
        named.map_or("", |(name, _)| name)
    }
}

impl From<HandPreset> for Hand {
    fn from(preset: HandPreset) -> Self {
        match preset {
            HandPreset::Released => Self::RELEASED,
            HandPreset::Light => Self::LIGHT,
            HandPreset::Firm => Self::FIRM,
            HandPreset::Arm => Self::ARM,
        }
    }
}

impl fmt::Display for HandPreset {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.name())
    }
}

/// A word that names no hand.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no hand named `{0}`; use released, light, firm or arm")]
pub struct UnknownHand(String);

impl FromStr for HandPreset {
    type Err = UnknownHand;

    fn from_str(text: &str) -> Result<Self, UnknownHand> {
        let named = Self::NAMED.iter().find(|(name, _)| *name == text);
        let preset = named.map(|(_, preset)| *preset);
        preset.ok_or_else(|| UnknownHand(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_found_by_their_names_and_grow_stronger() {
        for pair in HandPreset::NAMED.windows(2) {
            let (weaker, stronger) = (Hand::from(pair[0].1), Hand::from(pair[1].1));
            assert!(weaker.mass < stronger.mass && weaker.damping < stronger.damping);
            assert!(weaker.rotational_stiffness < stronger.rotational_stiffness);
        }
        for (name, preset) in HandPreset::NAMED {
            assert_eq!(preset.to_string(), name);
            assert_eq!(name.parse(), Ok(preset));
        }
        assert!("fist".parse::<HandPreset>().is_err());
        assert!(!Hand::RELEASED.holds() && Hand::LIGHT.holds());
    }
}
