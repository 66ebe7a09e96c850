//! A row of the report: one figure against its target.

use std::fmt;

/// Whether a target is met.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is.
    Met,
    /// It is not.
    Missed,
    /// It is not, but the control of the same run is not either: the machine cannot tell.
    Noisy {
        /// The control in the unit of the row, as text.
        control: String,
    },
    /// Nothing was measured; why.
    Unknown(String),
}

/// A row.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What is measured.
    pub measure: String,
    /// What it must be.
    pub target: String,
    /// What it is, with its unit and its control.
    pub measured: String,
    /// Whether that is met.
    pub verdict: Verdict,
    /// Broken, this is a fault of the code wherever it runs; the others depend on the machine.
    pub invariant: bool,
}

impl Row {
    /// A figure that must not be above a limit; NaN is above any.
    #[must_use]
    pub fn at_most(
        measure: impl fmt::Display,
        value: f64,
        limit: f64,
        unit: &str,
        beside: impl fmt::Display,
    ) -> Row {
        Row {
            measure: measure.to_string(),
            target: format!("<= {} {unit}", brief(limit)),
            measured: format!("{} {unit} ({beside})", brief(value)),
            verdict: verdict(value <= limit),
            invariant: false,
        }
    }

    /// The same, with a control of the same run: where both are above the limit, nothing is said of the target but that the machine is noisier than it.
    #[must_use]
    pub fn at_most_beside(
        measure: impl fmt::Display,
        value: f64,
        limit: f64,
        unit: &str,
        (what, control): (&str, f64),
        beside: impl fmt::Display,
    ) -> Row {
        let mut row = Row::at_most(measure, value, limit, unit, beside);
        if row.verdict == Verdict::Missed && value > limit && control > limit {
            row.verdict = Verdict::Noisy {
                control: format!("{what} {} {unit}", brief(control)),
            };
        }
        row
    }

    /// Something that must be so on every machine.
    #[must_use]
    pub fn invariant(
        measure: impl fmt::Display,
        target: impl fmt::Display,
        measured: impl fmt::Display,
        holds: bool,
    ) -> Row {
        Row {
            measure: measure.to_string(),
            target: target.to_string(),
            measured: measured.to_string(),
            verdict: verdict(holds),
            invariant: true,
        }
    }

    /// A figure that was not taken.
    #[must_use]
    pub fn unknown(
        measure: impl fmt::Display,
        target: impl fmt::Display,
        why: impl fmt::Display,
    ) -> Row {
        Row {
            measure: measure.to_string(),
            target: target.to_string(),
            measured: "-".to_owned(),
            verdict: Verdict::Unknown(why.to_string()),
            invariant: false,
        }
    }
}

fn verdict(met: bool) -> Verdict {
    if met { Verdict::Met } else { Verdict::Missed }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Verdict::Met => f.write_str("met"),
            Verdict::Missed => f.write_str("NOT MET"),
            Verdict::Noisy { control } => {
                write!(f, "machine noisier than the target: control {control}")
            }
            Verdict::Unknown(why) => write!(f, "not measured: {why}"),
        }
    }
}

/// The rows as a table.
pub fn table(rows: &[Row]) -> String {
    let mut text = "| measure | target | measured | |\n|---|---|---|---|\n".to_owned();
    for row in rows {
        text += &format!(
            "| {} | {} | {} | {} |\n",
            row.measure, row.target, row.measured, row.verdict
        );
    }
    text
}

/// The rows as CSV, RFC 4180.
pub fn csv(rows: &[Row]) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut text = "measure,target,measured,verdict\n".to_owned();
    for row in rows {
        let cells = [
            &row.measure,
            &row.target,
            &row.measured,
            &row.verdict.to_string(),
        ];
        text += &cells.map(|cell| quoted(cell)).join(",");
        text.push('\n');
    }
    text
}

/// The largest figure of some runs; NaN, a run without one, is the largest of all.
pub(super) fn worst<T>(runs: &[T], of: impl Fn(&T) -> f64) -> f64 {
    let figures = runs.iter().map(of);
    figures.max_by(f64::total_cmp).unwrap_or(f64::NAN)
}

/// A few digits.
pub(super) fn brief(value: f64) -> String {
    match value.abs() {
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_that_is_none_meets_nothing() {
        let row = |value| Row::at_most("a", value, 1.0, "us", "b").verdict;
        assert_eq!(row(1.0), Verdict::Met);
        assert_eq!(row(1.1), Verdict::Missed);
        assert_eq!(row(f64::NAN), Verdict::Missed);
    }

    #[test]
    fn a_figure_above_its_limit_is_missed_unless_the_control_is_above_it_too() {
        let row =
            |value, control| Row::at_most_beside("a", value, 1.0, "us", ("p99", control), "b");
        assert_eq!(row(1.0, 5.0).verdict, Verdict::Met);
        assert_eq!(row(1.1, 0.9).verdict, Verdict::Missed);
        assert_eq!(row(f64::NAN, 5.0).verdict, Verdict::Missed);
        let noisy = row(1.1, 2.0).verdict.to_string();
        assert_eq!(
            noisy,
            "machine noisier than the target: control p99 2.000 us"
        );
    }

    #[test]
    fn cells_with_quotes_survive_the_csv() {
        let rows = [Row::unknown("a, \"b\"", "c", "d")];
        let expected =
            "measure,target,measured,verdict\n\"a, \"\"b\"\"\",\"c\",\"-\",\"not measured: d\"\n";
        assert_eq!(csv(&rows), expected);
    }
}
