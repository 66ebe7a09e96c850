//! What a recipe says: one measured number against what is expected.

use std::fmt;

/// A row of the report.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Which case of the recipe.
    pub case: String,
    /// What was measured, with its unit.
    pub measured: String,
    /// What it must be.
    pub expected: String,
    /// Whether it is.
    pub pass: bool,
}

impl Row {
    /// A number that must be within a share of the expected one.
    pub fn within(
        case: impl fmt::Display,
        measured: f64,
        expected: f64,
        share: f64,
        unit: &str,
    ) -> Self {
        Self {
            case: case.to_string(),
            measured: format!("{} {unit}", brief(measured)),
            expected: format!("{} {unit} +- {} %", brief(expected), brief(share * 100.0)),
            pass: (measured - expected).abs() <= share * expected.abs(), // false for NaN
        }
    }

    /// A number that must not be above a limit.
    pub fn at_most(case: impl fmt::Display, measured: f64, limit: f64, unit: &str) -> Self {
        Self {
            case: case.to_string(),
            measured: format!("{} {unit}", brief(measured)),
            expected: format!("<= {} {unit}", brief(limit)),
            pass: measured <= limit, // false for NaN
        }
    }

    /// Something that must be so.
    pub fn holds(
        case: impl fmt::Display,
        measured: impl fmt::Display,
        expected: impl fmt::Display,
        pass: bool,
    ) -> Self {
        Self {
            case: case.to_string(),
            measured: measured.to_string(),
            expected: expected.to_string(),
            pass,
        }
    }
}

/// Rows whose cases begin alike: `NAME: what`.
#[derive(Debug)]
pub(crate) struct Rows {
    name: String,
    pub(crate) all: Vec<Row>,
}

impl Rows {
    /// None yet.
    pub(crate) fn of(name: impl fmt::Display) -> Self {
        Self {
            name: name.to_string(),
            all: Vec::new(),
        }
    }

    /// A number that must not be above a limit.
    pub(crate) fn at_most(&mut self, what: &str, measured: f64, limit: f64, unit: &str) {
        let case = format!("{}: {what}", self.name);
        self.all.push(Row::at_most(case, measured, limit, unit));
    }

    /// Something that must be so.
    pub(crate) fn holds(
        &mut self,
        what: &str,
        measured: impl fmt::Display,
        expected: impl fmt::Display,
        pass: bool,
    ) {
        let case = format!("{}: {what}", self.name);
        self.all.push(Row::holds(case, measured, expected, pass));
    }
}

/// Four digits.
fn brief(value: f64) -> String {
    let size = value.abs();
    if size >= 1000.0 {
        format!("{value:.0}")
    } else if size >= 1.0 {
        format!("{value:.2}")
    } else if size >= 1e-3 {
        format!("{value:.4}")
    } else if size == 0.0 {
        "0".to_owned()
    } else {
        format!("{value:.2e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_is_none_passes_nothing() {
        assert!(!Row::within("", f64::NAN, 1.0, 0.5, "N").pass);
        assert!(!Row::at_most("", f64::NAN, 1.0, "N").pass);
        assert!(Row::within("", 1.01, 1.0, 0.02, "N").pass);
        assert!(!Row::within("", 1.03, 1.0, 0.02, "N").pass);
    }
}
