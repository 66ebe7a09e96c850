//! Gauss' projection: picks the solver, certifies its answer, falls back.
//!
//! | symbol | name in code    | unit   | meaning                                                                   |
//! |--------|-----------------|--------|---------------------------------------------------------------------------|
//! | a_u    | `unconstrained` | m, rad | unconstrained acceleration                                                |
//! | a_c    | `acceleration`  | m, rad | `argmin 1/2 (a - a_u)^T M (a - a_u)` subject to `J a >= b`                 |
//! | M      | `metric`        |        | mass matrix                                                               |
//!
//! Source: Ortega et al. 2007, Section 4.2, Eq. (1), which has b = 0. Beyond the paper: bounds, the certificate, the fallback.

use super::active_set::{self, ActiveSet, PivotRule};
use super::certificate::Certificate;
use super::clarabel::Clarabel;
use super::half_space::HalfSpace;
use super::least_distance::{Bounds, LeastDistance};
use super::metric::Metric;
use super::projection::{ActiveRow, Projection, ProjectionStatus, SolverKind};
use super::rows::{Prepared, Rows};
use super::solve::{Answer, Outcome, Solve, SolverLimits};
use crate::spatial::Vector6;

/// Largest relative KKT residual of a certified answer. Usual answers have 1e-15; a row that depends on others up to
/// rounding may leave 1e-10. For a motion of 10 mm this is 10 pm, far below the rest distance.
pub const KKT_TOLERANCE: f64 = 1e-9;

/// Projects accelerations on sets of half-spaces. Holds all the memory it needs.
#[derive(Clone, Debug)]
pub struct Projector {
    kind: SolverKind,
    reference_fallback: bool,
    problem: LeastDistance,
    active_set: ActiveSet,
    clarabel: Clarabel,
}

impl Projector {
    /// A projector for at most `max_rows` rows by the solver `kind`, without reference fallback.
    pub fn new(kind: SolverKind, max_rows: usize) -> Projector {
        Projector {
            kind,
            reference_fallback: false,
            problem: LeastDistance::with_capacity(max_rows),
            active_set: ActiveSet::new(),
            clarabel: Clarabel::default(),
        }
    }

    /// Whether Clarabel, which allocates, may help where the active set's answer is not certified.
    #[must_use]
    pub fn with_reference_fallback(mut self, allowed: bool) -> Projector {
        self.reference_fallback = allowed;
        self
    }

    /// Lets the solver stop earlier than where it is as accurate as doubles allow; the status still says whether the answer is certified. The
    /// reference fallback keeps its own limits.
    #[must_use]
    pub fn with_limits(mut self, limits: SolverLimits) -> Projector {
        self.active_set.limits = limits;
        self.clarabel.limits = Some(limits);
        self
    }

    /// Lets the active set take at most so many steps, and never more than its own limit: bounds the time of a projection whatever its rows are. A projection that needs more says [`ProjectionStatus::IterationLimit`].
    pub fn limit_iterations(&mut self, most: u32) {
        self.active_set.limits.max_iterations = most.min(active_set::MAX_ITERATIONS);
    }

    /// The acceleration nearest to `unconstrained` in `metric` that satisfies every row.
    ///
    /// `warm_start` holds row indices, best those that carried the last answer; wrong ones cost time and nothing else.
    /// The solver `ActiveSet` without reference fallback allocates nothing and takes a bounded number of steps. The answer's status says whether it is certified.
    pub fn project(
        &mut self,
        metric: &Metric,
        unconstrained: &Vector6,
        rows: &[HalfSpace],
        warm_start: &[u32],
    ) -> Projection {
        self.prepare(metric, rows);
        self.project_prepared(unconstrained, warm_start)
    }

    /// Takes a metric and rows in, for any number of calls of [`Projector::project_prepared`]. No allocation.
    ///
    /// Rows that cannot be used, too many or not finite, are told by the status of those calls.
    pub fn prepare(&mut self, metric: &Metric, rows: &[HalfSpace]) {
        self.problem.prepare(metric, rows);
    }

    /// Takes over the metric and the rows that another projector has prepared, and what it found out about the rows of its last answer: a
    /// warm start from those is free. No allocation where there is room for the rows.
    pub(crate) fn copy_from(&mut self, source: &Projector) {
        self.problem.copy_from(&source.problem);
        self.active_set.copy_from(&source.active_set);
    }

    /// The prepared rows.
    pub(crate) fn rows(&self) -> &Rows {
        &self.problem.rows
    }

    /// Replaces the bound of one prepared row, in the unit that the row was given in. A row out of range is ignored.
    pub fn set_bound(&mut self, row: usize, bound: f64) {
        self.problem.set_bound(row, bound);
    }

    /// [`Projector::project`] on the metric and the rows of the last [`Projector::prepare`].
    pub fn project_prepared(&mut self, unconstrained: &Vector6, warm_start: &[u32]) -> Projection {
        let usable = match self.problem.prepared() {
            Prepared::TooManyRows => Err(ProjectionStatus::IterationLimit),
            Prepared::NotFinite => Err(ProjectionStatus::NotFinite),
            Prepared::Ready if !unconstrained.iter().all(|x| x.is_finite()) => {
                Err(ProjectionStatus::NotFinite)
            }
            Prepared::Ready => Ok(()),
        };
        if let Err(status) = usable {
            return Projection::stopped(status, self.kind);
        }
        self.problem.aim(unconstrained, Bounds::AsGiven);
        let projection = if self.problem.rows.has_impossible_row() {
            self.project_clipped(unconstrained, warm_start, 0)
        } else {
            let first = self.attempts(warm_start);
            if first.status == ProjectionStatus::Infeasible {
                self.project_clipped(unconstrained, warm_start, first.iterations)
            } else {
                first
            }
        };
        // Numbers near the end of their range may overflow inside: no motion rather than a broken one.
        if projection.acceleration.iter().all(|x| x.is_finite()) {
            projection
        } else {
            Projection::stopped(ProjectionStatus::NotFinite, projection.producer)
        }
    }

    /// The safe best answer to contradicting rows: with the bounds `min(b, 0)`, to stay is allowed.
    #[cold]
    fn project_clipped(
        &mut self,
        unconstrained: &Vector6,
        warm_start: &[u32],
        iterations_before: u32,
    ) -> Projection {
        self.problem.aim(unconstrained, Bounds::Clipped);
        let mut projection = self.attempts(warm_start);
        projection.status = ProjectionStatus::Infeasible;
        projection.iterations += iterations_before;
        projection
    }

    /// Solves the problem, again by other means while the answer is not certified; the best answer of all.
    #[inline]
    fn attempts(&mut self, warm_start: &[u32]) -> Projection {
        let problem = &self.problem;
        match self.kind {
            SolverKind::Clarabel => attempt(&mut self.clarabel, problem, warm_start),
            SolverKind::ActiveSet => {
                let solver = self.active_set.with_pivot_rule(PivotRule::MostViolated);
                let best = attempt(solver, problem, warm_start);
                if best.status == ProjectionStatus::IterationLimit {
                    self.other_attempts(best)
                } else {
                    best
                }
            }
        }
    }

    /// Another order of rows, then the reference.
    #[cold]
    fn other_attempts(&mut self, first: Projection) -> Projection {
        let problem = &self.problem;
        let solver = self.active_set.with_pivot_rule(PivotRule::FirstViolated);
        let mut best = better(first, attempt(solver, problem, &[]));
        if best.status == ProjectionStatus::IterationLimit && self.reference_fallback {
            best = better(best, attempt(&mut Clarabel::default(), problem, &[]));
        }
        best
    }
}

/// One solver's answer, in accelerations, with the residual it really has.
///
/// An answer that is not certified and pushes harder than the wish, though to stay is allowed, cannot be right; then the body stays.
#[inline]
fn attempt(solver: &mut impl Solve, problem: &LeastDistance, warm_start: &[u32]) -> Projection {
    let Answer {
        certificate,
        active,
        outcome,
        iterations,
    } = solver.solve(problem, warm_start);

    // Where to stay is allowed there is an answer: who says otherwise is wrong.
    let infeasible = outcome == Outcome::Infeasible && problem.has_positive_bound();
    let certified = certificate.residual() <= KKT_TOLERANCE; // false for NaN
    let mut projection = Projection {
        acceleration: *certificate.acceleration(),
        status: if infeasible {
            ProjectionStatus::Infeasible
        } else if certified {
            ProjectionStatus::Solved
        } else {
            ProjectionStatus::IterationLimit
        },
        kkt_residual: certificate.residual(),
        active: active
            .iter()
            .map(|(row, multiplier)| ActiveRow {
                row: *row,
                multiplier: multiplier / problem.length(*row as usize),
            })
            .collect(),
        iterations,
        producer: solver.kind(),
        restarts: 0,
    };
    if !certified && !problem.has_positive_bound() {
        stay_if_unbounded(problem, &mut projection);
    }
    projection
}

/// Replaces an answer that pushes harder than the wish by no motion.
#[cold]
fn stay_if_unbounded(problem: &LeastDistance, projection: &mut Projection) {
    let push = problem
        .metric()
        .norm(&(projection.acceleration - problem.unconstrained()));
    let bounded = push <= problem.scale() * (1.0 + KKT_TOLERANCE); // false for NaN
    if !bounded {
        let stay = -problem.metric().whiten(problem.unconstrained());
        let certificate = Certificate::new(problem, &problem.scan(&stay), &[]);
        projection.acceleration = Vector6::zeros();
        projection.active.clear();
        projection.kkt_residual = certificate.residual();
    }
}

/// The answer with a verdict, or with the smaller residual; the effort of both.
fn better(first: Projection, second: Projection) -> Projection {
    let iterations = first.iterations + second.iterations;
    let restarts = first.restarts + 1;
    let improved = second.status != ProjectionStatus::IterationLimit
        || second.kkt_residual < first.kkt_residual; // false for NaN
    let best = if improved { second } else { first };
    Projection {
        iterations,
        restarts,
        ..best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quasi_statics::certificate::ActiveRows;
    use nalgebra::Matrix3;

    /// A solver that claims an optimum which is none.
    struct Liar {
        correction: Vector6,
    }

    impl Solve for Liar {
        fn kind(&self) -> SolverKind {
            SolverKind::ActiveSet
        }

        fn solve(&mut self, problem: &LeastDistance, _warm_start: &[u32]) -> Answer {
            Answer {
                certificate: Certificate::new(problem, &problem.scan(&self.correction), &[]),
                active: ActiveRows::new(),
                outcome: Outcome::Optimal,
                iterations: 1,
            }
        }
    }

    const PUSH: Vector6 = Vector6::new(0.3, 0.0, -1.0, 0.0, 0.0, 0.0);

    fn with_floor(check: impl Fn(&LeastDistance)) {
        let metric = Metric::new(1.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let rows = [HalfSpace {
            jacobian: Vector6::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
            bound: 0.0,
        }];
        check(&LeastDistance::of(&metric, &PUSH, &rows));
    }

    #[test]
    fn a_wrong_answer_is_never_called_solved() {
        with_floor(|problem| {
            let small = Vector6::new(0.0, 0.0, 0.5, 0.0, 0.0, 0.0);
            for correction in [Vector6::zeros(), small, Vector6::repeat(f64::NAN)] {
                let answer = attempt(&mut Liar { correction }, problem, &[]);
                assert_eq!(answer.status, ProjectionStatus::IterationLimit);
                assert!(answer.kkt_residual > 0.1);
            }
        });
    }

    #[test]
    fn a_wrong_answer_that_pushes_too_hard_becomes_no_motion() {
        with_floor(|problem| {
            for size in [1e3, 1e200, f64::NAN, f64::INFINITY] {
                let correction = Vector6::repeat(size);
                let answer = attempt(&mut Liar { correction }, problem, &[]);
                assert_eq!(answer.status, ProjectionStatus::IterationLimit);
                assert_eq!(answer.acceleration, Vector6::zeros());
            }
        });
    }

    #[test]
    fn the_reference_replaces_a_wrong_answer_and_says_so() {
        with_floor(|problem| {
            let correction = Vector6::zeros();
            let wrong = attempt(&mut Liar { correction }, problem, &[]);
            let right = attempt(&mut Clarabel::default(), problem, &[]);
            for (first, second) in [(wrong.clone(), right.clone()), (right, wrong)] {
                let best = better(first, second);
                assert_eq!(best.status, ProjectionStatus::Solved);
                assert_eq!(best.producer, SolverKind::Clarabel);
                assert_eq!(best.restarts, 1);
                assert!(
                    (best.acceleration - Vector6::new(0.3, 0.0, 0.0, 0.0, 0.0, 0.0)).norm() < 1e-12
                );
            }
        });
    }
}
