//! The answer of the Gauss projection, and who gave it.
//!
//! | symbol   | name in code     | unit   | meaning                                                       |
//! |----------|------------------|--------|---------------------------------------------------------------|
//! | a_c      | `acceleration`   | m, rad | constrained acceleration                                      |
//! | lambda_k | `multiplier`     |        | `J^T lambda = M (a_c - a_u)`, lambda >= 0                      |
//!
//! Source: Ortega et al. 2007, Section 4.2.

use crate::spatial::Vector6;
use arrayvec::ArrayVec;

/// Six unknowns: an optimum needs no more than six rows (Caratheodory), however many there are.
pub(crate) const MAX_ACTIVE: usize = 6;

/// Which algorithm solves the projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolverKind {
    /// Dual active set (Goldfarb and Idnani) in six unknowns: exact, warm-started, without allocation. The default.
    ActiveSet,
    /// Interior point with tight tolerances: the accuracy reference. Allocates.
    Clarabel,
}

/// How the projection ended. The acceleration is finite and usable whatever it says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProjectionStatus {
    /// The answer is certified: its KKT residual is at most `KKT_TOLERANCE`.
    Solved,
    /// No acceleration satisfies every row. The answer is the projection with the bounds `min(b, 0)`, which zero satisfies.
    Infeasible,
    /// No certified answer within the limits. The answer is the best one found; `kkt_residual` says how good it is.
    /// More rows than the projector was made for end here too, with zero for an answer and an infinite residual.
    IterationLimit,
    /// An input was not a finite number. The answer is zero: the motion stops.
    NotFinite,
}

/// A row that holds the body back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActiveRow {
    /// Index into the rows of the call.
    pub row: u32,
    /// Its Lagrange multiplier, > 0, for the row as it was given (not normalised).
    pub multiplier: f64,
}

/// The answer of one projection.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Projection {
    /// The constrained acceleration `a_c`. Exactly `a_u`, bit for bit, where `a_u` violates no row.
    pub acceleration: Vector6,
    /// How it ended.
    pub status: ProjectionStatus,
    /// Largest KKT residual of the answer, relative to the problem's scale; see `kkt_residual`.
    /// Infinite where no answer was computed (an input that is not finite, too many rows).
    pub kkt_residual: f64,
    /// The rows that carry the constraint force, at most six; their multipliers reproduce `M (a_c - a_u)`.
    pub active: ArrayVec<ActiveRow, MAX_ACTIVE>,
    /// Iterations spent, all attempts together.
    pub iterations: u32,
    /// The solver that gave this answer. Not the one asked for where the fallback had to help.
    pub producer: SolverKind,
    /// Attempts after the first: 0 for an answer certified at once.
    pub restarts: u32,
}

impl Projection {
    /// The answer where there is none: no motion.
    pub(crate) fn stopped(status: ProjectionStatus, producer: SolverKind) -> Projection {
        Projection {
            acceleration: Vector6::zeros(),
            status,
            kkt_residual: f64::INFINITY,
            active: ArrayVec::new(),
            iterations: 0,
            producer,
            restarts: 0,
        }
    }
}
