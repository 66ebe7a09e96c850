//! Friction after the normal projection: the same function in both loops.
//!
//! The constrained acceleration of Eq. (1), and the one that the tangential multipliers of the last answer would lead to, tell which contacts touch and
//! what they bear. From there the cone problem is solved; its tangential multipliers are then a known wrench, and Eq. (1) is projected once more with
//! that wrench in a_u. So the answer keeps its certificate (the normal rows hold exactly, whatever the cone problem left), and the multipliers of both
//! parts balance `M (a_c - a_u)`.
//!
//! No energy is made: the tangential multipliers oppose the slip since the contact stuck last, or the cone problem is solved further, and friction
//! dropped at last.
//! Source: beyond the paper, which is frictionless. Coulomb's law in displacements, as the motion is quasi-static (Section 4.2).

use arrayvec::ArrayVec;
use nalgebra::{Point3, Vector3};

use super::carried::Carried;
use super::cone::{ConeProblem, MAX_CONE_CONTACTS, Measure};
use super::selection::ContactRow;
use crate::constraint::NonPenetrationConstraint;
use crate::quasi_statics::{MAX_ACTIVE, Metric, Projection, ProjectionStatus, Projector};
use crate::settings::Settings;
use crate::spatial::{Pose, Vector6, six};
use crate::world::World;

/// A contact touches when its row is this near to equality, in motion tolerances: gaps at rest differ by as much.
pub(crate) const TOUCHING_MOTION_TOLERANCES: f64 = 4.0;
/// Slip and penetration that the cone problem may leave, as a share of that: neither motion nor energy to what follows. A body that is wedged moves by
/// a multiple of it in the second projection;
const NO_SLIP_SHARE: f64 = 0.5;
/// where that would make energy, the cone problem is solved further: to this share of it, so many times. Then friction is dropped.
const FINER: f64 = 0.1;
const MAX_REFINEMENTS: usize = 3;
/// Friction may press the body against other rows: so many times the one that the answer violates most becomes a contact.
const MAX_ADDED: usize = 3;

/// Coulomb friction of one loop. No allocation after `new`.
#[derive(Clone, Debug)]
pub struct Friction {
    /// Coefficient of each obstacle.
    pub(super) coefficients: Vec<f64>,
    pub(super) touching: f64,
    /// Rows that touch.
    pub(super) touched: Vec<u32>,
    pub(super) cone: ConeProblem,
    /// The rows of the cone problem's contacts, in their order.
    pub(super) rows: ArrayVec<ContactRow, MAX_CONE_CONTACTS>,
    residual: f64,
    /// Length in the metric that the residual is relative to, m kg^(1/2).
    scale: f64,
    slid: bool,
    acts: bool,
}

/// One projection to which friction is to be added.
#[derive(Clone, Copy, Debug)]
pub struct FrictionProblem<'a> {
    /// M.
    pub metric: &'a Metric,
    /// a_u, m and rad.
    pub unconstrained: &'a Vector6,
    /// a_0: the acceleration at which the contacts stuck last; zero in the god-object loop, where the body's pose remembers.
    pub stuck_at: &'a Vector6,
    /// What obstacles have moved since then.
    pub carried: Carried<'a>,
    /// G, world, m.
    pub reference_point: &'a Point3<f64>,
    /// The constraint of each row that was projected on.
    pub constraints: &'a [NonPenetrationConstraint],
    /// Poses of the reference point where the constraints were collected and where the rows were linearised anew, and whether with shading normals.
    pub moved: Option<(&'a Pose, &'a Pose, bool)>,
}

impl FrictionProblem<'_> {
    /// Length in the metric of the farthest that an obstacle carries, m kg^(1/2).
    fn longest_carried(&self) -> f64 {
        let longest = self.carried.longest(self.constraints);
        self.metric
            .norm(&six(&(Vector3::x() * longest), &Vector3::zeros()))
    }

    /// Contact point of a row, world, m.
    pub(super) fn point(&self, constraint: &NonPenetrationConstraint) -> Point3<f64> {
        self.moved.map_or(constraint.point, |(start, at, shaded)| {
            constraint.moved(start, at, shaded).point
        })
    }
}

impl Friction {
    /// Most projections of one [`Friction::hold`].
    pub(crate) const MAX_PROJECTIONS: u32 = MAX_REFINEMENTS as u32 + 2;

    /// The friction of a world; `None` where every obstacle is frictionless: then there is nothing to pay.
    pub fn of(world: &World, settings: &Settings) -> Option<Self> {
        let coefficients: Vec<f64> = world
            .obstacles
            .iter()
            .map(|obstacle| obstacle.surface.friction)
            .collect();
        let any = coefficients.iter().any(|&coefficient| coefficient > 0.0); // false for NaN
        any.then(|| Self {
            coefficients,
            touching: TOUCHING_MOTION_TOLERANCES * settings.motion_tolerance,
            touched: Vec::with_capacity(settings.max_constraints),
            cone: ConeProblem::default(),
            rows: ArrayVec::new(),
            residual: 0.0,
            scale: 0.0,
            slid: true,
            acts: false,
        })
    }

    /// Residual of the last cone problem, relative to a_u: the slip and penetration that are left, and what the second projection changed.
    /// Zero without frictional contact.
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// By how much the last answer may be off, in the metric, m kg^(1/2); zero where the frictionless answer stands for one that was not found.
    pub(crate) fn error(&self) -> f64 {
        if self.residual.is_finite() {
            self.residual * self.scale
        } else {
            0.0
        }
    }

    /// Length in the metric of that part of the last answer `a` which is motion: where no loaded contact has slipped, they hold the rest, and what it moves is
    /// the error of the answer. m kg^(1/2).
    pub(crate) fn motion_of(&self, a: &Vector6, metric: &Metric) -> f64 {
        if self.slid || !self.acts {
            return metric.norm(a);
        }
        let y = metric.whiten(a);
        self.cone.free_part(&y).norm()
    }

    /// Whether a loaded contact has slipped in the last answer, or none was loaded: then sticking starts anew there.
    pub fn slid(&self) -> bool {
        self.slid
    }

    /// Whether the last answer is other than the frictionless one.
    pub fn acts(&self) -> bool {
        self.acts
    }

    /// Rows of the contacts that held the body in the last answer.
    pub(crate) fn holding(&self) -> impl Iterator<Item = u32> + '_ {
        let contacts = self.rows.iter().zip(&self.cone.contacts);
        let loaded = contacts.filter(|(_, contact)| self.acts && contact.load > 0.0);
        loaded.map(|(row, _)| row.index)
    }

    /// What the last answer's tangential multipliers do over the ways that obstacles made in the set's update, kg m^2.
    pub(crate) fn work_of_obstacles(&self) -> f64 {
        let contacts = self.cone.contacts.iter().filter(|_| self.acts);
        contacts
            .map(|c| c.grip[0] * c.obstacle[0] + c.grip[1] * c.obstacle[1])
            .sum()
    }

    /// Adds friction to `frictionless`, the projection of the same problem. Without a frictional contact that carries
    /// load it is returned unchanged, bit for bit. `projector` has the problem's rows prepared.
    pub fn hold(
        &mut self,
        problem: &FrictionProblem<'_>,
        projector: &mut Projector,
        frictionless: Projection,
    ) -> Projection {
        let stuck = self.acts && !self.slid;
        self.residual = 0.0;
        self.slid = true;
        self.acts = false;
        if frictionless.status != ProjectionStatus::Solved || frictionless.active.is_empty() {
            self.forget();
            return frictionless;
        }
        let metric = problem.metric;
        let scale = metric
            .norm(problem.unconstrained)
            .max(metric.norm(problem.stuck_at))
            .max(problem.longest_carried());
        let usable = scale.is_finite() && scale > 0.0;
        if !usable {
            return frictionless;
        }
        self.scale = scale;
        let predicted = self.predicted(problem, &frictionless, projector);
        let predicted = predicted.as_ref().unwrap_or(&frictionless);
        if !self.gather(problem, projector.rows(), &frictionless, predicted, stuck) {
            self.forget();
            return frictionless;
        }
        let mut measure = Measure {
            scale,
            no_slip: NO_SLIP_SHARE * self.touching,
        };
        let start = metric.whiten(&(predicted.acceleration - problem.unconstrained));
        let mut answer = self.cone.solve(measure, &start);
        for _ in 0..MAX_ADDED {
            if !self.add_violated(problem, projector.rows(), &answer.correction) {
                break;
            }
            answer = self.cone.solve_again(measure, &answer);
        }
        let mut refinements = 0..MAX_REFINEMENTS;
        let held = loop {
            let held = self.project_with_grip(problem, predicted, projector);
            let makes_energy = held.as_ref().is_some_and(|it| {
                let change = it.acceleration - problem.unconstrained;
                !self.dissipates(&metric.whiten(&change))
            });
            if !makes_energy || refinements.next().is_none() {
                break held.filter(|_| !makes_energy);
            }
            measure.no_slip *= FINER;
            answer = self.cone.solve_again(measure, &answer);
        };
        let Some(held) = held else {
            self.residual = f64::INFINITY;
            return frictionless;
        };
        let correction = metric.whiten(&(held.acceleration - problem.unconstrained));
        self.residual = answer.residual + (correction - answer.correction).norm() / scale;
        self.acts = true;
        held
    }

    /// The next contact finds nothing of those before.
    pub(super) fn forget(&mut self) {
        self.cone.contacts.clear();
        self.rows.clear();
    }

    /// The answer if friction still pulled as in the last one: which rows hold the body, and with what load. `None` without friction then.
    fn predicted(
        &self,
        problem: &FrictionProblem<'_>,
        frictionless: &Projection,
        projector: &mut Projector,
    ) -> Option<Projection> {
        let pulled = self.cone.contacts.iter().any(|c| c.grip != [0.0; 2]);
        let grip = || self.project_with_grip(problem, frictionless, projector);
        pulled.then(grip).flatten()
    }

    /// Eq. (1) once more, with the cone problem's tangential wrench in a_u. `None` where it has no certificate.
    fn project_with_grip(
        &self,
        problem: &FrictionProblem<'_>,
        likely: &Projection,
        projector: &mut Projector,
    ) -> Option<Projection> {
        let pulled = problem.unconstrained + problem.metric.unwhiten(&self.cone.grip_wrench());
        let likely: ArrayVec<u32, MAX_ACTIVE> = likely.active.iter().map(|row| row.row).collect();
        let projection = projector.project_prepared(&pulled, &likely);
        let solved = projection.status == ProjectionStatus::Solved;
        solved.then_some(projection)
    }

    /// Whether friction takes energy at this correction; notes whether a loaded contact slips.
    fn dissipates(&mut self, correction: &Vector6) -> bool {
        let (mut power, mut grip, mut loaded) = (0.0, 0.0, false);
        self.slid = false;
        for contact in self.cone.contacts.iter().filter(|c| c.coefficient > 0.0) {
            let slip = contact.slip_at(correction);
            power += contact.grip[0] * slip[0] + contact.grip[1] * slip[1];
            grip += contact.grip[0].hypot(contact.grip[1]);
            loaded |= contact.load > 0.0;
            self.slid |= contact.load > 0.0 && slip[0].hypot(slip[1]) > self.touching;
        }
        self.slid |= !loaded;
        power <= grip * self.touching // false for NaN
    }
}
