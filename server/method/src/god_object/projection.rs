//! Eq. (1) on the present constraint set: what the body may do of what the device asks.

use nalgebra::{Point3, Vector3};

use super::placed_obstacle::Ahead;
use super::{GodObject, StepReport};
use crate::constraint::contact_jacobian;
use crate::implicit::{ImplicitAnswer, LinearAnswer};
use crate::quasi_statics::{HalfSpace, KKT_TOLERANCE, Projection, ProjectionStatus};
use crate::spatial::{Vector6, advance_pose, angular, pose_difference};
use crate::surface::{Carried, FrictionProblem};

/// Rounds that each cover less than this share of the one before add up to no less than an eighth of the linear answer in three rounds: where
/// that one moves the body, they do.
const SETTLING_CONTRACTION: f64 = 0.5;

/// A motion that the rows allow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projected {
    /// a_c: displacement of the reference point and rotation vector.
    pub(super) acceleration: Vector6,
    /// The point of the body that goes straight, body frame, m: the reference point, or one where the body is held.
    pub(super) straight: Point3<f64>,
    /// Every row is satisfied; otherwise rows contradict, and nothing is eased out.
    pub(super) feasible: bool,
    /// False where the rounds of implicit constraints did not come nearer to an answer, and the linear one is given.
    pub(super) settled: bool,
}

impl GodObject {
    /// Eq. (1) on the present constraint set, with room made for what is `ahead`; `None` when there is no certified answer.
    pub(super) fn project(
        &mut self,
        unconstrained: &Vector6,
        ahead: Option<&Ahead>,
        report: &mut StepReport,
    ) -> Option<Projected> {
        let metric = self
            .world
            .body
            .metric(self.settings.rotation_metric, &self.pose)?;
        let reference_point = self.world.body.reference_point;
        let center = Point3::from(self.pose_at_reference_point().translation.vector);
        self.rows.clear();
        for constraint in &self.set.constraints {
            self.rows.push(HalfSpace {
                jacobian: contact_jacobian(&constraint.normal, &constraint.point, &center),
                bound: ahead.map_or_else(
                    || self.settings.motion_bound(constraint.gap),
                    |ahead| self.bound_ahead(constraint, ahead),
                ),
            });
        }
        report.work.projections += 1;
        let mut projection =
            self.projector
                .project(&metric, unconstrained, &self.rows, &self.warm_start);
        // While obstacles go, nothing is asked of the body but to make room.
        let (stuck_at, carried) = match ahead {
            None => (self.carry.stuck_at(), self.carry.carried()),
            Some(_) => (Vector6::zeros(), Carried::NOT),
        };
        if let Some(friction) = &mut self.friction {
            let problem = FrictionProblem {
                metric: &metric,
                unconstrained,
                stuck_at: &stuck_at,
                carried,
                reference_point: &center,
                constraints: &self.set.constraints,
                moved: None,
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
            ProjectionStatus::Solved => {
                Some(self.implicit(unconstrained, projection, (stuck_at, carried), report))
            }
            // Two walls nearer to each other than twice the rest distance: the answer without easing out.
            ProjectionStatus::Infeasible if projection.kkt_residual <= KKT_TOLERANCE => {
                self.warm_start.clear();
                Some(Projected {
                    feasible: false,
                    ..Projected::about(projection.acceleration, reference_point)
                })
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

    /// The same with the rows re-linearised where `linear` leads to, where that turns the body.
    fn implicit(
        &mut self,
        unconstrained: &Vector6,
        linear: Projection,
        (stuck_at, carried): (Vector6, Carried<'_>),
        report: &mut StepReport,
    ) -> Projected {
        let reference_point = self.world.body.reference_point;
        let start = self.pose_at_reference_point();
        let goal = advance_pose(&start, unconstrained, 1.0);
        let given = LinearAnswer {
            constraints: &self.set.constraints,
            start: &start,
            goal: &goal,
            branch: angular(unconstrained),
            scale: 1.0,
            shaded: false,
            projection: &linear,
        };
        let friction = &mut self.friction;
        let answer = self.implicit.solve(
            &given,
            |row| self.rows[row].bound,
            |pose| self.world.body.metric(self.settings.rotation_metric, pose),
            |round, projector, frictionless| match friction {
                Some(friction) => {
                    // What stuck did so where the body is.
                    let from_here =
                        pose_difference(&start, round.candidate, &-angular(&linear.acceleration));
                    let stuck_at = from_here + stuck_at;
                    let problem = given.rough(round, &stuck_at, carried);
                    friction.hold(&problem, projector, frictionless)
                }
                None => frictionless,
            },
        );
        let Some(answer) = answer else {
            return Projected::about(linear.acceleration, reference_point);
        };
        report.work.projections += u64::from(answer.rounds);
        report.kkt = report.kkt.max(answer.projection.kkt_residual);
        // Rounds that do not shrink may end anywhere, even where they began: they must not be what holds the body.
        let settled = answer.contraction <= SETTLING_CONTRACTION; // false for NaN
        if !settled {
            return Projected {
                settled,
                ..Projected::about(linear.acceleration, reference_point)
            };
        }
        report.active = answer.projection.active.len();
        let nearest = angular(&linear.acceleration);
        Projected {
            acceleration: pose_difference(&answer.reached, &start, &nearest),
            straight: self.held_point(&answer).unwrap_or(reference_point),
            feasible: true,
            settled: true,
        }
    }

    /// Middle of the contact points that hold the body in an answer, body frame. A motion in which it goes straight turns about
    /// the contacts and does not dip into them.
    fn held_point(&self, answer: &ImplicitAnswer) -> Option<Point3<f64>> {
        let start = self.pose_at_reference_point();
        let active = &answer.projection.active;
        let sum = active
            .iter()
            .filter_map(|row| self.set.constraints.get(row.row as usize))
            .map(|row| {
                let moved = row.moved(&start, &answer.linearised_at, false);
                moved.point.coords + moved.normal * moved.gap
            })
            .sum::<Vector3<f64>>();
        let count = active.len();
        (count > 0).then(|| {
            let in_reference = answer
                .linearised_at
                .inverse_transform_point(&Point3::from(sum / count as f64));
            self.world.body.reference_point + in_reference.coords
        })
    }
}

impl Projected {
    fn about(acceleration: Vector6, straight: Point3<f64>) -> Self {
        Self {
            acceleration,
            straight,
            feasible: true,
            settled: true,
        }
    }
}
