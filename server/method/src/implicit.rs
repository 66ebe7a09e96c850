//! Implicit constraints: rows re-linearised at the candidate pose, and projected again.
//!
//! | symbol | name in code    | unit   | meaning                                                                     |
//! |--------|-----------------|--------|-----------------------------------------------------------------------------|
//! | x_s    | `start`         | m, –   | pose of the reference point where the rows were collected                   |
//! | x_g    | `goal`          | m, –   | where the body would go without rows                                        |
//! | x_k    | `candidate`     | m, –   | where round k - 1 ended; x_1 is the answer of the linear rows               |
//! | s      | `scale`         | –      | share of the motion that an acceleration is: 1 or k_s                       |
//! | g, g'  | `gap`           | m      | true distance of a row's features at x_s and at x_k                         |
//! | b      | `bound`         | m      | bound of the row at x_s                                                     |
//!
//! Round k solves Eq. (1) from x_k: a_u is `s (x_g - x_k)`, M is that of x_k, a row is the gradient of its true distance there and its bound
//! `b + s (g - g')`. Where the rounds converge, the answer is the pose at which the god-object itself would come to rest, and
//! the force is the one that is felt there. It is Gauss-Newton's scheme on poses, so that no derivative of the rotation vector
//! appears: each round starts from zero.
//!
//! A row that holds the body was projected to the distance `g + b / s`: where its true distance there is that, and nothing turned, the linear rows
//! were true, and there are no rounds. So a body that slides on flat faces costs none, and one that slides round a cylinder gets them without turning.
//! Source: beyond Ortega et al. 2007, Section 7.3.2, which names linear constraints as a limitation.

use nalgebra::{Point3, Vector3};

use crate::constraint::{NonPenetrationConstraint, contact_jacobian};
use crate::quasi_statics::{HalfSpace, Metric, Projection, ProjectionStatus, Projector};
use crate::settings::Settings;
use crate::spatial::{Pose, Vector6, advance_pose, angular, linear, pose_difference};
use crate::surface::{Carried, FrictionProblem};

/// Rounds whose lengths shrink by less come to nothing; up to this they do in the cases with a closed form, and from 1 they move away.
const CONVERGING: f64 = 0.85;

/// The rounds after the first projection, and their memory.
#[derive(Clone, Debug)]
pub(crate) struct ImplicitRounds {
    rounds: u32,
    /// Radius of the body about the reference point, m.
    radius: f64,
    /// Bending of a path below which a straight row is true, m.
    tolerance: f64,
    /// Whether rows bend for a body that does not turn, too.
    slides: bool,
    /// Its own: the rows of the first projection stay prepared elsewhere.
    projector: Projector,
    rows: Vec<HalfSpace>,
    warm_start: Vec<u32>,
}

/// What was solved first, and between which poses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinearAnswer<'a> {
    pub(crate) constraints: &'a [NonPenetrationConstraint],
    pub(crate) start: &'a Pose,
    pub(crate) goal: &'a Pose,
    /// The branch of the rotation from `start` to `goal`.
    pub(crate) branch: Vector3<f64>,
    pub(crate) scale: f64,
    /// Whether rows have their shading normals.
    pub(crate) shaded: bool,
    pub(crate) projection: &'a Projection,
}

/// One round's problem, for friction to be added to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Round<'a> {
    pub(crate) metric: &'a Metric,
    pub(crate) unconstrained: &'a Vector6,
    /// Pose of the reference point at which the rows are linearised.
    pub(crate) candidate: &'a Pose,
    /// The same, as a point.
    center: Point3<f64>,
}

impl<'a> LinearAnswer<'a> {
    /// The same problem for friction; the contacts stuck last at `stuck_at`, as seen from the round's pose.
    pub(crate) fn rough<'b>(
        &'b self,
        round: &'b Round<'b>,
        stuck_at: &'b Vector6,
        carried: Carried<'b>,
    ) -> FrictionProblem<'b> {
        FrictionProblem {
            metric: round.metric,
            unconstrained: round.unconstrained,
            stuck_at,
            carried,
            reference_point: &round.center,
            constraints: self.constraints,
            moved: Some((self.start, round.candidate, self.shaded)),
        }
    }
}

/// The answer of the last round.
#[derive(Clone, Debug)]
pub(crate) struct ImplicitAnswer {
    /// Pose of the reference point at which the last round linearised.
    pub(crate) linearised_at: Pose,
    /// Pose of the reference point that it arrived at.
    pub(crate) reached: Pose,
    /// M at the last linearisation.
    pub(crate) metric: Metric,
    /// a_u of the last round.
    pub(crate) unconstrained: Vector6,
    pub(crate) projection: Projection,
    pub(crate) rounds: u32,
    /// Largest length of a round's motion, as a share of that of the one before; the linear answer is the first.
    pub(crate) contraction: f64,
}

impl ImplicitAnswer {
    /// How far the rounds may be trusted, in [0, 1]: 0 where some round was as long as the one before, so that they may end anywhere.
    pub(crate) fn trust(&self) -> f64 {
        ((1.0 - self.contraction) / (1.0 - CONVERGING)).clamp(0.0, 1.0)
    }
}

impl ImplicitRounds {
    /// Rounds for sets of at most `capacity` rows and a body of `radius` about its reference point, m. Where points of the body
    /// leave their tangents by less than `tolerance`, m, the linear rows are left as they are.
    pub(crate) fn new(
        settings: &Settings,
        radius: f64,
        tolerance: f64,
        projector: Projector,
        capacity: usize,
    ) -> Self {
        let capacity = if settings.implicit_rounds > 0 {
            capacity
        } else {
            0
        };
        Self {
            rounds: settings.implicit_rounds,
            radius,
            tolerance,
            slides: false,
            projector,
            rows: Vec::with_capacity(capacity),
            warm_start: Vec::with_capacity(capacity.min(6)),
        }
    }

    /// Rounds for round features, too, about which a body slides without turning. Not for a body that is to move: its way there would be a chord.
    pub(crate) fn about_round_features(mut self) -> Self {
        self.slides = true;
        self
    }

    /// See [`Projector::limit_iterations`].
    pub(crate) fn limit_iterations(&mut self, most: u32) {
        self.projector.limit_iterations(most);
    }

    /// Projects again from where the linear rows led to. `None` when they were true, or when no round had a certified answer.
    ///
    /// `bound_at` gives the bound of a row at x_s, in the order of the constraints. `with_friction` adds friction to a round's frictionless answer; the
    /// projector has the same rows. At most `implicit_rounds` rounds; no allocation unless the projector allocates.
    pub(crate) fn solve(
        &mut self,
        given: &LinearAnswer,
        bound_at: impl Fn(usize) -> f64,
        metric_at: impl Fn(&Pose) -> Option<Metric>,
        mut with_friction: impl FnMut(&Round<'_>, &mut Projector, Projection) -> Projection,
    ) -> Option<ImplicitAnswer> {
        let nothing_held = given.projection.active.is_empty();
        if self.rounds == 0 || nothing_held {
            return None;
        }
        let full = given.projection.acceleration / given.scale;
        let mut candidate = advance_pose(given.start, &full, 1.0);
        let mut turned = angular(&full).norm();
        let mut length = self.length(&full);
        let mut contraction = 0.0_f64;
        let mut branch = given.branch - angular(&full);
        let mut answer: Option<ImplicitAnswer> = None;
        self.remember_active(given.projection);
        for round in 1..=self.rounds {
            // A point of the body leaves its tangent by at most r theta^2 / 2; round features bend without that.
            let bends = 0.5 * self.radius * turned * turned > self.tolerance; // false for NaN
            if !bends && (!self.slides || self.holds_true(given, &bound_at, &candidate)) {
                break;
            }
            let difference = pose_difference(given.goal, &candidate, &branch);
            let unconstrained = difference * given.scale;
            let Some(metric) = metric_at(&candidate) else {
                break;
            };
            self.relinearise(given, &bound_at, &candidate);
            let (projector, rows) = (&mut self.projector, &self.rows);
            let frictionless = projector.project(&metric, &unconstrained, rows, &self.warm_start);
            let round_problem = Round {
                metric: &metric,
                unconstrained: &unconstrained,
                candidate: &candidate,
                center: Point3::from(candidate.translation.vector),
            };
            let projection = with_friction(&round_problem, projector, frictionless);
            if projection.status != ProjectionStatus::Solved {
                break;
            }
            self.remember_active(&projection);
            let step = projection.acceleration / given.scale;
            let reached = advance_pose(&candidate, &step, 1.0);
            turned = angular(&step).norm();
            let shorter = self.length(&step);
            contraction = contraction.max(shorter / length);
            length = shorter;
            branch = angular(&difference) - angular(&step);
            answer = Some(ImplicitAnswer {
                linearised_at: candidate,
                reached,
                metric,
                unconstrained,
                projection,
                rounds: round,
                contraction,
            });
            candidate = reached;
        }
        answer
    }

    /// Whether the rows that hold the body do so at the distance that they were projected to.
    fn holds_true(
        &self,
        given: &LinearAnswer,
        bound_at: impl Fn(usize) -> f64,
        candidate: &Pose,
    ) -> bool {
        self.warm_start.iter().all(|row| {
            let row = *row as usize;
            given.constraints.get(row).is_none_or(|constraint| {
                let moved = constraint.moved(given.start, candidate, given.shaded);
                let projected_to = constraint.gap + bound_at(row) / given.scale;
                (moved.gap - projected_to).abs() <= self.tolerance
            })
        })
    }

    /// Every row as it is at `candidate`.
    fn relinearise(
        &mut self,
        given: &LinearAnswer,
        bound_at: impl Fn(usize) -> f64,
        candidate: &Pose,
    ) {
        let center = Point3::from(candidate.translation.vector);
        self.rows.clear();
        for (row, constraint) in given.constraints.iter().enumerate() {
            let moved = constraint.moved(given.start, candidate, given.shaded);
            self.rows.push(HalfSpace {
                jacobian: contact_jacobian(&moved.normal, &moved.point, &center),
                bound: bound_at(row) + given.scale * (constraint.gap - moved.gap),
            });
        }
    }

    /// Bound on the path of the body's fastest point, m.
    fn length(&self, motion: &Vector6) -> f64 {
        linear(motion).norm() + self.radius * angular(motion).norm()
    }

    fn remember_active(&mut self, projection: &Projection) {
        self.warm_start.clear();
        self.warm_start
            .extend(projection.active.iter().map(|active| active.row));
    }
}
