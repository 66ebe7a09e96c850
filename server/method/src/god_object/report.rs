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
    /// The last motion was cut short at an obstacle of which the set has no row: what stops the body there gives no force. Of a surface that is closed
    /// and looks outward this is never so.
    pub stopped_without_row: bool,
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
        report.stopped_without_row = self.last_stop.is_some_and(|obstacle| {
            let mut rows = self.set.constraints.iter();
            rows.all(|row| usize::from(row.features.obstacle) != obstacle)
        });
    }
}
