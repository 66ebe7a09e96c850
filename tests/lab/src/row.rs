//! The one type of row that everything the laboratory says is made of.

use std::fmt;

use crate::measured::Load;

/// What came of one measure.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// The pass line is kept.
    Pass,
    /// It is not.
    Fail,
    /// It is not, and this is known of this project's own method: the reason.
    Open(&'static str),
    /// There is no pass line: the number is shown.
    Shown,
    /// The recipe was not run for this player: the reason.
    OutOfScope(String),
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pass => write!(f, "pass"),
            Self::Fail => write!(f, "fail"),
            Self::Open(_) => write!(f, "open"),
            Self::Shown => write!(f, "shown"),
            Self::OutOfScope(_) => write!(f, "out of scope"),
        }
    }
}

/// One number: what was run by whom, what was measured, and what passes.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Of the recipe, such as `R11`.
    pub recipe: &'static str,
    /// Of the recipe.
    pub case: String,
    /// A method, a solver, or whoever else was run.
    pub method: String,
    /// With what.
    pub settings: String,
    /// Updates a second, Hz; `None` where there are none.
    pub rate: Option<u32>,
    /// What was measured.
    pub measure: String,
    /// The worst over the start phases; NaN where nothing was measured.
    pub value: f64,
    /// Of value and limit.
    pub unit: String,
    /// Most that passes; `None` where there is no line.
    pub limit: Option<f64>,
    /// What came of it.
    pub verdict: Verdict,
    /// What it took on the virtual clock; `None` where there are no updates.
    pub load: Option<Load>,
    /// 99th percentile of the CPU time of an update, us; NaN where none was taken. No other field differs between runs.
    pub p99_us: f64,
}

impl Row {
    /// A row of a recipe for a player, without a measure yet.
    pub fn new(recipe: &'static str, case: impl fmt::Display, method: impl fmt::Display) -> Self {
        Self {
            recipe,
            case: case.to_string(),
            method: method.to_string(),
            settings: String::new(),
            rate: None,
            measure: String::new(),
            value: f64::NAN,
            unit: String::new(),
            limit: None,
            verdict: Verdict::Shown,
            load: None,
            p99_us: f64::NAN,
        }
    }

    /// A number that must not be above a limit.
    #[must_use]
    pub fn at_most(self, measure: &str, value: f64, unit: &str, limit: f64) -> Self {
        let pass = value <= limit; // false for NaN
        Self {
            measure: measure.to_owned(),
            value,
            unit: unit.to_owned(),
            limit: Some(limit),
            verdict: if pass { Verdict::Pass } else { Verdict::Fail },
            ..self
        }
    }

    /// A number that is shown.
    #[must_use]
    pub fn shown(self, measure: &str, value: f64, unit: &str) -> Self {
        Self {
            measure: measure.to_owned(),
            value,
            unit: unit.to_owned(),
            ..self
        }
    }

    /// Something that must be so: how many times it is not must be 0.
    #[must_use]
    pub fn never(self, measure: &str, times: usize) -> Self {
        self.at_most(measure, times as f64, "times", 0.0)
    }

    /// Whether its pass line is not kept, be that known or not.
    pub(crate) fn is_missed(&self) -> bool {
        matches!(self.verdict, Verdict::Fail | Verdict::Open(_))
    }

    /// Why it was not run.
    #[must_use]
    pub fn out_of_scope(self, reason: impl fmt::Display) -> Self {
        Self {
            verdict: Verdict::OutOfScope(reason.to_string()),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_is_none_passes_nothing() {
        let row = Row::new("R00", "case", "ours");
        assert_eq!(
            row.clone().at_most("m", 1.0, "N", 1.0).verdict,
            Verdict::Pass
        );
        assert_eq!(
            row.clone().at_most("m", 1.1, "N", 1.0).verdict,
            Verdict::Fail
        );
        assert_eq!(row.at_most("m", f64::NAN, "N", 1.0).verdict, Verdict::Fail);
    }
}
