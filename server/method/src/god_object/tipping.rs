//! Whether a little motion is the end of an update or the beginning of a fall.
//!
//! Where the body is pressed onto something convex, a projected motion `a` turns the normal by `a / R`, and the wish's share `w` along the
//! old normal pushes by `w a / R` along the surface. Less deep than the radius R that is less than `a`, and motions come to an end; deeper
//! it is more, and the body tips over, however little the first motion was: a ball that has just passed the edge of a plate.

use arrayvec::ArrayVec;
use nalgebra::Point3;

use super::{GodObject, StepReport};
use crate::constraint::{NonPenetrationConstraint, contact_jacobian};
use crate::quasi_statics::{HalfSpace, MAX_ACTIVE, ProjectionStatus};
use crate::spatial::{Vector6, advance_pose};
use crate::surface::{Carried, FrictionProblem};

impl GodObject {
    /// Whether the projected motion `first` of the wish `left` would be followed by one that is no shorter, by the rows that held the body,
    /// as they are where it leads to, and friction there: longer by more than friction may be off in either. One projection on at most six rows, and no
    /// search.
    pub(super) fn tips_over(
        &mut self,
        first: &Vector6,
        left: &Vector6,
        report: &mut StepReport,
    ) -> bool {
        let (_, first_error) = self.motion_with_friction(first);
        let start = self.pose_at_reference_point();
        let reached = advance_pose(&start, first, 1.0);
        let Some(metric) = self
            .world
            .body
            .metric(self.settings.rotation_metric, &self.pose)
        else {
            return false;
        };
        let center = Point3::from(reached.translation.vector);
        let active = self.warm_start.iter();
        let held: ArrayVec<NonPenetrationConstraint, MAX_ACTIVE> = active
            .filter_map(|row| self.set.constraints.get(*row as usize).copied())
            .collect();
        self.rows.clear();
        self.rows.extend(held.iter().map(|constraint| {
            let moved = constraint.moved(&start, &reached, false);
            HalfSpace {
                jacobian: contact_jacobian(&moved.normal, &moved.point, &center),
                bound: self.settings.motion_bound(moved.gap),
            }
        }));
        if self.rows.is_empty() {
            return false;
        }
        report.work.projections += 1;
        let wish = left - first;
        let mut second = self.projector.project(&metric, &wish, &self.rows, &[]);
        if let Some(friction) = &mut self.friction {
            let problem = FrictionProblem {
                metric: &metric,
                unconstrained: &wish,
                stuck_at: &Vector6::zeros(),
                carried: Carried::NOT,
                reference_point: &center,
                constraints: &held,
                moved: Some((&start, &reached, false)),
            };
            second = friction.hold(&problem, &mut self.projector, second);
        }
        let longer = self.motion_length(&second.acceleration) - self.motion_length(first);
        let (_, second_error) = self.motion_with_friction(&second.acceleration);
        second.status == ProjectionStatus::Solved && longer >= first_error + second_error // false for NaN
    }

    /// How far the last projected motion `a` moves the body where friction lets it, and by how much it may be off with friction, m.
    pub(super) fn motion_with_friction(&self, a: &Vector6) -> (f64, f64) {
        let path = self.motion_length(a);
        let Some(friction) = &self.friction else {
            return (path, 0.0);
        };
        if self.carry.is_left() {
            return (path, 0.0); // what sticks moves
        }
        let body = &self.world.body;
        let metric = body.metric(self.settings.rotation_metric, &self.pose);
        metric.map_or((path, 0.0), |metric| {
            let longest = |norm: f64| metric.longest_path(norm, self.radius);
            let moving = longest(friction.motion_of(a, &metric));
            (path.min(moving), longest(friction.error()))
        })
    }
}
