//! What every solver of the projection can do.

use super::least_distance::LeastDistance;
use super::projection::{MAX_ACTIVE, SolverKind};
use crate::spatial::Vector6;
use arrayvec::ArrayVec;

/// How a solver ended, by its own account; the projector checks it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Optimal,
    Infeasible,
    IterationLimit,
}

/// A solver's answer in the coordinates of the least-distance problem.
#[derive(Clone, Debug)]
pub(crate) struct Answer {
    /// `y = L^T (a - a_u)`.
    pub(crate) correction: Vector6,
    /// Rows with their multipliers, for unit rows; `y = sum lambda_k n_k`.
    pub(crate) active: ArrayVec<(u32, f64), MAX_ACTIVE>,
    pub(crate) outcome: Outcome,
    pub(crate) iterations: u32,
}

/// A solver of `min |y|^2 / 2` subject to `n_k . y >= h_k`.
pub(crate) trait Solve {
    /// Which one it is.
    fn kind(&self) -> SolverKind;

    /// Solves `problem`; `warm_start` names rows that carried the last answer, any of them possibly wrong or out of range.
    fn solve(&mut self, problem: &LeastDistance, warm_start: &[u32]) -> Answer;
}
