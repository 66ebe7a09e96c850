//! The table of all outcomes, and the files behind it.
//!
//! | file           | a row is                                                                  |
//! |----------------|---------------------------------------------------------------------------|
//! | `lines.csv`    | a pass line of a recipe, for a method at a rate, with the worst over phases |
//! | `measures.csv` | a run from one start phase, with every measure                            |
//! | `times.csv`    | a recipe for a method at a rate, with its CPU times: these alone differ    |
//! | `chart.csv`    | a point of the chart                                                      |

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use crate::measure::Measure;
use crate::outcome::Outcome;

/// The pass lines that were missed, each by how much, or `pass`.
#[must_use]
pub fn verdict(outcome: &Outcome) -> String {
    let missed: Vec<String> = outcome
        .lines
        .iter()
        .filter(|(_, passes)| !passes)
        .map(|(line, _)| {
            let (key, unit) = (line.measure.key(), line.measure.unit());
            let worst = outcome.worst(line.measure);
            format!("{key} {} > {} {unit}", brief(worst), brief(line.limit))
        })
        .collect();
    if missed.is_empty() {
        "pass".into()
    } else {
        format!("FAIL: {}", missed.join("; "))
    }
}

/// The table for people: no times, the same in every run.
#[must_use]
pub fn table(outcomes: &[Outcome]) -> String {
    let mut text = String::from("| recipe | case | method | tuning | rate | J | verdict |\n");
    text.push_str("|--------|------|--------|--------|------|---|---------|\n");
    for o in outcomes {
        let felt = brief(o.worst(Measure::Felt));
        let (name, verdict) = (o.method.name(), verdict(o));
        let _ = writeln!(
            text,
            "| {} | {} | {name} | {} | {} Hz | {felt} | {verdict} |",
            o.recipe, o.case, o.tuning, o.rate
        );
    }
    text
}

/// Writes `table.md`, `lines.csv`, `measures.csv` and `times.csv`.
pub fn write(outcomes: &[Outcome], directory: &Path) -> io::Result<()> {
    fs::create_dir_all(directory)?;
    fs::write(directory.join("table.md"), table(outcomes))?;
    fs::write(directory.join("lines.csv"), lines(outcomes))?;
    fs::write(directory.join("measures.csv"), measures(outcomes))?;
    fs::write(directory.join("times.csv"), times(outcomes))
}

/// The columns that name an outcome.
pub(crate) const KEYS: &str = "recipe,case,method,tuning,rate_hz";

pub(crate) fn keys(outcome: &Outcome) -> String {
    format!(
        "{},\"{}\",{},{},{}",
        outcome.recipe,
        outcome.case,
        outcome.method.name(),
        outcome.tuning,
        outcome.rate
    )
}

fn lines(outcomes: &[Outcome]) -> String {
    let mut text = format!("{KEYS},measure,unit,worst,mean,limit,passes\n");
    for outcome in outcomes {
        for (line, passes) in &outcome.lines {
            let _ = writeln!(
                text,
                "{},{},{},{:.6e},{:.6e},{:.6e},{passes}",
                keys(outcome),
                line.measure.key(),
                line.measure.unit(),
                outcome.worst(line.measure),
                outcome.mean(line.measure),
                line.limit
            );
        }
    }
    text
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
        for (phase, values) in outcome.phases.iter().enumerate() {
            let _ = write!(text, "{},{phase}", keys(outcome));
            for measure in Measure::ALL {
                let _ = write!(text, ",{:.6e}", values.get(*measure));
            }
            text.push('\n');
        }
    }
    text
}

fn times(outcomes: &[Outcome]) -> String {
    let mut text = format!("{KEYS},update_p50_us,update_p99_us,force_p50_us,force_p99_us\n");
    for outcome in outcomes {
        let ([u50, u99], [f50, f99]) = (outcome.times.update, outcome.times.force);
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
