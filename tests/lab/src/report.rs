//! The table of all rows, and the files behind it.
//!
//! | file           | a row is                                                                          |
//! |----------------|-----------------------------------------------------------------------------------|
//! | `table.md`     | a recipe for a player at a rate: what it missed                                   |
//! | `rows.csv`     | a measure of that, the worst over start phases, against its pass line: a [`Row`]  |
//! | `measures.csv` | a run from one start phase, with every measure                                    |
//! | `trials.csv`   | a tuning that was tried                                                           |
//! | `times.csv`    | a recipe for a method at a rate, with its CPU times: these alone differ           |
//! | `chart.csv`    | a point of the chart, its last columns a time and what follows from it            |
//! | `traces.csv`   | a force at an instant, of a few recipes                                           |

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use crate::costs;
use crate::measure::Measure;
use crate::outcome::Outcome;
use crate::row::{Row, Verdict};
use crate::score::Score;

/// What was missed of these rows, each by how much; `pass` where nothing was, `open` where that is known.
pub fn verdict(rows: &[Row]) -> String {
    let mut missed = Vec::new();
    let (mut failed, mut lines) = (false, false);
    for row in rows {
        lines |= row.limit.is_some();
        let by = || {
            let limit = row.limit.map_or_else(|| "none".to_owned(), brief);
            format!(
                "{} {} > {limit} {}",
                row.measure,
                brief(row.value),
                row.unit
            )
        };
        match &row.verdict {
            Verdict::Pass | Verdict::Shown => {}
            Verdict::Fail => {
                failed = true;
                missed.push(by());
            }
            Verdict::Open(reason) => missed.push(format!("{} ({reason})", by())),
            Verdict::OutOfScope(reason) => return format!("out of scope: {reason}"),
        }
    }
    match (missed.is_empty(), failed) {
        (false, true) => format!("FAIL: {}", missed.join("; ")),
        (false, false) => format!("OPEN: {}", missed.join("; ")),
        (true, _) if lines => "pass".to_owned(),
        (true, _) => "shown".to_owned(),
    }
}

/// What each method came to in the cases that all of them can run, and whose costs were charged.
pub fn headlines(scores: &[Score]) -> String {
    let mut text = format!("Costs of updates: {}.\n\n", costs::machine());
    for score in scores {
        let _ = writeln!(text, "- {}", score.headline());
    }
    text.push('\n');
    text
}

/// The table for people: costs are those of the committed table, so it is the same in every run.
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| recipe | case | method | settings | asked | held | of a core | J p95 | verdict |\n",
    );
    text.push_str(
        "|--------|------|--------|----------|-------|------|-----------|-------|---------|\n",
    );
    for group in rows.chunk_by(|a, b| player(a) == player(b)) {
        let (recipe, case, method, settings, rate) = player(&group[0]);
        let rate = rate.map_or_else(String::new, |rate| format!("{rate} Hz"));
        let felt = felt(group).map_or_else(String::new, brief);
        let verdict = verdict(group);
        let load = group[0].load.map_or_else(
            || "|".to_owned(),
            |load| format!("{:.0} Hz | {} %", load.held, brief(100.0 * load.core)),
        );
        let _ = writeln!(
            text,
            "| {recipe} | {case} | {method} | {settings} | {rate} | {load} | {felt} | {verdict} |"
        );
    }
    text
}

/// The error felt, among the rows of a player; NaN where there is no right answer.
pub(crate) fn felt(rows: &[Row]) -> Option<f64> {
    let its = rows.iter().find(|row| row.measure == Measure::JndP95.key());
    its.map(|row| row.value)
}

fn player(row: &Row) -> (&str, &str, &str, &str, Option<u32>) {
    (row.recipe, &row.case, &row.method, &row.settings, row.rate)
}

/// Writes all files but those of the chart.
pub fn write(
    rows: &[Row],
    outcomes: &[Outcome],
    scores: &[Score],
    directory: &Path,
) -> io::Result<()> {
    fs::create_dir_all(directory)?;
    let table = format!("{}{}", headlines(scores), table(rows));
    fs::write(directory.join("table.md"), table)?;
    fs::write(directory.join("rows.csv"), rows_csv(rows))?;
    fs::write(directory.join("measures.csv"), measures(outcomes))?;
    fs::write(directory.join("trials.csv"), trials(outcomes))?;
    fs::write(directory.join("times.csv"), times(outcomes))
}

/// Rows as CSV, without their times.
pub fn rows_csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "recipe,case,method,settings,rate_hz,held_hz,core_share,measure,value,unit,limit,verdict,reason\n",
    );
    for row in rows {
        let rate = row.rate.map_or_else(String::new, |rate| rate.to_string());
        let limit = row.limit.map_or_else(String::new, |l| format!("{l:.6e}"));
        let (held, core) = row.load.map_or_else(Default::default, |load| {
            (format!("{:.1}", load.held), format!("{:.4e}", load.core))
        });
        let reason = match &row.verdict {
            Verdict::Open(reason) => reason,
            Verdict::OutOfScope(reason) => reason.as_str(),
            Verdict::Pass | Verdict::Fail | Verdict::Shown => "",
        };
        let _ = writeln!(
            text,
            "{},{},{},{},{rate},{held},{core},{},{:.6e},{},{limit},{},{}",
            row.recipe,
            quoted(&row.case),
            quoted(&row.method),
            quoted(&row.settings),
            quoted(&row.measure),
            row.value,
            quoted(&row.unit),
            row.verdict,
            quoted(reason)
        );
    }
    text
}

/// A text as one field of a CSV.
pub(crate) fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// The columns that name an outcome.
pub(crate) const KEYS: &str = "recipe,case,method,settings,rate_hz";

pub(crate) fn keys(outcome: &Outcome) -> String {
    format!(
        "{},{},{},{},{}",
        outcome.recipe,
        quoted(&outcome.case),
        outcome.method.name(),
        outcome.tuning,
        outcome.rate
    )
}

fn measures(outcomes: &[Outcome]) -> String {
    let mut text = format!("{KEYS},phase");
    for measure in Measure::ALL {
        let unit = measure
            .unit()
            .replace([' ', '/'], "_")
            .replace('%', "percent");
        let _ = write!(text, ",{}_{}", measure.key(), unit.replace('-', "share"));
    }
    text.push('\n');
    for outcome in outcomes {
        for (phase, values) in outcome.measured.phases.iter().enumerate() {
            let _ = write!(text, "{},{phase}", keys(outcome));
            for measure in Measure::ALL {
                let _ = write!(text, ",{:.6e}", values.get(*measure));
            }
            text.push('\n');
        }
    }
    text
}

fn trials(outcomes: &[Outcome]) -> String {
    let mut text = String::from("recipe,case,method,chosen,rate_hz,tried,missed_lines,j\n");
    for outcome in outcomes {
        for trial in &outcome.trials {
            let keys = keys(outcome);
            let _ = writeln!(
                text,
                "{keys},{},{},{:.6e}",
                trial.tuning, trial.missed, trial.felt
            );
        }
    }
    text
}

fn times(outcomes: &[Outcome]) -> String {
    let mut text = format!("{KEYS},update_p50_us,update_p99_us,force_p50_us,force_p99_us\n");
    for outcome in outcomes {
        let times = outcome.measured.times;
        let ([u50, u99], [f50, f99]) = (times.update, times.force);
        let _ = writeln!(
            text,
            "{},{u50:.2},{u99:.2},{f50:.2},{f99:.2}",
            keys(outcome)
        );
    }
    text
}

/// Three digits.
pub(crate) fn brief(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".into()
    } else if !(1e-2..1000.0).contains(&size) {
        format!("{value:.2e}")
    } else if size >= 10.0 {
        format!("{value:.1}")
    } else {
        format!("{value:.3}")
    }
}
