//! The constrained acceleration for one device sample: rows as they were collected, friction, and rounds of implicit constraints.

use nalgebra::Point3;

use super::Coupling;
use crate::constraint::ConstraintSet;
use crate::implicit::LinearAnswer;
use crate::quasi_statics::{HalfSpace, KKT_TOLERANCE, Metric, Projection, ProjectionStatus};
use crate::spatial::{Pose, Vector6, advance_pose, angular, pose_difference};
use crate::surface::FrictionProblem;

/// What holds the body, and where.
#[derive(Clone, Debug)]
pub(super) struct Answer {
    /// Acceleration from x_s.
    pub(super) projection: Projection,
    /// `M (a_c - a_u)` with what damping adds.
    pub(super) held: Vector6,
    /// Pose of the reference point that the rounds arrived at.
    pub(super) reached: Option<Pose>,
}

impl Coupling {
    /// The answer for a device that asks for `unconstrained`; the status where nothing certified is found.
    pub(super) fn constrained(
        &mut self,
        metric: &Metric,
        unconstrained: &Vector6,
        set: &ConstraintSet,
    ) -> Result<Answer, ProjectionStatus> {
        let projection = self
            .projector
            .project_prepared(unconstrained, &self.warm_start);
        self.warm_start.clear();
        let projection = self.grip(metric, unconstrained, set, projection);
        // Where obstacles close in on each other from both sides, nothing is pushed but nothing gives way.
        let squeezed = self.present.moving
            && projection.status == ProjectionStatus::Infeasible
            && projection.kkt_residual <= KKT_TOLERANCE;
        if projection.status != ProjectionStatus::Solved && !squeezed {
            return Err(projection.status);
        }
        self.warm_start
            .extend(projection.active.iter().map(|row| row.row));
        // F_c = k_h M (a_c - a_u)
        let held = metric.mass_matrix_times(&(projection.acceleration - unconstrained));
        let damped = self.damped(metric, unconstrained, set, &projection);
        let mut answer = self.relinearised(
            unconstrained,
            set,
            Answer {
                projection,
                held,
                reached: None,
            },
        );
        if let Some(friction) = &self.friction {
            let rows = friction.holding();
            let holding = rows.filter_map(|row| set.constraints.get(row as usize));
            self.anchor.follow(
                &self.present.god_object,
                &answer.projection.acceleration,
                self.settings.k_s,
                friction.slid(),
                holding.map(|row| (row.features, row.obstacle_displacement)),
            );
        }
        if let Some(damped) = damped {
            answer.held += damped;
        }
        Ok(answer)
    }

    /// The frictionless answer on the rows of the set with friction, where an obstacle has some.
    fn grip(
        &mut self,
        metric: &Metric,
        unconstrained: &Vector6,
        set: &ConstraintSet,
        frictionless: Projection,
    ) -> Projection {
        let Some(friction) = &mut self.friction else {
            return frictionless;
        };
        let god_object = &self.present.god_object;
        let k_s = self.settings.k_s;
        let problem = FrictionProblem {
            metric,
            unconstrained,
            stuck_at: &self.anchor.acceleration(god_object, unconstrained, k_s),
            carried: self.anchor.carried(k_s),
            reference_point: &Point3::from(god_object.translation.vector),
            constraints: &set.constraints,
            moved: None,
        };
        friction.hold(&problem, &mut self.projector, frictionless)
    }

    fn damped(
        &mut self,
        metric: &Metric,
        unconstrained: &Vector6,
        set: &ConstraintSet,
        projection: &Projection,
    ) -> Option<Vector6> {
        let damping = self.damping.as_mut()?;
        let center = Point3::from(self.present.god_object.translation.vector);
        let in_force = |row: usize| HalfSpace {
            bound: self.bounds[row],
            ..self.basis.half_space(&set.constraints[row], &center)
        };
        let k_s = self.settings.k_s;
        Some(damping.held(metric, unconstrained, k_s, projection, in_force))
    }

    /// The answer with its rows, and friction on them, linearised anew where it leads to, as often as the settings allow. Rounds that do not converge
    /// give way to the linear rows, without a step between.
    fn relinearised(
        &mut self,
        unconstrained: &Vector6,
        set: &ConstraintSet,
        linear: Answer,
    ) -> Answer {
        if self.settings.implicit_rounds == 0 {
            return linear;
        }
        let (god_object, k_s) = (self.present.god_object, self.settings.k_s);
        // Past the half turn the device pulls as if it were elsewhere.
        let difference = unconstrained / k_s;
        let goal = advance_pose(&god_object, &difference, 1.0);
        let given = LinearAnswer {
            constraints: &set.constraints[..self.bounds.len()],
            start: &god_object,
            goal: &goal,
            branch: angular(&difference),
            scale: k_s,
            shaded: self.present.shaded,
            projection: &linear.projection,
        };
        let (anchor, friction) = (&self.anchor, &mut self.friction);
        let rounds = self.implicit.solve(
            &given,
            |row| self.bounds[row],
            |pose| self.basis.metric(pose),
            |round, projector, frictionless| match friction {
                Some(friction) => {
                    let stuck_at = anchor.acceleration(round.candidate, round.unconstrained, k_s);
                    let problem = given.rough(round, &stuck_at, anchor.carried(k_s));
                    friction.hold(&problem, projector, frictionless)
                }
                None => frictionless,
            },
        );
        let Some(rounds) = rounds else { return linear };
        let trust = rounds.trust();
        if trust <= 0.0 {
            return linear;
        }
        let change = rounds.projection.acceleration - rounds.unconstrained;
        let force = rounds.metric.mass_matrix_times(&change);
        // What follows counts from x_s.
        let straight = linear.projection.acceleration;
        let moved = pose_difference(&rounds.reached, &god_object, &(angular(&straight) / k_s));
        let mut projection = rounds.projection;
        projection.acceleration = straight + (moved * k_s - straight) * trust;
        Answer {
            projection,
            held: linear.held + (force - linear.held) * trust,
            reached: Some(rounds.reached),
        }
    }
}
