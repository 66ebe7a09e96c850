//! Eq. (1) on the present constraint set: what the body may do of what the device asks.

use nalgebra::Point3;

use super::{GodObject, StepReport};
use crate::constraint::contact_jacobian;
use crate::quasi_statics::{HalfSpace, KKT_TOLERANCE, ProjectionStatus};
use crate::spatial::Vector6;
use crate::surface::FrictionProblem;

impl GodObject {
    /// Eq. (1) on the present constraint set; `None` when there is no certified answer.
    pub(super) fn project(
        &mut self,
        unconstrained: &Vector6,
        report: &mut StepReport,
    ) -> Option<Vector6> {
        let metric = self
            .world
            .body
            .metric(self.settings.rotation_metric, &self.pose)?;
        let center = Point3::from(self.pose_at_reference_point().translation.vector);
        self.rows.clear();
        for constraint in &self.set.constraints {
            self.rows.push(HalfSpace {
                jacobian: contact_jacobian(&constraint.normal, &constraint.point, &center),
                bound: self.settings.motion_bound(constraint.gap),
            });
        }
        report.work.projections += 1;
        let mut projection =
            self.projector
                .project(&metric, unconstrained, &self.rows, &self.warm_start);
        if let Some(friction) = &mut self.friction {
            let problem = FrictionProblem {
                metric: &metric,
                unconstrained,
                stuck_at: &Vector6::zeros(),
                reference_point: &center,
                rows: &self.rows,
                constraints: &self.set.constraints,
            };
            projection = friction.hold(&problem, &mut self.projector, projection);
        }
        report.kkt = report.kkt.max(projection.kkt_residual);
        report.active = projection.active.len();
        report.solver_fallbacks += u32::from(projection.producer != self.settings.solver);
        self.warm_start.clear();
        self.warm_start
            .extend(projection.active.iter().map(|row| row.row));
        match projection.status {
            ProjectionStatus::Solved => Some(projection.acceleration),
            // Two walls nearer to each other than twice the rest distance: the answer without easing out.
            ProjectionStatus::Infeasible if projection.kkt_residual <= KKT_TOLERANCE => {
                self.warm_start.clear();
                Some(projection.acceleration)
            }
            ProjectionStatus::Infeasible
            | ProjectionStatus::IterationLimit
            | ProjectionStatus::NotFinite => {
                self.warm_start.clear();
                report.solver_failures += 1;
                None
            }
        }
    }
}
