//! God-object simulation: the body follows the device as far as the obstacles let it, and never further.
//!
//! | symbol | name in code          | unit   | meaning                                                          |
//! |--------|-----------------------|--------|------------------------------------------------------------------|
//! | x_h    | `device_pose`         | m, –   | pose of the haptic device                                        |
//! | x_s    | `pose`                | m, –   | god-object pose                                                  |
//! | a_u    | `unconstrained`       | m, rad | `k_s (x_h - x_s)`, or the shaded acceleration of Section 6.1.3   |
//! | a_c    | `constrained`         | m, rad | projection of a_u on the constraint set (Eq. 1)                  |
//!
//! Source: Ortega et al. 2007, Section 4.1. Beyond the paper: project, move and collect repeat within one update until the
//! motion left is below tolerance, so that one update slides around a corner instead of stopping at it; and a trust
//! length keeps the linear constraints honest on curved surfaces.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use crate::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work,
};
use crate::constraint::{
    ConstraintSet, Contact, NonPenetrationConstraint, contact_jacobian,
};
use crate::quasi_statics::{HalfSpace, KKT_TOLERANCE, ProjectionStatus, Projector};
use crate::settings::{Settings, SettingsError};
use crate::shape::{self, shapes_intersect};
use crate::spatial::{
    Pose, Vector6, advance_pose, angular, at_reference_point, from_reference_point, linear,
    pose_difference, pose_is_finite,
};
use crate::surface::{ShadedAcceleration, ShadingNormals};
use crate::world::World;

/// A sub-step that covers less than this share of its motion shows that the linear constraints reach too far.
const TRUSTED_SHARE: f64 = 0.5;
/// How much shorter the motions become when one turns back on the last.
const TURNING_BACK_DAMPING: f64 = 0.5;
/// How much shorter a look-ahead becomes that costs too much, and how much longer one that costs little.
const LOOK_AHEAD_SHRINKS: f64 = 0.5;
const LOOK_AHEAD_GROWS: f64 = 1.25;
/// The paper's cone has touching contacts only: gaps up to this many rest distances touch.
const TOUCHING_REST_DISTANCES: f64 = 2.0;

/// Loop 1 of the method.
#[derive(Debug)]
pub struct GodObject {
    world: Arc<World>,
    settings: Settings,
    pose: Pose,
    set: ConstraintSet,
    shading: Vec<Option<ShadingNormals>>,
    projector: Projector,
    collision: CollisionWorkspace,
    contacts: Vec<Contact>,
    rows: Vec<HalfSpace>,
    warm_start: Vec<u32>,
    rotation: Vector3<f64>,
    radius: f64,
    trust_length: f64,
    last_device: Option<Pose>,
    /// Distance within which the present set has every row, m.
    collected_within: f64,
    /// Longest look-ahead that the last ones' cost allows, m.
    affordable: f64,
}

/// What the sub-steps of one update hand on.
#[derive(Clone, Copy, Debug)]
struct Update {
    /// Path of the device since the last update, m: it may move as far again until the next.
    device_moved: f64,
    /// That, and what the body may still cover, m: so far the published set must look ahead.
    look_ahead: f64,
    /// Motion of the sub-step before.
    last_motion: Vector6,
    /// Share of the projected motion that is made; shrinks while motions turn back on each other.
    damping: f64,
}

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
    /// The input was not finite: nothing moved.
    pub rejected: bool,
    /// The budget or the sub-steps ran out before the motion left was below tolerance: safe, only not yet closest.
    pub unfinished: bool,
    /// Work counts.
    pub work: Work,
}

/// Why a god-object cannot start.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StartError {
    /// The body starts inside an obstacle.
    #[error(
        "the god-object starts in penetration of obstacle \"{obstacle}\": move god_object.pose until they are apart"
    )]
    Penetration {
        /// The obstacle's name.
        obstacle: String,
    },
    /// The start pose has a component that is not a finite number.
    #[error("the god-object's start pose is not finite: give numbers in god_object.pose")]
    PoseNotFinite,
    /// Mass and inertia make no metric.
    #[error(
        "the god-object's mass ({mass} kg) and inertia are not positive definite: give a mass above zero and a body with volume"
    )]
    Metric {
        /// The mass given, kg.
        mass: f64,
    },
    /// A setting is out of range.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}

impl GodObject {
    /// Whether [`GodObject::new`] would take this start.
    pub fn check_start(world: &World, settings: &Settings, start: &Pose) -> Result<(), StartError> {
        settings.validate()?;
        if !pose_is_finite(start) {
            return Err(StartError::PoseNotFinite);
        }
        if world.body.metric(settings.rotation_metric, start).is_none() {
            return Err(StartError::Metric {
                mass: world.body.mass,
            });
        }
        for obstacle in &world.obstacles {
            if shapes_intersect(&world.body, start, obstacle, &obstacle.pose) {
                return Err(StartError::Penetration {
                    obstacle: obstacle.name.clone(),
                });
            }
        }
        Ok(())
    }

    /// Checks the start, sizes every buffer and collects the first constraint set.
    pub fn new(world: Arc<World>, settings: Settings, start: Pose) -> Result<Self, StartError> {
        Self::check_start(&world, &settings, &start)?;
        let capacity = settings.max_constraints;
        let radius = world.body.mesh.radius_about(&world.body.reference_point);
        let mut god_object = Self {
            shading: world.obstacles.iter().map(ShadingNormals::of).collect(),
            world,
            settings,
            pose: start,
            set: ConstraintSet::with_capacity(capacity),
            projector: Projector::new(settings.solver, capacity).with_reference_fallback(true),
            collision: CollisionWorkspace::new(),
            contacts: Vec::with_capacity(capacity),
            rows: Vec::with_capacity(capacity),
            warm_start: Vec::with_capacity(6),
            rotation: Vector3::zeros(),
            radius,
            trust_length: f64::INFINITY,
            last_device: None,
            collected_within: 0.0,
            affordable: settings.look_ahead_limit,
        };
        god_object.collect(settings.activation_distance, &mut Work::default());
        Ok(god_object)
    }

    /// World from body: where the god-object is.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// The constraints that hold at [`Self::pose`].
    pub fn constraint_set(&self) -> &ConstraintSet {
        &self.set
    }

    /// The settings in force.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// One update: moves the body the share k_s of the way to the device, as far as the obstacles let it, and collects the
    /// constraint set there.
    ///
    /// `shaded` is the first pass of force shading; it replaces a_u when it was computed on the present set. The bodies
    /// never intersect on the way, whatever the input; a pose that is not finite moves nothing.
    pub fn step(&mut self, device_pose: &Pose, shaded: Option<&ShadedAcceleration>) -> StepReport {
        let mut report = StepReport::default();
        if !pose_is_finite(device_pose) {
            report.rejected = true;
            self.describe_set(&mut report);
            return report;
        }

        // 1. and 2. The share of the way that this update is to cover, as a pose to arrive at.
        let start = self.pose_at_reference_point();
        let device = at_reference_point(device_pose, &self.world.body.reference_point);
        let difference = pose_difference(&device, &start, &self.rotation);
        self.rotation = angular(&difference);
        let unconstrained = match shaded {
            Some(pass) if pass.sequence == self.set.sequence => pass.acceleration,
            _ => difference * self.settings.k_s,
        };
        let goal = advance_pose(&start, &unconstrained, 1.0);
        let device_moved = self.last_device.replace(device).map_or(0.0, |last| {
            self.motion_length(&pose_difference(&device, &last, &Vector3::zeros()))
        });

        // 3. to 5., repeated: a budget that runs out is safe, the pose reached is valid.
        let mut branch = angular(&unconstrained);
        let mut update = Update {
            device_moved,
            look_ahead: device_moved,
            last_motion: Vector6::zeros(),
            damping: 1.0,
        };
        report.unfinished = true;
        while report.substeps < self.settings.max_substeps {
            let budget_left = self
                .settings
                .work_budget
                .is_none_or(|budget| report.work.nominal_us() < budget);
            if !budget_left {
                break;
            }
            report.substeps += 1;
            let left = pose_difference(&goal, &self.pose_at_reference_point(), &branch);
            branch = angular(&left);
            if !self.substep(&left, &mut update, &mut report) {
                report.unfinished = false;
                break;
            }
        }
        // Sets between sub-steps serve the next sub-step alone; the one that is published looks ahead.
        let published = self.published_distance(&update);
        if self.collected_within < published {
            self.collect(published, &mut report.work);
        }
        self.describe_set(&mut report);
        report
    }

    /// Project, move, collect, once. False when there was nothing left to move.
    fn substep(&mut self, left: &Vector6, update: &mut Update, report: &mut StepReport) -> bool {
        let length = self.motion_length(left);
        let moves = length > self.settings.motion_tolerance; // false for NaN
        let eases = self.set.gap_min < self.settings.rest_distance - self.settings.motion_tolerance;
        if !moves && !eases {
            return false;
        }
        // 3. Project, on no more of the way than the linear constraints are trusted for.
        let trusted = if length > self.trust_length {
            left * (self.trust_length / length)
        } else {
            *left
        };
        let Some(mut constrained) = self.project(&trusted, report) else {
            return false;
        };
        // A motion that turns back on the last one says that the minimum lies between: features took turns in holding.
        if self.turns_back(&constrained, &update.last_motion) {
            update.damping *= TURNING_BACK_DAMPING;
        }
        constrained *= update.damping;
        update.last_motion = constrained;
        let covered = self.motion_length(&constrained);
        if report.substeps == 1 {
            // This update covers the share k_s of what is free, the next sets must serve the rest.
            update.look_ahead =
                update.device_moved + covered * (1.0 - self.settings.k_s) / self.settings.k_s;
        }
        let worth_moving = covered > self.settings.motion_tolerance; // false for NaN
        if !worth_moving {
            return false;
        }

        // 4. Move as far as continuous collision detection allows.
        let start = self.pose_at_reference_point();
        let time = self.free_time(&start, &constrained, report);
        if time > 0.0 {
            let reached = advance_pose(&start, &constrained, time);
            self.pose = from_reference_point(&reached, &self.world.body.reference_point);
        }
        if time < TRUSTED_SHARE {
            self.trust_length = (covered * time).max(self.settings.rest_distance);
        } else if time >= 1.0 {
            self.trust_length *= 2.0;
        }

        // 5. Collect at the pose reached: for the next sub-step what it can reach, or all when it is likely the last.
        let distance = if covered < self.settings.rest_distance {
            self.published_distance(update)
        } else {
            self.settings
                .activation_distance
                .min(2.0 * self.settings.rest_distance + covered)
        };
        self.collect(distance, &mut report.work);
        true
    }

    /// Eq. (1) on the present constraint set; `None` when there is no certified answer.
    fn project(&mut self, unconstrained: &Vector6, report: &mut StepReport) -> Option<Vector6> {
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
        let projection =
            self.projector
                .project(&metric, unconstrained, &self.rows, &self.warm_start);
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

    /// The fraction of the motion that is free of every obstacle, in [0, 1].
    fn free_time(&mut self, start: &Pose, displacement: &Vector6, report: &mut StepReport) -> f64 {
        let mut motion = Motion {
            start: *start,
            displacement: *displacement,
            reference_point: self.world.body.reference_point,
        };
        let settings = AdvancementSettings {
            minimum_gap: self.settings.minimum_gap,
            gap_tolerance: self.settings.gap_tolerance,
            max_iterations: self.settings.max_advancement_steps,
            ..AdvancementSettings::default()
        };
        let mut free = 1.0;
        for obstacle in &self.world.obstacles {
            let found = shape::time_of_impact(
                &self.world.body,
                &motion,
                obstacle,
                &obstacle.pose,
                &settings,
                &mut self.collision,
                &mut report.work,
            );
            let time = match found {
                TimeOfImpact::Separated => continue,
                TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => time,
                TimeOfImpact::Overlapping => 0.0,
            };
            // The next obstacle needs to be searched only up to here.
            let shortened = time.clamp(0.0, 1.0);
            free *= shortened;
            motion.displacement *= shortened;
            if shortened == 0.0 {
                break;
            }
        }
        free
    }

    /// How far the set that an update publishes collects, m.
    fn published_distance(&self, update: &Update) -> f64 {
        if self.settings.look_ahead {
            self.settings.activation_distance + update.look_ahead.min(self.affordable)
        } else {
            TOUCHING_REST_DISTANCES * self.settings.rest_distance
        }
    }

    /// Replaces the constraint set by the one of the present pose: every facing pair within `distance`, m.
    fn collect(&mut self, distance: f64, work: &mut Work) {
        let pairs_before = work.triangle_pairs;
        self.collected_within = distance;
        self.set.sequence += 1;
        self.set.god_object_pose = self.pose;
        self.set.gap_min = f64::INFINITY;
        self.set.truncated = false;
        self.set.constraints.clear();
        for (index, obstacle) in self.world.obstacles.iter().enumerate() {
            self.contacts.clear();
            let collected = shape::collect(
                &self.world.body,
                &self.pose,
                obstacle,
                &obstacle.pose,
                u16::try_from(index).unwrap_or(u16::MAX),
                distance,
                &mut self.collision,
                &mut self.contacts,
                work,
            );
            self.set.gap_min = self.set.gap_min.min(collected.gap_min);
            let room = self.settings.max_constraints - self.set.constraints.len();
            self.set.truncated |= collected.truncated || self.contacts.len() > room;
            for contact in self.contacts.iter().take(room) {
                let shading_normal = self.shading[index].as_ref().and_then(|normals| {
                    normals.at(
                        obstacle,
                        contact.obstacle_triangle,
                        &contact.barycentric,
                        &contact.normal,
                    )
                });
                self.set.constraints.push(NonPenetrationConstraint {
                    features: contact.features,
                    point: contact.point_on_obstacle,
                    normal: contact.normal,
                    gap: contact.gap,
                    shading_normal,
                });
            }
        }
        let pairs = work.triangle_pairs - pairs_before;
        if pairs > self.settings.look_ahead_pairs {
            let beyond = (distance - self.settings.activation_distance).max(0.0);
            self.affordable = beyond.min(self.affordable) * LOOK_AHEAD_SHRINKS;
        } else if pairs < self.settings.look_ahead_pairs / 4 {
            self.affordable = (self.affordable * LOOK_AHEAD_GROWS)
                .max(self.settings.activation_distance)
                .min(self.settings.look_ahead_limit);
        }
        // Ascending features: the coupling finds known rows by bisection, and the order says nothing of the traversal.
        self.set
            .constraints
            .sort_unstable_by_key(|row| row.features);
        self.warm_start.clear();
    }

    fn pose_at_reference_point(&self) -> Pose {
        at_reference_point(&self.pose, &self.world.body.reference_point)
    }

    /// Bound on the path of the body's fastest point, m.
    fn motion_length(&self, displacement: &Vector6) -> f64 {
        linear(displacement).norm() + self.radius * angular(displacement).norm()
    }

    /// Whether one motion undoes a part of the other, points of the body weighed alike.
    fn turns_back(&self, motion: &Vector6, last: &Vector6) -> bool {
        let along = linear(motion).dot(&linear(last))
            + self.radius * self.radius * angular(motion).dot(&angular(last));
        along < 0.0
    }

    fn describe_set(&self, report: &mut StepReport) {
        report.contacts = self.set.constraints.len();
        report.gap_min = self.set.gap_min;
    }
}
