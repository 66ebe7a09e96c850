//! The choice with its reasons, as it is printed and put into reports.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Who chose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// The scene's need.
    Auto,
    /// The file, or the command line.
    Set,
}

/// One setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// The key that overrides it.
    pub key: String,
    /// With its unit.
    pub value: String,
    /// Who chose.
    pub origin: Origin,
    /// Why.
    pub reason: String,
}

/// What was chosen for a scene, and what is predicted of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FidelityPlan {
    /// Most error, in just-noticeable differences.
    pub budget_j: f64,
    /// Most time of an update, us, if the scene bounds it.
    pub time_us: Option<f64>,
    /// Predicted error, in just-noticeable differences.
    pub predicted_j: f64,
    /// Predicted nominal time of an update, us.
    pub predicted_update_us: f64,
    /// Updates of the god-object per second.
    pub update_rate_hz: f64,
    /// States to each client per second.
    pub broadcast_rate_hz: f64,
    /// Contacts in a state.
    pub contacts: u32,
    /// The speed of the hand that the choice is for, m/s.
    pub speed_m_s: f64,
    /// The turn rate that it is for, rad/s.
    pub turn_rate_rad_s: f64,
    /// Each setting.
    pub choices: Vec<Choice>,
}

impl FidelityPlan {
    /// Takes another rate of updates than the chosen one, named by `by`.
    pub fn use_update_rate(&mut self, rate: f64, by: &str) {
        self.update_rate_hz = rate;
        for choice in &mut self.choices {
            if choice.key == "fidelity.update_rate" {
                choice.value = format!("{rate} Hz");
                choice.origin = Origin::Set;
                choice.reason = format!("{by}; the predicted J is that of the choice");
            }
        }
    }

    /// Most time that an update may take, us: the budget's, or else the period.
    #[must_use]
    pub fn update_limit_us(&self) -> f64 {
        self.time_us.unwrap_or(1e6 / self.update_rate_hz)
    }

    /// Whether what is predicted is within the budget.
    #[must_use]
    pub fn is_within(&self) -> bool {
        let late = self
            .time_us
            .is_some_and(|time| self.predicted_update_us > time);
        self.predicted_j <= self.budget_j && !late
    }

    /// One line for each setting, the sum first.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let time = self
            .time_us
            .map_or(String::new(), |time| format!(", {time} us an update"));
        let verdict = if self.is_within() {
            ""
        } else {
            "; NOT within the budget: allow more, or slow the hand down"
        };
        let mut lines = vec![format!(
            "fidelity auto: budget J <= {}{time}; predicted J {:.2}, {:.0} us an update, at up to {:.3} m/s and {:.2} rad/s{verdict} (J is the error of the force over the least that people feel)",
            self.budget_j,
            self.predicted_j,
            self.predicted_update_us,
            self.speed_m_s,
            self.turn_rate_rad_s
        )];
        lines.extend(self.choices.iter().map(|choice| {
            let origin = match choice.origin {
                Origin::Auto => "auto",
                Origin::Set => "set",
            };
            format!(
                "  {} = {} ({origin}): {}",
                choice.key, choice.value, choice.reason
            )
        }));
        lines
    }
}

impl fmt::Display for FidelityPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.lines().join("\n"))
    }
}
