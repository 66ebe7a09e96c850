//! Why cases are outside the budget, in one picture: for each method and rate, in how many cases each line was missed.
//!
//! A case may miss several lines, so a row may sum to more than its cases. Every number is one of [`Score::reasons`].

use std::collections::BTreeSet;
use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use plotters::prelude::*;

use crate::chart::colour;
use crate::clock::RATES;
use crate::plot::{self, Area, Drawn};
use crate::score::Score;

/// Pixels: a cell, the column of names, the head with the names of the lines, the foot.
const CELL: (i32, i32) = (82, 22);
const NAMES: i32 = 236;
const HEAD: i32 = 150;
const FOOT: i32 = 30;
/// Between the rates.
const GAP: i32 = 30;
/// A line that some method missed in so many cases has a column of its own; the rest have one together.
const OWN_COLUMN: usize = 3;

/// Writes `reasons.svg` and `reasons.csv`.
pub(crate) fn write(scores: &[Score], directory: &Path) -> Result<(), Box<dyn Error>> {
    if scores.is_empty() {
        return Ok(());
    }
    let mut csv = String::from("method,rate_hz,cases,within,line,missed\n");
    for score in scores {
        let (method, rate) = (score.method.name(), score.rate);
        let (cases, within) = (score.cases.len(), score.within());
        for (line, missed) in score.reasons() {
            writeln!(csv, "{method},{rate},{cases},{within},{line},{missed}")?;
        }
    }
    std::fs::write(directory.join("reasons.csv"), csv)?;
    std::fs::write(directory.join("reasons.svg"), svg(scores)?)?;
    Ok(())
}

/// The line in words, one to a row of the head.
fn words(line: &str) -> Vec<&str> {
    match line {
        "j_p95" => vec!["error felt:", "J > 0.5 for", "5 % of time"],
        "j_share_above_1" => vec!["error felt:", "J > 1 for", "1 % of time"],
        "step" => vec!["force", "jumps"],
        "false_force" => vec!["force off", "by 0.1 N", "too long"],
        "intersections" => vec!["poses in", "which bodies", "intersect"],
        "penetration" => vec!["bodies", "intersect:", "depth"],
        "astray" => vec!["body ends", "on the", "wrong side"],
        "first_force_depth" => vec!["first force", "comes late"],
        "force_p95" => vec!["force", "differs"],
        other => other.split('_').collect(),
    }
}

/// A column of the picture: its name, and the lines that it counts.
type Column = (String, Vec<&'static str>);

/// A column for each line that somebody missed often, those most missed first, and one for the others.
fn columns(scores: &[Score]) -> Vec<Column> {
    let names: BTreeSet<_> = (scores.iter().flat_map(Score::reasons))
        .map(|reason| reason.0)
        .collect();
    let misses = |line| scores.iter().map(|s| missed(s, &[line])).sum::<usize>();
    let mut lines: Vec<_> = names.into_iter().collect();
    lines.sort_by_key(|line| std::cmp::Reverse(misses(line))); // stable: by name
    let (own, others): (Vec<_>, Vec<_>) = lines
        .into_iter()
        .partition(|line| scores.iter().any(|s| missed(s, &[line]) >= OWN_COLUMN));
    let own = own.into_iter().map(|line| (line.to_owned(), vec![line]));
    let others = (!others.is_empty()).then_some(("any_other_line".to_owned(), others));
    own.chain(others).collect()
}

/// Cases in which one of these lines was missed.
fn missed(score: &Score, lines: &[&str]) -> usize {
    let misses = |case: &&BTreeSet<&str>| lines.iter().any(|line| case.contains(line));
    score.cases.values().filter(misses).count()
}

fn svg(scores: &[Score]) -> Result<String, Box<dyn Error>> {
    let columns = columns(scores);
    let of_rate = |rate: u32| scores.iter().filter(move |score| score.rate == rate);
    let rates: Vec<u32> = RATES
        .into_iter()
        .rev()
        .filter(|rate| of_rate(*rate).next().is_some())
        .collect();
    let height = HEAD + FOOT + scores.len() as i32 * CELL.1 + rates.len() as i32 * GAP;
    let width = NAMES + (columns.len() as i32 + 1) * CELL.0 + 40;
    let cases = scores.iter().map(|score| score.cases.len()).max();
    plot::svg((width as u32, height as u32), |root| {
        root.fill(&WHITE)?;
        let picture = Picture {
            root: root.clone(),
            columns,
            cases: cases.unwrap_or(0),
        };
        picture.head()?;
        let mut y = HEAD;
        for rate in rates {
            picture.write(&format!("{rate} Hz"), (16, y - 18), 15)?;
            for score in of_rate(rate) {
                picture.row(y, score)?;
                y += CELL.1;
            }
            y += GAP;
        }
        Ok(())
    })
}

/// Where a column begins; the first is that of the cases within the budget.
fn left(column: usize) -> i32 {
    NAMES + column as i32 * CELL.0
}

struct Picture<'a> {
    root: Area<'a>,
    columns: Vec<Column>,
    /// The most that a method has.
    cases: usize,
}

impl Picture<'_> {
    fn write(&self, text: &str, at: (i32, i32), size: i32) -> Drawn {
        let style = ("sans-serif", size);
        Ok(self.root.draw(&Text::new(text.to_owned(), at, style))?)
    }

    fn head(&self) -> Drawn {
        let cases = self.cases;
        self.write(
            &format!(
                "Why cases are outside the budget: lines missed, in how many of {cases} cases"
            ),
            (16, 8),
            19,
        )?;
        self.write(
            "docs/laboratory.md says what each line is; a case may miss several",
            (16, 34),
            14,
        )?;
        self.write("cases within", (left(0) + 4, 62), 13)?;
        self.write("the budget", (left(0) + 4, 76), 13)?;
        for (index, (name, _)) in self.columns.iter().enumerate() {
            for (word, part) in words(name).into_iter().enumerate() {
                self.write(part, (left(index + 1) + 4, 62 + 14 * word as i32), 13)?;
            }
        }
        Ok(())
    }

    fn row(&self, y: i32, score: &Score) -> Drawn {
        self.write(score.method.name(), (28, y + 4), 14)?;
        let all = score.cases.len().max(1);
        let within = score.within() as f64 / all as f64;
        let shade = colour(score.method).mix(0.15 + 0.5 * within);
        let counts = self.columns.iter().map(|(_, lines)| missed(score, lines));
        let cells = std::iter::once((score.within(), shade))
            .chain(counts.map(|count| (count, RED.mix(0.7 * count as f64 / all as f64))));
        for (index, (count, fill)) in cells.enumerate() {
            let x = left(index);
            let cell = [(x, y), (x + CELL.0 - 3, y + CELL.1 - 3)];
            self.root.draw(&Rectangle::new(cell, fill.filled()))?;
            let said = match index {
                0 if score.cases.len() < self.cases => {
                    format!("{count} of {}", score.cases.len())
                }
                _ => count.to_string(),
            };
            if count > 0 || index == 0 {
                self.write(&said, (x + 20, y + 3), 14)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::method::Method;

    #[test]
    fn each_line_that_was_missed_has_a_column_and_each_score_a_row() {
        let cases = |of: [&[&'static str]; 3]| {
            let of_case = |(at, lines): (usize, &&[&'static str])| {
                (
                    (format!("R{at}"), String::new()),
                    lines.iter().copied().collect(),
                )
            };
            BTreeMap::from_iter(of.iter().enumerate().map(of_case))
        };
        let score = |method, cases| Score {
            method,
            rate: 1000,
            held: 1000.0,
            cases,
        };
        let scores = [
            score(Method::Ours, cases([&[], &["step"], &[]])),
            score(
                Method::Penalty,
                cases([
                    &["penetration", "step"],
                    &["step", "torque"],
                    &["step", "torque"],
                ]),
            ),
        ];
        let expected = [("step", 3), ("any_other_line", 3)];
        let found = columns(&scores);
        let found = found
            .iter()
            .map(|(name, lines)| (name.as_str(), missed(&scores[1], lines)));
        assert!(found.eq(expected));
        let folder = tempfile::tempdir().expect("a folder");
        write(&scores, folder.path()).expect("written");
        let read = |name| std::fs::read_to_string(folder.path().join(name)).expect("it is there");
        assert_eq!(
            read("reasons.csv"),
            "method,rate_hz,cases,within,line,missed\nours,1000,3,2,step,1\npenalty,1000,3,0,step,3\npenalty,1000,3,0,torque,2\npenalty,1000,3,0,penetration,1\n"
        );
        let svg = read("reasons.svg");
        for name in ["other", "jumps", "ours", "penalty", "1000 Hz"] {
            assert!(svg.contains(name), "{name}");
        }
    }
}
