//! Constraint-based coupling: the force on the hand from a device pose and a constraint set, in microseconds.
//!
//! | symbol | name in code      | unit   | meaning                                                     |
//! |--------|-------------------|--------|-------------------------------------------------------------|
//! | a_u    | `unconstrained`   | m, rad | `k_s (x_h - x_s)`                                           |
//! | a_c    | `constrained`     | m, rad | projection of a_u on the constraint set (Eq. 1)             |
//! | b_k    | `bound`           | m      | `-k_s h_k`: force starts where the device crosses the surface |
//! | F_c    | `wrench`          | N, N m | `k_h M (a_c - a_u)`, at the reference point                 |
//!
//! With [`Settings::implicit_rounds`] the rows are re-linearised at a_c and projected again; the force is that of the last round.
//!
//! No collision detection, no allocation, bounded work: the god-object stands still meanwhile. What the set decides is prepared once
//! when it arrives; for each device sample there remain a difference of poses, the rows on their way in, the projection and the wrench.
//! Source: Ortega et al. 2007, Section 5; force shading Section 6.1.3; the bound beyond the paper.

use nalgebra::{Point3, Vector3};

use crate::adaptation::AdaptationState;
use crate::constraint::{ConstraintSet, contact_jacobian};
use crate::implicit::{ImplicitRounds, LinearAnswer};
use crate::known_rows::KnownRows;
use crate::quasi_statics::{HalfSpace, Metric, Projection, ProjectionStatus, Projector};
use crate::settings::Settings;
use crate::spatial::{
    Pose, Vector6, angular, at_reference_point, linear, pose_difference, pose_is_finite, six,
};
use crate::surface::{ShadedAcceleration, TexturedSurface, perturb_force};
use crate::world::World;

/// Loop 2 of the method. `step` allocates nothing.
#[derive(Debug)]
pub struct Coupling {
    settings: Settings,
    body: CoupledBody,
    /// Empty when no obstacle has a texture.
    surfaces: Vec<TexturedSurface>,
    prepared: PreparedSet,
    projector: Projector,
    implicit: ImplicitRounds,
    known: KnownRows,
    /// The bounds in force now: those of `rows`, lower where a row is on its way in.
    bounds: Vec<f64>,
    adaptation: Option<AdaptationState>,
    /// The rows of the present set, with the bounds where they belong.
    rows: Vec<HalfSpace>,
    warm_start: Vec<u32>,
    rotation: Vector3<f64>,
    /// `a_c - a_u` of the last step: what the force did. Zero without force.
    correction: Vector6,
}

/// What depends on the constraint set alone: made once when it arrives, used for every device sample until the next one.
/// The rows themselves are in `Coupling::rows` and, made ready, in its projector.
#[derive(Debug)]
struct PreparedSet {
    /// Sequence and pose of the set; `None` before the first.
    of: Option<(u64, Pose, usize)>,
    /// Pose of the reference point.
    god_object: Pose,
    /// `None` where it is not positive definite, or the pose is not finite.
    metric: Option<Metric>,
    shaded: bool,
}

impl PreparedSet {
    #[inline]
    fn serves(&self, set: &ConstraintSet) -> bool {
        let of = (set.sequence, set.god_object_pose, set.constraints.len());
        self.of == Some(of) // false for a pose that is not finite
    }
}

/// What the coupling needs to know of the body: no surface.
#[derive(Debug)]
struct CoupledBody {
    mass: f64,
    inertia: nalgebra::Matrix3<f64>,
    reference_point: Point3<f64>,
}

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
    /// How the projection ended. Anything but `Solved` comes with a zero wrench.
    pub status: ProjectionStatus,
    /// The norm clamp of force or torque was at work.
    pub saturated: bool,
}

impl Coupling {
    /// Prepares the loop; every buffer gets its final size.
    pub fn new(world: &World, settings: &Settings) -> Self {
        let textured = world
            .obstacles
            .iter()
            .any(|obstacle| obstacle.surface.texture.is_some());
        let surfaces = if textured {
            world.obstacles.iter().map(Into::into).collect()
        } else {
            Vec::new()
        };
        let capacity = settings.max_constraints;
        Self {
            settings: *settings,
            body: CoupledBody {
                mass: world.body.mass,
                inertia: world.body.inertia,
                reference_point: world.body.reference_point,
            },
            surfaces,
            prepared: PreparedSet {
                of: None,
                god_object: Pose::identity(),
                metric: None,
                shaded: false,
            },
            projector: Projector::new(settings.solver, capacity),
            implicit: ImplicitRounds::new(
                settings,
                world.body.mesh.radius_about(&world.body.reference_point),
                Projector::new(settings.solver, capacity),
                capacity,
            ),
            known: KnownRows::new(capacity),
            bounds: Vec::with_capacity(capacity),
            adaptation: settings
                .adaptation
                .map(|a| AdaptationState::new(a, capacity)),
            rows: Vec::with_capacity(capacity),
            warm_start: Vec::with_capacity(capacity.min(6)),
            rotation: Vector3::zeros(),
            correction: Vector6::zeros(),
        }
    }

    /// The force for one device pose. `time` in seconds never runs back; it drives the constraint adaptation.
    ///
    /// A set with sequence, pose and number of rows of the one before is taken for the same set.
    /// A pose that is not finite gives a zero wrench and `ProjectionStatus::NotFinite`.
    pub fn step(&mut self, time: f64, device_pose: &Pose, set: &ConstraintSet) -> CouplingOutput {
        if !pose_is_finite(device_pose) || !pose_is_finite(&set.god_object_pose) {
            return CouplingOutput::without_force(ProjectionStatus::NotFinite);
        }
        if !self.prepared.serves(set) {
            self.prepare(set);
        }
        let device = at_reference_point(device_pose, &self.body.reference_point);
        let difference = pose_difference(&device, &self.prepared.god_object, &self.rotation);
        self.rotation = angular(&difference);
        let unconstrained = difference * self.settings.k_s;
        let Some(metric) = &self.prepared.metric else {
            return CouplingOutput::without_force(ProjectionStatus::NotFinite);
        };

        // Where the last force would leave the body: a new constraint jumps only as far as this violates it.
        let reached = unconstrained + std::mem::replace(&mut self.correction, Vector6::zeros());
        if let Some(adaptation) = self.adaptation.as_mut().filter(|state| !state.is_idle()) {
            adaptation.step(
                time,
                |row| self.rows[row].bound,
                |row| self.rows[row].jacobian.dot(&reached),
                |row, bound| {
                    self.projector.set_bound(row, bound);
                    self.bounds[row] = bound;
                },
            );
        }
        let mut projection = self
            .projector
            .project_prepared(&unconstrained, &self.warm_start);
        self.warm_start.clear();
        if projection.status != ProjectionStatus::Solved {
            return CouplingOutput::without_force(projection.status);
        }
        self.warm_start
            .extend(projection.active.iter().map(|row| row.row));

        // F_c = k_h M (a_c - a_u)
        let mut held = metric.mass_matrix_times(&(projection.acceleration - unconstrained));
        let given = LinearAnswer {
            constraints: &set.constraints[..self.rows.len()],
            start: &self.prepared.god_object,
            goal: &device,
            branch: self.rotation,
            scale: self.settings.k_s,
            shaded: self.prepared.shaded,
            projection: &projection,
        };
        let implicit = self.implicit.solve(
            &given,
            |row| self.bounds[row],
            |pose| self.body.metric(&self.settings, pose),
        );
        if let Some(answer) = implicit {
            let change = answer.projection.acceleration - answer.unconstrained;
            held = answer.metric.mass_matrix_times(&change);
            // What follows counts from x_s.
            let nearest = angular(&projection.acceleration) / self.settings.k_s;
            let moved = pose_difference(&answer.reached, &self.prepared.god_object, &nearest);
            projection = answer.projection;
            projection.acceleration = moved * self.settings.k_s;
        }
        self.correction = projection.acceleration - unconstrained;
        let mut wrench = held * self.settings.k_h;
        if !self.surfaces.is_empty() {
            let center = Point3::from(self.prepared.god_object.translation.vector);
            wrench = self.textured(&wrench, &projection, &center, set);
        }
        let (wrench, saturated) = self.limited(&wrench);
        CouplingOutput {
            wrench,
            shaded: self.prepared.shaded.then_some(ShadedAcceleration {
                sequence: set.sequence,
                acceleration: projection.acceleration,
            }),
            active: projection.active.len(),
            kkt: projection.kkt_residual,
            status: projection.status,
            saturated,
        }
    }

    /// Everything that the set decides, whatever the device does: rows, metric, and which rows are new.
    fn prepare(&mut self, set: &ConstraintSet) {
        let constraints =
            &set.constraints[..set.constraints.len().min(self.settings.max_constraints)];
        let god_object = at_reference_point(&set.god_object_pose, &self.body.reference_point);
        let center = Point3::from(god_object.translation.vector);
        self.rows.clear();
        let mut shaded = false;
        for constraint in constraints {
            let normal = constraint.shading_normal.unwrap_or(constraint.normal);
            shaded |= constraint.shading_normal.is_some();
            self.rows.push(HalfSpace {
                jacobian: contact_jacobian(&normal, &constraint.point, &center),
                bound: self.settings.coupling_bound(constraint.gap),
            });
        }
        self.bounds.clear();
        self.bounds.extend(self.rows.iter().map(|row| row.bound));
        let metric = self.body.metric(&self.settings, &god_object);
        if let Some(metric) = &metric {
            self.projector.prepare(metric, &self.rows);
        }

        // Rows are known by their features: those that held the body last time are looked for where they are now.
        self.known.replace(constraints);
        if let Some(adaptation) = &mut self.adaptation {
            adaptation.observe(&self.known);
        }
        let known = &self.known;
        self.warm_start.retain_mut(|row| {
            let place = known.place_of(*row);
            *row = place.unwrap_or(*row);
            place.is_some()
        });
        self.prepared = PreparedSet {
            of: Some((set.sequence, set.god_object_pose, set.constraints.len())),
            god_object,
            metric,
            shaded,
        };
    }

    /// The wrench tilted by the textures under the active contacts, which the motion carries along.
    fn textured(
        &self,
        wrench: &Vector6,
        projection: &Projection,
        center: &Point3<f64>,
        set: &ConstraintSet,
    ) -> Vector6 {
        let moved = |point: &Point3<f64>| {
            let arm = point - center;
            point + linear(&projection.acceleration) + angular(&projection.acceleration).cross(&arm)
        };
        let contacts = projection.active.iter().filter_map(|active| {
            let constraint = set.constraints.get(active.row as usize)?;
            Some((
                constraint.features.obstacle,
                moved(&constraint.point),
                constraint.normal,
            ))
        });
        perturb_force(wrench, center, &self.surfaces, contacts)
    }

    /// Force and torque clamped by norm, each with its direction kept.
    fn limited(&self, wrench: &Vector6) -> (Vector6, bool) {
        let clamp = |v: Vector3<f64>, limit: f64| {
            let norm = v.norm();
            if norm <= limit {
                (v, false)
            } else {
                (v * (limit / norm), true)
            }
        };
        let (force, force_clamped) = clamp(linear(wrench), self.settings.force_limit);
        let (torque, torque_clamped) = clamp(angular(wrench), self.settings.torque_limit);
        (six(&force, &torque), force_clamped || torque_clamped)
    }
}

impl CoupledBody {
    fn metric(&self, settings: &Settings, pose: &Pose) -> Option<Metric> {
        crate::world::metric_at(self.mass, &self.inertia, settings.rotation_metric, pose)
    }
}

impl CouplingOutput {
    fn without_force(status: ProjectionStatus) -> Self {
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
