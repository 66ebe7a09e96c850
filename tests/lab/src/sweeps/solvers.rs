//! The three solvers of the projection by the number of contacts, against the oracle of R38.

use super::{Cost, Point, Runs, Sweep};
use crate::recipes::{Extent, STUDIES};

pub(super) const SWEEP: Sweep = Sweep {
    name: "solvers",
    about: "solvers by the number of random contacts, each with its own tolerance and cap, against non-negative least squares",
    error: "relative error",
    cost: Cost::Time,
    runs: Runs::Own(run),
};

/// The study, and its row that has the error.
const STUDY: &str = "R38";
const MEASURE: &str = "relative_error";

fn run(extent: Extent, _threads: usize) -> Vec<Point> {
    let study = STUDIES.iter().filter(|study| study.name == STUDY);
    study
        .flat_map(|study| (study.run)(extent))
        .filter(|row| row.measure == MEASURE)
        .map(|row| Point {
            recipe: row.recipe,
            case: row.case,
            setting: row.settings,
            rate: None,
            error: row.value,
            cost: row.p99_us,
            measures: Vec::new(),
        })
        .collect()
}
