//! What one coupling step answers.

use crate::quasi_statics::ProjectionStatus;
use crate::spatial::Vector6;
use crate::surface::ShadedAcceleration;

/// The answer of one coupling step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CouplingOutput {
    /// Force and torque on the hand at the reference point, N and N m, world axes; within the limits.
    pub wrench: Vector6,
    /// First pass of force shading, for the god-object loop; `None` when no contact is shaded.
    pub shaded: Option<ShadedAcceleration>,
    /// Rows in the active set.
    pub active: usize,
    /// Relative KKT residual of the force's projection.
    pub kkt: f64,
    /// How the projection ended. Anything but `Solved` comes with a zero wrench, but for `Infeasible` between obstacles that
    /// move: there it is the force as if they stood.
    pub status: ProjectionStatus,
    /// The norm clamp of force or torque was at work.
    pub saturated: bool,
}

impl CouplingOutput {
    /// No force: the projection ended with `status`.
    pub(super) fn without_force(status: ProjectionStatus) -> Self {
        Self {
            wrench: Vector6::zeros(),
            shaded: None,
            active: 0,
            kkt: f64::INFINITY,
            status,
            saturated: false,
        }
    }
}
