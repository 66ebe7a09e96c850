//! Clarabel, an interior-point method: the accuracy reference, and the last resort.
//!
//! Default tolerances (1e-8) are not a reference; they are tightened to what doubles can do, and the answer is polished on the
//! rows that the method found to carry force. Allocates: never called from a loop that must not.
//!
//! Source: Goulart, Chen 2024, "Clarabel: An interior-point solver for conic programs with quadratic objectives".

use super::certificate::{ActiveRows, Certificate, active_rows};
use super::least_distance::LeastDistance;
use super::projection::SolverKind;
use super::reduction::reduce;
use super::solve::{Answer, Outcome, Solve, SolverLimits};
use super::working_set::{Refinement, WorkingSet};
use crate::spatial::Vector6;
use ::clarabel::algebra::CscMatrix;
use ::clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus,
};
use arrayvec::ArrayVec;

/// Duality gap and feasibility at which Clarabel may stop, relative to the problem, which is scaled to one. The next one is
/// tried where doubles do not reach the one before; the last is Clarabel's own default.
const TOLERANCES: [f64; 3] = [1e-13, 1e-11, 1e-8];

/// Most interior-point iterations per attempt; some 15 are usual.
const MAX_ITERATIONS: u32 = 60;

/// A multiplier below this share of the largest one is the interior point's distance from the boundary, not a force.
const FORCE_THRESHOLD: f64 = 1e-9;

/// The polished answer is taken if it violates no row by more than this, relative to the problem's scale.
const POLISHED_VIOLATION: f64 = 1e-12;

/// The solver; see the file head. With limits it tries once, and its answer is not polished.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clarabel {
    pub(crate) limits: Option<SolverLimits>,
}

impl Solve for Clarabel {
    fn kind(&self) -> SolverKind {
        SolverKind::Clarabel
    }

    fn solve(&mut self, problem: &LeastDistance, _warm_start: &[u32]) -> Answer {
        let answer = |y: &Vector6, active: ActiveRows, outcome, iterations| Answer {
            certificate: Certificate::new(problem, &problem.scan(y), &active),
            active,
            outcome,
            iterations,
        };
        let rows: Vec<usize> = (0..problem.rows.len())
            .filter(|row| problem.can_bind(*row))
            .collect();
        let deepest = problem.scan(&Vector6::zeros()).violation();
        let outside = deepest > POLISHED_VIOLATION * problem.scale();
        if !outside {
            return answer(&Vector6::zeros(), ActiveRows::new(), Outcome::Optimal, 0);
        }

        // Lengths in units of the deepest violation: the answer has at least that length.
        let mut best: Option<InteriorPoint> = None;
        let mut iterations = 0;
        let attempts: ArrayVec<SolverLimits, 3> = match self.limits {
            Some(limits) => ArrayVec::from_iter([limits]),
            None => TOLERANCES
                .map(|tolerance| SolverLimits {
                    tolerance,
                    max_iterations: MAX_ITERATIONS,
                })
                .into(),
        };
        for limits in attempts {
            best = interior_point(problem, &rows, deepest, limits);
            iterations += best.as_ref().map_or(0, |found| found.iterations);
            if best
                .as_ref()
                .is_some_and(|found| found.outcome != Outcome::IterationLimit)
            {
                break;
            }
        }
        let Some(found) = best else {
            let nothing = Vector6::zeros();
            return answer(
                &nothing,
                ActiveRows::new(),
                Outcome::IterationLimit,
                iterations,
            );
        };
        let largest = found.multipliers.iter().copied().fold(0.0, f64::max);
        let mut forces: Vec<(u32, f64)> = rows
            .iter()
            .zip(&found.multipliers)
            .filter(|(_, m)| **m > FORCE_THRESHOLD * largest)
            .map(|(row, m)| (*row as u32, *m))
            .collect();
        // The strongest first: they are the surest to be active.
        forces.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut set = WorkingSet::new();
        reduce(problem, forces.into_iter(), &mut set);
        let unpolished = active_rows(&set);

        if self.limits.is_some() {
            return answer(&found.correction, unpolished, found.outcome, iterations);
        }
        let polished = set.settle(Refinement::Once);
        let tolerance = POLISHED_VIOLATION * (problem.scale() + polished.norm());
        if found.outcome != Outcome::Infeasible && problem.scan(&polished).violation() <= tolerance
        {
            answer(&polished, active_rows(&set), found.outcome, iterations)
        } else {
            answer(&found.correction, unpolished, found.outcome, iterations)
        }
    }
}

struct InteriorPoint {
    correction: Vector6,
    multipliers: Vec<f64>,
    outcome: Outcome,
    iterations: u32,
}

/// `min |y|^2 / 2` subject to `-n . y + s = -h, s >= 0`, in units of `unit`.
fn interior_point(
    problem: &LeastDistance,
    rows: &[usize],
    unit: f64,
    limits: SolverLimits,
) -> Option<InteriorPoint> {
    let m = rows.len();
    let normals: Vec<Vector6> = rows.iter().map(|row| problem.normal(*row)).collect();
    let offsets: Vec<f64> = rows
        .iter()
        .map(|row| -problem.offset(*row) / unit)
        .collect();
    let columns: Vec<f64> = (0..6)
        .flat_map(|k| normals.iter().map(move |n| -n[k]))
        .collect();
    let constraint = CscMatrix::new(
        m,
        6,
        (0..=6).map(|k| k * m).collect(),
        (0..6).flat_map(|_| 0..m).collect(),
        columns,
    );
    let settings = DefaultSettings {
        verbose: false,
        max_iter: limits.max_iterations,
        tol_gap_abs: limits.tolerance,
        tol_gap_rel: limits.tolerance,
        tol_feas: limits.tolerance,
        tol_ktratio: limits.tolerance,
        ..DefaultSettings::default()
    };
    let cones = [NonnegativeConeT(m)];
    let mut solver = DefaultSolver::new(
        &CscMatrix::identity(6),
        &[0.0; 6],
        &constraint,
        &offsets,
        &cones,
        settings,
    )
    .ok()?;
    solver.solve();

    let solution = &solver.solution;
    let correction = Vector6::from_fn(|k, _| solution.x[k] * unit);
    let outcome = match solution.status {
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
            Outcome::Infeasible
        }
        SolverStatus::Solved | SolverStatus::AlmostSolved => Outcome::Optimal,
        _ => Outcome::IterationLimit,
    };
    Some(InteriorPoint {
        correction,
        multipliers: solution.z.iter().map(|z| z * unit).collect(),
        outcome,
        iterations: solution.iterations,
    })
}
