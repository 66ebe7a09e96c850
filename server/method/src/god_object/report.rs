//! What one update did: counts, residuals and flags for the caller and its charts.

use super::GodObject;
use crate::collision::Work;

/// What one update did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Rows in the constraint set.
    pub contacts: usize,
    /// Rows in the last active set.
    pub active: usize,
    /// Smallest distance between the bodies, m; infinite when none is near.
    pub gap_min: f64,
    /// Worst relative KKT residual of the update's projections.
    pub kkt: f64,
    /// Projections that the chosen solver did not certify.
    pub solver_fallbacks: u32,
    /// Projections that had no answer; the body stayed where it was.
    pub solver_failures: u32,
    /// Repetitions of project, move, collect.
    pub substeps: u32,
    /// Obstacles that did not get to their targets: the body is squeezed, or the budget ran out.
    pub obstacles_blocked: u32,
    /// The input was not finite: nothing moved.
    pub rejected: bool,
    /// The budget or the sub-steps ran out before the motion left was below tolerance: safe, only not yet closest.
    pub unfinished: bool,
    /// Work counts.
    pub work: Work,
}

impl GodObject {
    pub(super) fn describe_set(&self, report: &mut StepReport) {
        report.contacts = self.set.constraints.len();
        report.gap_min = self.set.gap_min;
    }
}
