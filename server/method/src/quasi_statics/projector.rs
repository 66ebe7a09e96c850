//! Gauss' projection: picks the solver, certifies its answer, falls back.
//!
//! | symbol | name in code    | unit   | meaning                                                                   |
//! |--------|-----------------|--------|---------------------------------------------------------------------------|
//! | a_u    | `unconstrained` | m, rad | unconstrained acceleration                                                |
//! | a_c    | `acceleration`  | m, rad | `argmin 1/2 (a - a_u)^T M (a - a_u)` subject to `J a >= b`                 |
//! | M      | `metric`        |        | mass matrix                                                               |
//!
//! Source: Ortega et al. 2007, Section 4.2, Eq. (1), which has b = 0. Beyond the paper: bounds, the certificate, the fallback.

use super::active_set::{ActiveSet, PivotRule};
use super::clarabel::Clarabel;
use super::gauss_seidel::GaussSeidel;
use super::half_space::HalfSpace;
use super::kkt::residual_with_bounds;
use super::least_distance::{Bounds, LeastDistance, Loaded};
use super::metric::Metric;
use super::projection::{ActiveRow, MAX_ACTIVE, Projection, ProjectionStatus, SolverKind};
use super::solve::{Answer, Outcome, Solve};
use crate::spatial::Vector6;
use arrayvec::ArrayVec;

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
    gauss_seidel: GaussSeidel,
}

/// One call's input.
#[derive(Clone, Copy)]
struct Given<'a> {
    metric: &'a Metric,
    unconstrained: &'a Vector6,
    rows: &'a [HalfSpace],
    bounds: Bounds,
}

impl Projector {
    /// A projector for at most `max_rows` rows by the solver `kind`, without reference fallback.
    pub fn new(kind: SolverKind, max_rows: usize) -> Projector {
        let relaxed_rows = match kind {
            SolverKind::ProjectedGaussSeidel => max_rows,
            SolverKind::ActiveSet | SolverKind::Clarabel => 0,
        };
        Projector {
            kind,
            reference_fallback: false,
            problem: LeastDistance::with_capacity(max_rows),
            active_set: ActiveSet::new(),
            gauss_seidel: GaussSeidel::with_capacity(relaxed_rows),
        }
    }

    /// Whether Clarabel, which allocates, may help where the active set's answer is not certified.
    #[must_use]
    pub fn with_reference_fallback(mut self, allowed: bool) -> Projector {
        self.reference_fallback = allowed;
        self
    }

    /// The acceleration nearest to `unconstrained` in `metric` that satisfies every row.
    ///
    /// `warm_start` holds row indices, best those that carried the last answer; wrong ones cost time and nothing else.
    /// The solver `ActiveSet` without reference fallback allocates nothing, and neither does `ProjectedGaussSeidel`; both take
    /// a bounded number of steps. The answer's status says whether it is certified.
    pub fn project(
        &mut self,
        metric: &Metric,
        unconstrained: &Vector6,
        rows: &[HalfSpace],
        warm_start: &[u32],
    ) -> Projection {
        let given = Given {
            metric,
            unconstrained,
            rows,
            bounds: Bounds::AsGiven,
        };
        let loaded = self.problem.load(metric, unconstrained, rows, given.bounds);
        let projection = match loaded {
            Loaded::NotFinite => Projection::stopped(ProjectionStatus::NotFinite, self.kind),
            Loaded::TooManyRows => Projection::stopped(ProjectionStatus::IterationLimit, self.kind),
            Loaded::Infeasible => self.project_clipped(&given, warm_start),
            Loaded::Ready => {
                let first = self.attempts(&given, warm_start);
                if first.status == ProjectionStatus::Infeasible {
                    let iterations = first.iterations;
                    let mut clipped = self.project_clipped(&given, warm_start);
                    clipped.iterations += iterations;
                    clipped
                } else {
                    first
                }
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
    fn project_clipped(&mut self, given: &Given, warm_start: &[u32]) -> Projection {
        let clipped = Given {
            bounds: Bounds::Clipped,
            ..*given
        };
        let loaded = self.problem.load(
            clipped.metric,
            clipped.unconstrained,
            clipped.rows,
            clipped.bounds,
        );
        debug_assert_eq!(loaded, Loaded::Ready);
        let mut projection = self.attempts(&clipped, warm_start);
        projection.status = ProjectionStatus::Infeasible;
        projection
    }

    /// Solves the loaded problem, again by other means while the answer is not certified; the best answer of all.
    fn attempts(&mut self, given: &Given, warm_start: &[u32]) -> Projection {
        let problem = &self.problem;
        match self.kind {
            SolverKind::Clarabel => attempt(&mut Clarabel, problem, given, warm_start),
            SolverKind::ProjectedGaussSeidel => {
                attempt(&mut self.gauss_seidel, problem, given, warm_start)
            }
            SolverKind::ActiveSet => {
                let solver = self.active_set.with_pivot_rule(PivotRule::MostViolated);
                let mut best = attempt(solver, problem, given, warm_start);
                if best.status == ProjectionStatus::IterationLimit {
                    let solver = self.active_set.with_pivot_rule(PivotRule::FirstViolated);
                    best = better(best, attempt(solver, problem, given, &[]));
                }
                if best.status == ProjectionStatus::IterationLimit && self.reference_fallback {
                    best = better(best, attempt(&mut Clarabel, problem, given, &[]));
                }
                best
            }
        }
    }
}

/// One solver's answer, in accelerations, with the residual it really has.
///
/// An answer that is not certified and pushes harder than the wish, though to stay is allowed, cannot be right; then the body stays.
fn attempt(
    solver: &mut impl Solve,
    problem: &LeastDistance,
    given: &Given,
    warm_start: &[u32],
) -> Projection {
    let Answer {
        correction,
        active,
        outcome,
        iterations,
    } = solver.solve(problem, warm_start);

    let mut acceleration = if active.is_empty() && correction == Vector6::zeros() {
        *given.unconstrained // bit for bit: no force in free space
    } else {
        given.unconstrained + given.metric.unwhiten(&correction)
    };
    let mut active = active
        .iter()
        .map(|(row, multiplier)| ActiveRow {
            row: *row,
            multiplier: multiplier / problem.length(*row as usize),
        })
        .collect::<ArrayVec<_, MAX_ACTIVE>>();
    let residual = |acceleration: &Vector6, active: &[ActiveRow]| {
        let bound_of = |b| given.bounds.apply(b);
        let (metric, a_u) = (given.metric, given.unconstrained);
        residual_with_bounds(metric, a_u, given.rows, bound_of, acceleration, active).largest()
    };
    let mut kkt_residual = residual(&acceleration, &active);

    // Where to stay is allowed there is an answer: who says otherwise is wrong.
    let infeasible = outcome == Outcome::Infeasible && problem.has_positive_bound();
    let certified = kkt_residual <= KKT_TOLERANCE; // false for NaN
    let push = given.metric.norm(&(acceleration - given.unconstrained));
    let bounded = push <= problem.scale() * (1.0 + KKT_TOLERANCE); // false for NaN
    if !certified && !bounded && !problem.has_positive_bound() {
        acceleration = Vector6::zeros();
        active.clear();
        kkt_residual = residual(&acceleration, &active);
    }
    let status = if infeasible {
        ProjectionStatus::Infeasible
    } else if certified {
        ProjectionStatus::Solved
    } else {
        ProjectionStatus::IterationLimit
    };
    Projection {
        acceleration,
        status,
        kkt_residual,
        active,
        iterations,
        producer: solver.kind(),
        restarts: 0,
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
    use nalgebra::Matrix3;

    /// A solver that claims an optimum which is none.
    struct Liar {
        correction: Vector6,
    }

    impl Solve for Liar {
        fn kind(&self) -> SolverKind {
            SolverKind::ActiveSet
        }

        fn solve(&mut self, _problem: &LeastDistance, _warm_start: &[u32]) -> Answer {
            Answer {
                correction: self.correction,
                active: ArrayVec::new(),
                outcome: Outcome::Optimal,
                iterations: 1,
            }
        }
    }

    const PUSH: Vector6 = Vector6::new(0.3, 0.0, -1.0, 0.0, 0.0, 0.0);

    fn with_loaded_floor(check: impl Fn(&LeastDistance, &Given)) {
        let metric = Metric::new(1.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let rows = [HalfSpace {
            jacobian: Vector6::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
            bound: 0.0,
        }];
        let mut problem = LeastDistance::with_capacity(1);
        let loaded = problem.load(&metric, &PUSH, &rows, Bounds::AsGiven);
        assert_eq!(loaded, Loaded::Ready);
        let given = Given {
            metric: &metric,
            unconstrained: &PUSH,
            rows: &rows,
            bounds: Bounds::AsGiven,
        };
        check(&problem, &given);
    }

    #[test]
    fn a_wrong_answer_is_never_called_solved() {
        with_loaded_floor(|problem, given| {
            let small = Vector6::new(0.0, 0.0, 0.5, 0.0, 0.0, 0.0);
            for correction in [Vector6::zeros(), small, Vector6::repeat(f64::NAN)] {
                let answer = attempt(&mut Liar { correction }, problem, given, &[]);
                assert_eq!(answer.status, ProjectionStatus::IterationLimit);
                assert!(answer.kkt_residual > 0.1);
            }
        });
    }

    #[test]
    fn a_wrong_answer_that_pushes_too_hard_becomes_no_motion() {
        with_loaded_floor(|problem, given| {
            for size in [1e3, 1e200, f64::NAN, f64::INFINITY] {
                let correction = Vector6::repeat(size);
                let answer = attempt(&mut Liar { correction }, problem, given, &[]);
                assert_eq!(answer.status, ProjectionStatus::IterationLimit);
                assert_eq!(answer.acceleration, Vector6::zeros());
            }
        });
    }

    #[test]
    fn the_reference_replaces_a_wrong_answer_and_says_so() {
        with_loaded_floor(|problem, given| {
            let correction = Vector6::zeros();
            let wrong = attempt(&mut Liar { correction }, problem, given, &[]);
            let right = attempt(&mut Clarabel, problem, given, &[]);
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
