//! The three solvers of the projection by tolerance and by cap of iterations, on random contacts, against the oracle of R38.

use god_object::quasi_statics::SolverLimits;

use super::{Cost, Point, Runs, Sweep};
use crate::crew;
use crate::recipes::{Extent, SolverName, random_contacts};

pub(super) const SWEEP: Sweep = Sweep {
    name: "solver-limits",
    about: "solvers by tolerance and by cap of iterations, not polished, against non-negative least squares",
    error: "relative error",
    cost: Cost::Time,
    runs: Runs::Own(run),
};

/// Contacts of a projection.
const COUNTS: [usize; 2] = [12, 200];
/// Tolerances without a cap, and caps at the finest tolerance.
const TOLERANCES: [f64; 5] = [1e-1, 1e-3, 1e-6, 1e-9, 1e-13];
const CAPS: [u32; 6] = [1, 3, 10, 30, 100, 1000];
/// No cap.
const ALL: u32 = 10_000;
const FINEST: f64 = 1e-13;

fn run(extent: Extent, threads: usize) -> Vec<Point> {
    let by_tolerance = TOLERANCES.map(|tolerance| {
        let value = format!("{tolerance:e}");
        ("by tolerance", value, tolerance, ALL)
    });
    let by_cap = CAPS.map(|cap| ("by cap of iterations", cap.to_string(), FINEST, cap));
    let limits: Vec<_> = by_tolerance.into_iter().chain(by_cap).collect();
    let mut tasks = Vec::new();
    for count in COUNTS {
        for (kind, name) in SolverName::ALL {
            tasks.extend(limits.iter().map(|limits| (count, kind, name, limits)));
        }
    }
    crew::map(threads, &tasks, |(count, kind, name, limits)| {
        let (by, value, tolerance, max_iterations) = limits;
        let limits = SolverLimits {
            tolerance: *tolerance,
            max_iterations: *max_iterations,
        };
        let (error, p99_us) = random_contacts(extent, *count, *kind, limits);
        Point {
            recipe: "R38",
            case: format!("{count} contacts, {by}"),
            setting: format!("{name} {value}"),
            rate: None,
            error,
            cost: p99_us,
            measures: Vec::new(),
        }
    })
}
