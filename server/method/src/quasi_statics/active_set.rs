//! Dual active set for the least-distance problem in six unknowns.
//!
//! Starts at the unconstrained answer and takes in violated rows one by one; a row that would begin to pull leaves on the way.
//! The distance grows with every step, so that no working set comes twice, and the first point that violates nothing is the optimum.
//! Storage is fixed: at most six rows are independent. A warm start begins with the rows that carried the last answer: where they
//! still do, it is one small solution and one pass over the rows, which certifies it.
//!
//! Source: Goldfarb, Idnani 1983; Wilhelmsen 1976 for the cone (the solver of Ortega et al. 2007, Section 4.2).

use super::certificate::{Certificate, active_rows};
use super::least_distance::{LeastDistance, Scan};
use super::projection::SolverKind;
use super::solve::{Answer, Outcome, Solve, SolverLimits};
use super::working_set::{DEPENDENT_SINE, Refinement, WorkingSet};
use crate::spatial::Vector6;

/// A row violated by less is satisfied, relative to the problem's scale: some hundred roundings.
const FEASIBILITY_TOLERANCE: f64 = 1e-13;

/// A dependent row may stay violated by this much, relative to the problem's scale. With bounds <= 0 it never is by more
/// than `DEPENDENT_SINE`; beyond, the rows contradict each other.
const CONTRADICTION_TOLERANCE: f64 = 4.0 * DEPENDENT_SINE;

/// An answer with a larger residual is solved anew on its rows: some roundings are usual.
const POLISH_ABOVE: f64 = 1e-14;

/// Most rows taken in by one attempt. Six unknowns need about ten, thousands of rows some thirty.
pub(super) const MAX_ITERATIONS: u32 = 300;

/// Which violated row is taken in next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PivotRule {
    /// The deepest: fewest iterations.
    MostViolated,
    /// The first: another path, for a second attempt.
    FirstViolated,
}

/// The solver; see the file head.
#[derive(Clone, Debug)]
pub(crate) struct ActiveSet {
    set: WorkingSet,
    pivot_rule: PivotRule,
    pub(crate) limits: SolverLimits,
}

impl ActiveSet {
    pub(crate) fn new() -> ActiveSet {
        ActiveSet {
            set: WorkingSet::new(),
            pivot_rule: PivotRule::MostViolated,
            limits: SolverLimits {
                tolerance: FEASIBILITY_TOLERANCE,
                max_iterations: MAX_ITERATIONS,
            },
        }
    }

    /// The same solver with another order of rows.
    pub(crate) fn with_pivot_rule(&mut self, rule: PivotRule) -> &mut ActiveSet {
        self.pivot_rule = rule;
        self
    }

    /// Takes over the rows that are held in `source`, with their factorisation.
    pub(crate) fn copy_from(&mut self, source: &ActiveSet) {
        self.set.clone_from(&source.set);
    }

    /// Begins with those rows of the last answer that push here as well; returns the point they give.
    fn warm_start(&mut self, problem: &LeastDistance, rows: &[u32]) -> Vector6 {
        self.set.hold(problem, rows);
        let tolerance = self.limits.tolerance * problem.scale();
        // Where no old row is violated by a_u there is nothing to keep, and a_u itself may be the answer.
        if !self.set.has_offset_above(tolerance) {
            self.set.clear();
            return Vector6::zeros();
        }
        self.set.settle(Refinement::None)
    }

    fn pivot(&self, problem: &LeastDistance, scan: &Scan, tolerance: f64) -> (usize, f64) {
        match self.pivot_rule {
            PivotRule::MostViolated => (scan.row(), scan.violation()),
            PivotRule::FirstViolated => problem.first_violated(scan, tolerance),
        }
    }

    /// Takes `row` in, letting rows go that would pull. False if the rows held contradict it.
    fn take_in(&mut self, problem: &LeastDistance, row: usize, y: &mut Vector6) -> bool {
        let normal = problem.normal(row);
        let offset = problem.offset(row);
        let mut multiplier = 0.0;
        // Each round but the last lets a row go.
        for _ in 0..=super::projection::MAX_ACTIVE {
            let seen = self.set.decompose(&normal);
            let (dual_step, blocking) = self.set.longest_dual_step(&seen);
            let primal_step = if seen.is_dependent() {
                f64::INFINITY
            } else {
                (offset - normal.dot(y)) / seen.squared
            };
            let step = dual_step.min(primal_step);
            if step == f64::INFINITY {
                return false;
            }
            if !seen.is_dependent() {
                *y += seen.perpendicular() * step;
            }
            self.set.take_dual_step(&seen, step);
            multiplier += step;
            match blocking {
                Some(position) if dual_step < primal_step => self.set.remove(position),
                _ => {
                    self.set
                        .push(row as u32, &normal, offset, &seen, multiplier);
                    return true;
                }
            }
        }
        false
    }

    fn answer(
        &self,
        problem: &LeastDistance,
        scan: &Scan,
        outcome: Outcome,
        iterations: u32,
    ) -> Answer {
        let active = active_rows(&self.set);
        Answer {
            certificate: Certificate::new(problem, scan, &active),
            active,
            outcome,
            iterations,
        }
    }
}

impl Solve for ActiveSet {
    fn kind(&self) -> SolverKind {
        SolverKind::ActiveSet
    }

    /// No allocation; at most `limits.max_iterations` rows taken in.
    fn solve(&mut self, problem: &LeastDistance, warm_start: &[u32]) -> Answer {
        let mut y = self.warm_start(problem, warm_start);
        let mut polished = false;
        for iteration in 0..self.limits.max_iterations {
            let scan = problem.scan(&y);
            let scale = problem.scale() + y.norm();
            let tolerance = self.limits.tolerance * scale;
            let (row, violation) = self.pivot(problem, &scan, tolerance);

            let violated = violation > tolerance;
            if !violated {
                let answer = self.answer(problem, &scan, Outcome::Optimal, iteration);
                if polished || answer.certificate.residual() <= POLISH_ABOVE {
                    return answer;
                }
                // The same rows, solved anew from the problem.
                y = self.set.settle(Refinement::Once);
                polished = true;
                continue;
            }

            polished = false;
            if !self.take_in(problem, row, &mut y) {
                let scan = problem.scan(&self.set.settle(Refinement::Once));
                let remaining = problem.violation_at(row, scan.acceleration());
                let outcome = if remaining <= CONTRADICTION_TOLERANCE * scale {
                    Outcome::Optimal
                } else {
                    Outcome::Infeasible
                };
                return self.answer(problem, &scan, outcome, iteration);
            }
        }
        let scan = problem.scan(&self.set.settle(Refinement::Once));
        self.answer(
            problem,
            &scan,
            Outcome::IterationLimit,
            self.limits.max_iterations,
        )
    }
}
