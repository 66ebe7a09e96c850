//! What settings may not be.

use super::{MAX_IMPLICIT_ROUNDS, RotationMetric, Settings};

impl Settings {
    /// Says what is out of range, by the key's name.
    pub fn validate(&self) -> Result<(), SettingsError> {
        positive("k_s", self.k_s)?;
        positive("k_h", self.k_h)?;
        positive("force_limit", self.force_limit)?;
        positive("torque_limit", self.torque_limit)?;
        positive("minimum_gap", self.minimum_gap)?;
        positive("gap_tolerance", self.gap_tolerance)?;
        positive("motion_tolerance", self.motion_tolerance)?;
        at_most("k_s", self.k_s, 1.0)?;
        if let RotationMetric::RadiusOfGyration(radius) = self.rotation_metric {
            positive("rotation_metric", radius)?;
        }
        if let Some(adaptation) = self.adaptation {
            not_negative("adaptation.duration", adaptation.duration)?;
            at_most("adaptation.threshold", adaptation.threshold, 0.0)?;
        }
        let touching = self.minimum_gap + self.gap_tolerance;
        let rest = ("rest_distance", self.rest_distance);
        ordered(("minimum_gap + gap_tolerance", touching), rest)?;
        ordered(rest, ("activation_distance", self.activation_distance))?;
        not_negative("damping_time", self.damping_time)?;
        not_negative("look_ahead_limit", self.look_ahead_limit)?;
        let rounds = f64::from(self.implicit_rounds);
        at_most("implicit_rounds", rounds, f64::from(MAX_IMPLICIT_ROUNDS))?;
        if self.max_constraints == 0 || self.max_substeps == 0 || self.max_advancement_steps == 0 {
            return Err(SettingsError::ZeroCapacity);
        }
        Ok(())
    }
}

fn positive(key: &'static str, value: f64) -> Result<(), SettingsError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(SettingsError::NotPositive { key, value })
}

fn not_negative(key: &'static str, value: f64) -> Result<(), SettingsError> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(SettingsError::Negative { key, value })
}

fn at_most(key: &'static str, value: f64, limit: f64) -> Result<(), SettingsError> {
    if value.is_finite() && value <= limit {
        return Ok(());
    }
    Err(SettingsError::Above { key, value, limit })
}

fn ordered(
    (smaller, small): (&'static str, f64),
    (larger, large): (&'static str, f64),
) -> Result<(), SettingsError> {
    // False for NaN.
    if small < large {
        return Ok(());
    }
    Err(SettingsError::NotOrdered {
        smaller,
        small,
        larger,
        large,
    })
}

/// What is wrong with the settings.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// A number that must be positive and finite is not.
    #[error("{key} is {value}, but must be a finite number greater than zero")]
    NotPositive {
        /// The setting's name.
        key: &'static str,
        /// What was given.
        value: f64,
    },
    /// A number that must be finite and not negative is not.
    #[error("{key} is {value}, but must be a finite number, zero or more")]
    Negative {
        /// The setting's name.
        key: &'static str,
        /// What was given.
        value: f64,
    },
    /// A number is above what the method allows.
    #[error("{key} is {value}, but must not be above {limit}")]
    Above {
        /// The setting's name.
        key: &'static str,
        /// What was given.
        value: f64,
        /// The largest allowed value.
        limit: f64,
    },
    /// Two lengths are the wrong way round.
    #[error("{smaller} ({small} m) must be smaller than {larger} ({large} m)")]
    NotOrdered {
        /// The name of the length that must be smaller.
        smaller: &'static str,
        /// Its value, m.
        small: f64,
        /// The name of the length that must be larger.
        larger: &'static str,
        /// Its value, m.
        large: f64,
    },
    /// A capacity or iteration limit is zero.
    #[error("max_constraints, max_substeps and max_advancement_steps must be at least 1")]
    ZeroCapacity,
}
