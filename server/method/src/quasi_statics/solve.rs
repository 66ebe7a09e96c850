//! What every solver of the projection can do.

use super::certificate::{ActiveRows, Certificate};
use super::least_distance::LeastDistance;
use super::projection::SolverKind;

/// How a solver ended, by its own account; the projector checks it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Optimal,
    Infeasible,
    IterationLimit,
}

/// Where a solver stops, for those that chart one against the other. Without it each has its own, which is as accurate as doubles allow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverLimits {
    /// What is still violated, changes or gapes when a solver may stop, relative to the problem's scale: a row's violation of the active set,
    /// the duality gap and feasibility of Clarabel.
    pub tolerance: f64,
    /// Most rows taken in, or interior-point steps.
    pub max_iterations: u32,
}

/// A solver's answer in the coordinates of the least-distance problem.
#[derive(Clone, Debug)]
pub(crate) struct Answer {
    /// Where the solver arrived, `y = L^T (a - a_u)`, and how optimal that is with `active`.
    pub(crate) certificate: Certificate,
    /// Rows with their multipliers, for unit rows; `y = sum lambda_k n_k`.
    pub(crate) active: ActiveRows,
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
