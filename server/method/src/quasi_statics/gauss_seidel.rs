//! Projected Gauss-Seidel on the multipliers: row after row is satisfied alone, again and again.
//!
//! What game engines do. Slow to converge where rows are nearly parallel or pull against each other; here for comparison only.
//! Its residual is measured like anybody's: a capped sweep count shows.
//!
//! Source: Moreau, Jean 1996; Erleben 2007, for contacts.

use super::certificate::{Certificate, active_rows};
use super::least_distance::LeastDistance;
use super::projection::SolverKind;
use super::reduction::reduce;
use super::solve::{Answer, Outcome, Solve, SolverLimits};
use super::working_set::WorkingSet;
use crate::spatial::Vector6;

/// Most sweeps over all rows; engines use 4 to 50.
pub(super) const MAX_SWEEPS: u32 = 1000;

/// A sweep that changes every multiplier by less, relative to the problem's scale, ends the search.
const CHANGE_TOLERANCE: f64 = 1e-14;

/// The solver; see the file head.
#[derive(Clone, Debug)]
pub(crate) struct GaussSeidel {
    multipliers: Vec<f64>,
    set: WorkingSet,
    pub(crate) limits: SolverLimits,
}

impl GaussSeidel {
    /// Reserves for `max_rows`; `solve` does not allocate then.
    pub(crate) fn with_capacity(max_rows: usize) -> GaussSeidel {
        GaussSeidel {
            multipliers: Vec::with_capacity(max_rows),
            set: WorkingSet::new(),
            limits: SolverLimits {
                tolerance: CHANGE_TOLERANCE,
                max_iterations: MAX_SWEEPS,
            },
        }
    }
}

impl Solve for GaussSeidel {
    fn kind(&self) -> SolverKind {
        SolverKind::ProjectedGaussSeidel
    }

    fn solve(&mut self, problem: &LeastDistance, _warm_start: &[u32]) -> Answer {
        self.multipliers.clear();
        self.multipliers.resize(problem.rows.len(), 0.0);
        let mut y = Vector6::zeros();
        let mut outcome = Outcome::IterationLimit;
        let mut sweeps = 0;
        while sweeps < self.limits.max_iterations && outcome != Outcome::Optimal {
            sweeps += 1;
            let mut largest_change = 0.0_f64;
            for (row, multiplier) in self.multipliers.iter_mut().enumerate() {
                // Rows are unit: the violation is the step. A row that cannot bind has violation -infinity.
                let next = (*multiplier + problem.violation(row, &y)).max(0.0);
                let change = next - *multiplier;
                if change != 0.0 {
                    y += problem.normal(row) * change;
                    *multiplier = next;
                    largest_change = largest_change.max(change.abs());
                }
            }
            if largest_change <= self.limits.tolerance * (problem.scale() + y.norm()) {
                outcome = Outcome::Optimal;
            }
        }
        let forces = self
            .multipliers
            .iter()
            .enumerate()
            .filter(|(_, m)| **m > 0.0)
            .map(|(row, m)| (row as u32, *m));
        reduce(problem, forces, &mut self.set);
        let active = active_rows(&self.set);
        Answer {
            certificate: Certificate::new(problem, &problem.scan(&y), &active),
            active,
            outcome,
            iterations: sweeps,
        }
    }
}
