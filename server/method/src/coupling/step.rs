//! Constraint-based coupling: the force on the hand from a device pose and a constraint set, in microseconds.
//!
//! | symbol | name in code      | unit   | meaning                                                     |
//! |--------|-------------------|--------|-------------------------------------------------------------|
//! | a_u    | `unconstrained`   | m, rad | `k_s (x_h - x_s)`                                           |
//! | a_c    | `constrained`     | m, rad | projection of a_u on the constraint set (Eq. 1)             |
//! | b_k    | `bound`           | m      | `-k_s h_k`: force starts where the device crosses the surface |
//! | F_c    | `wrench`          | N, N m | `k_h M (a_c - a_u)`, at the reference point                 |
//!
//! With [`Settings::implicit_rounds`] the rows are re-linearised at a_c and projected again; the force is that of the last round, where they converge.
//!
//! No collision detection, no allocation, bounded work: the god-object stands still meanwhile. What the set decides comes with it or is prepared
//! once when it arrives; for each device sample there remain a difference of poses, the rows on their way in, the projection and the wrench.
//! Source: Ortega et al. 2007, Section 5; force shading Section 6.1.3; the bound beyond the paper.

use nalgebra::{Point3, Vector3};

use super::{Arrival, CouplingOutput};
use crate::adaptation::AdaptationState;
use crate::constraint::{ConstraintSet, Feature};
use crate::damping::ContactDamping;
use crate::implicit::{ImplicitRounds, LinearAnswer};
use crate::known_rows::KnownRows;
use crate::obstacle_work::ObstacleWork;
use crate::prepared_rows::{PreparedRows, RowBasis};
use crate::quasi_statics::{
    HalfSpace, KKT_TOLERANCE, Metric, Projection, ProjectionStatus, Projector,
};
use crate::settings::Settings;
use crate::spatial::{
    Pose, Vector6, angular, at_reference_point, linear, pose_difference, pose_is_finite, six,
};
use crate::surface::{
    EnergyObserver, Friction, FrictionProblem, ShadedAcceleration, StickAnchor,
    TOUCHING_MOTION_TOLERANCES, Textures,
};
use crate::turn_memory::TurnMemory;
use crate::world::World;

/// Loop 2 of the method. `step` allocates nothing.
#[derive(Debug)]
pub struct Coupling {
    settings: Settings,
    basis: RowBasis,
    /// `None` when no obstacle has a texture.
    textures: Option<Textures>,
    present: PresentSet,
    /// For sets that come without rows made ready.
    own: PreparedRows,
    projector: Projector,
    /// `None` when every obstacle is frictionless.
    friction: Option<Friction>,
    anchor: StickAnchor,
    /// The rows with the bounds in force, where there is friction.
    rough_rows: Vec<HalfSpace>,
    /// `None` unless passivity is enforced.
    energy: Option<EnergyObserver>,
    /// `None` where nothing is damped.
    damping: Option<ContactDamping>,
    obstacle_work: ObstacleWork,
    implicit: ImplicitRounds,
    arrival: Arrival,
    known: KnownRows,
    /// Where the rows belong now.
    targets: Vec<f64>,
    /// The bounds in force now: those, lower where a row is on its way in.
    bounds: Vec<f64>,
    adaptation: Option<AdaptationState>,
    warm_start: Vec<u32>,
    turn: TurnMemory,
    /// `a_c - a_u` of the last step: what the force did. Zero without force.
    correction: Vector6,
    /// Most visits of rows in the projections of a step; `None`: as many as the solver's own limits allow.
    most_row_visits: Option<u32>,
    /// Number of the device sample of the last step.
    sample: Option<u64>,
}

/// What depends on the constraint set alone: taken from it when it arrives, used for every device sample until the next one.
/// The rows themselves are in the projector.
#[derive(Debug)]
struct PresentSet {
    /// Sequence and pose of the set; `None` before the first.
    of: Option<(u64, Pose, usize)>,
    /// Pose of the reference point.
    god_object: Pose,
    /// `None` where it is not positive definite, or the pose is not finite.
    metric: Option<Metric>,
    shaded: bool,
    /// Some obstacle came nearer or went away in the update that made the set.
    moving: bool,
}

impl PresentSet {
    #[inline]
    fn is(&self, set: &ConstraintSet) -> bool {
        let of = (set.sequence, set.god_object_pose, set.constraints.len());
        self.of == Some(of) // false for a pose that is not finite
    }
}

impl Coupling {
    /// Prepares the loop; every buffer gets its final size.
    pub fn new(world: &World, settings: &Settings) -> Self {
        let capacity = settings.max_constraints;
        let friction = Friction::of(world, settings);
        Self {
            settings: *settings,
            basis: RowBasis::of(&world.body, settings),
            textures: Textures::of(world),
            own: PreparedRows::with_capacity(capacity),
            present: PresentSet {
                of: None,
                god_object: Pose::identity(),
                metric: None,
                shaded: false,
                moving: false,
            },
            projector: Projector::new(settings.solver, capacity),
            rough_rows: Vec::with_capacity(if friction.is_some() { capacity } else { 0 }),
            friction,
            anchor: StickAnchor::default(),
            energy: settings.passive.then(EnergyObserver::new),
            damping: ContactDamping::of(settings.damping_time, settings.solver),
            obstacle_work: ObstacleWork::default(),
            arrival: Arrival::default(),
            implicit: ImplicitRounds::new(
                settings,
                world.body.mesh.radius_about(&world.body.reference_point),
                settings.motion_tolerance,
                Projector::new(settings.solver, capacity),
                capacity,
            )
            .about_round_features(),
            known: KnownRows::new(capacity),
            targets: Vec::with_capacity(capacity),
            bounds: Vec::with_capacity(capacity),
            adaptation: settings
                .adaptation
                .map(|a| AdaptationState::new(a, capacity)),
            warm_start: Vec::with_capacity(capacity.min(6)),
            turn: TurnMemory::default(),
            correction: Vector6::zeros(),
            most_row_visits: None,
            sample: None,
        }
    }

    /// The force for a new device sample: [`Self::answer`] for callers that ask once a sample.
    pub fn step(&mut self, time: f64, device_pose: &Pose, set: &ConstraintSet) -> CouplingOutput {
        let sample = self.sample.map_or(0, |last| last.wrapping_add(1));
        self.answer(time, sample, device_pose, set)
    }

    /// The force for one device sample. `time` in seconds never runs back; it drives the constraint adaptation.
    ///
    /// `sample` numbers the reading of the device. The number of the call before says that it is the same reading, with a newer set: the
    /// force is computed anew, and takes the place of the one before. It is no motion: energy and speed go on from sample to sample.
    /// A set with sequence, pose and number of rows of the one before is taken for the same set.
    /// A pose that is not finite gives a zero wrench and `ProjectionStatus::NotFinite`.
    pub fn answer(
        &mut self,
        time: f64,
        sample: u64,
        device_pose: &Pose,
        set: &ConstraintSet,
    ) -> CouplingOutput {
        let moved = self.sample.replace(sample) != Some(sample);
        if !pose_is_finite(device_pose) {
            if let Some(energy) = &mut self.energy {
                energy.forget_pose();
            }
            return self.without_force(ProjectionStatus::NotFinite, None);
        }
        let device = at_reference_point(device_pose, &self.basis.reference_point);
        let new_sample = moved.then_some(&device);
        if !pose_is_finite(&set.god_object_pose) {
            return self.without_force(ProjectionStatus::NotFinite, new_sample);
        }
        let arrived = !self.present.is(set);
        if arrived {
            self.take(set);
            self.arrival.observe(set.published.unwrap_or(time));
        }
        if self.present.moving {
            self.carry_rows(time, set);
        }
        if let Some(damping) = &mut self.damping {
            damping.observe(time, &device);
        }
        let difference = self.turn.difference(&device, &self.present.god_object);
        let unconstrained = difference * self.settings.k_s;
        let Some(metric) = self.present.metric else {
            return self.without_force(ProjectionStatus::NotFinite, new_sample);
        };

        // Where the last force would leave the body: a new constraint jumps only as far as this violates it.
        let reached = unconstrained + std::mem::replace(&mut self.correction, Vector6::zeros());
        if let Some(adaptation) = self.adaptation.as_mut().filter(|state| !state.is_idle()) {
            let center = Point3::from(self.present.god_object.translation.vector);
            let jacobian = |row: usize| {
                let row = self.basis.half_space(&set.constraints[row], &center);
                row.jacobian
            };
            adaptation.step(
                time,
                |row| self.targets[row],
                |row| jacobian(row).dot(&reached),
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
        if self.friction.is_some() {
            projection = self.grip(&metric, &unconstrained, set, projection);
        }
        // Where obstacles close in on each other from both sides, nothing is pushed but nothing gives way.
        let squeezed = self.present.moving
            && projection.status == ProjectionStatus::Infeasible
            && projection.kkt_residual <= KKT_TOLERANCE;
        if projection.status != ProjectionStatus::Solved && !squeezed {
            return self.without_force(projection.status, new_sample);
        }
        self.warm_start
            .extend(projection.active.iter().map(|row| row.row));

        // F_c = k_h M (a_c - a_u)
        let mut held = metric.mass_matrix_times(&(projection.acceleration - unconstrained));
        let damped = self.damping.as_mut().map(|damping| {
            let center = Point3::from(self.present.god_object.translation.vector);
            let in_force = |row: usize| HalfSpace {
                bound: self.bounds[row],
                ..self.basis.half_space(&set.constraints[row], &center)
            };
            let k_s = self.settings.k_s;
            damping.held(&metric, &unconstrained, k_s, &projection, in_force)
        });
        let given = LinearAnswer {
            constraints: &set.constraints[..self.bounds.len()],
            start: &self.present.god_object,
            goal: &device,
            branch: self.turn.branch(),
            scale: self.settings.k_s,
            shaded: self.present.shaded,
            projection: &projection,
        };
        // Friction is on the linear rows.
        let rough = self.friction.as_ref().is_some_and(Friction::acts);
        let implicit = if rough {
            None
        } else {
            self.implicit.solve(
                &given,
                |row| self.bounds[row],
                |pose| self.basis.metric(pose),
            )
        };
        let mut reached = None;
        if let Some(answer) = implicit {
            // Rounds that do not converge give way to the linear rows, without a step between.
            let trust = answer.trust();
            if trust > 0.0 {
                let change = answer.projection.acceleration - answer.unconstrained;
                let force = answer.metric.mass_matrix_times(&change);
                held += (force - held) * trust;
                // What follows counts from x_s.
                let linear = projection.acceleration;
                let nearest = angular(&linear) / self.settings.k_s;
                let moved = pose_difference(&answer.reached, &self.present.god_object, &nearest);
                projection = answer.projection;
                projection.acceleration = linear + (moved * self.settings.k_s - linear) * trust;
                reached = Some(answer.reached);
            }
        }
        self.correction = projection.acceleration - unconstrained;
        if let Some(damped) = damped {
            held += damped;
        }
        let mut wrench = held * self.settings.k_h;
        if let Some(mut textures) = self.textures.take() {
            let felt_at = projection.acceleration / self.settings.k_s;
            let touched = self.touched(set, &projection, reached.as_ref());
            let god_object = &self.present.god_object;
            wrench = textures.tilt(&wrench, god_object, &felt_at, moved, touched);
            self.textures = Some(textures);
        }
        let unlimited = linear(&wrench).norm();
        let (mut wrench, mut saturated) = self.limited(&wrench);
        if arrived {
            let along = self.present.moving.then(|| {
                let rows = projection.active.iter();
                let done = rows.filter_map(|row| {
                    let came = set.constraints.get(row.row as usize)?.came;
                    Some(row.multiplier * came)
                });
                let felt = if unlimited > 0.0 {
                    linear(&wrench).norm() / unlimited
                } else {
                    1.0
                };
                done.sum::<f64>() * self.settings.k_h * felt
            });
            self.obstacle_work.arrive(along);
        }
        if let Some(mut energy) = self.energy {
            energy.grant(self.obstacle_work.work());
            if moved {
                energy.arrive(&device);
            }
            let (bounded, clamped) = self.limited(&energy.within_reserve(&metric, &wrench));
            energy.hold(&device, &bounded);
            (wrench, saturated) = (bounded, saturated || clamped);
            self.energy = Some(energy);
        }
        CouplingOutput {
            wrench,
            shaded: self.present.shaded.then_some(ShadedAcceleration {
                sequence: set.sequence,
                acceleration: projection.acceleration,
            }),
            active: projection.active.len(),
            kkt: projection.kkt_residual,
            status: projection.status,
            saturated,
        }
    }

    /// Obstacle, its feature, point and normal of every contact that touches in the answer: whichever of them were found to hold the body. Where rounds
    /// of implicit constraints have `reached` a pose, the gaps are those there.
    fn touched<'a>(
        &'a self,
        set: &'a ConstraintSet,
        answer: &'a Projection,
        reached: Option<&'a Pose>,
    ) -> impl Iterator<Item = (u16, Feature, Point3<f64>, Vector3<f64>)> + 'a {
        let nothing_held = answer.active.is_empty();
        let center = Point3::from(self.present.god_object.translation.vector);
        let tolerance = TOUCHING_MOTION_TOLERANCES * self.settings.motion_tolerance;
        let rows = set.constraints.iter().zip(&self.bounds).enumerate();
        rows.filter(move |(row, (contact, bound))| {
            let slack = reached.map_or_else(
                || {
                    let row = self.basis.half_space(contact, &center);
                    row.jacobian.dot(&answer.acceleration) - **bound
                },
                |reached| {
                    let start = &self.present.god_object;
                    let moved = contact.moved(start, reached, self.present.shaded);
                    self.settings.k_s * (moved.gap - contact.gap) - **bound
                },
            );
            let holds = || answer.active.iter().any(|held| held.row as usize == *row);
            !nothing_held && (slack <= tolerance || holds())
        })
        .map(|(_, (contact, _))| {
            let features = &contact.features;
            let on_obstacle = features.on_obstacle;
            (
                features.obstacle,
                on_obstacle,
                contact.point,
                contact.normal,
            )
        })
    }

    /// Bounds the work of a step, whatever the constraint sets are: at most so many visits of rows, one for each row in each step of each projection. A
    /// projection that is not done by then gives no force, [`ProjectionStatus::IterationLimit`]. For sets from somebody else, in a loop with a deadline.
    pub fn limit_work(&mut self, most_row_visits: u32) {
        self.most_row_visits = Some(most_row_visits);
    }

    /// The energy at the device's port since the start; `None` unless passivity is enforced.
    pub fn energy(&self) -> Option<&EnergyObserver> {
        self.energy.as_ref()
    }

    /// Tells where an obstacle is, world from obstacle, as of the next [`Self::step`]'s constraint set: its texture goes with it. What a
    /// texture does not need is in the set. One that is never told is where the world has it.
    pub fn place_obstacle(&mut self, obstacle: usize, pose: &Pose) {
        if let Some(textures) = &mut self.textures {
            textures.place(obstacle, pose);
        }
    }

    /// Net work that moving obstacles have done on the hand since the start, J: what the force's rows did along the obstacles' ways.
    /// Negative where obstacles gave way under the hand.
    pub fn obstacle_work(&self) -> f64 {
        self.obstacle_work.work()
    }

    /// No force, and nothing to remember of the body that it held.
    ///
    /// `sample` is the device (pose of the reference point) where it is newer than the last step: what held the hand until then has done its work.
    fn without_force(&mut self, status: ProjectionStatus, sample: Option<&Pose>) -> CouplingOutput {
        self.anchor.forget();
        self.obstacle_work.arrive(None);
        if let Some(energy) = &mut self.energy {
            if let Some(device) = sample {
                energy.arrive(device);
            }
            energy.release();
        }
        CouplingOutput::without_force(status)
    }

    /// Takes a new set in: its rows, which its publisher has made ready or which are made ready here, and which of them are new.
    fn take(&mut self, set: &ConstraintSet) {
        let prepared = if set.prepared.serve(set, &self.basis) {
            debug_assert!(
                set.prepared.hold(set),
                "rows were changed after they were made ready"
            );
            &set.prepared
        } else {
            self.own.prepare(set, &self.basis);
            &self.own
        };
        self.projector.copy_from(&prepared.projector);
        self.targets.clone_from(&prepared.bounds);
        self.bounds.clone_from(&prepared.bounds);
        if let Some(visits) = self.most_row_visits {
            let rough = if self.friction.is_some() {
                Friction::MAX_PROJECTIONS
            } else {
                0
            };
            let projections = 1 + self.settings.implicit_rounds + rough;
            let rows = self.bounds.len().max(1) as u32; // a set's capacity
            let most = visits / rows.saturating_mul(projections);
            self.projector.limit_iterations(most);
            self.implicit.limit_iterations(most);
        }
        if self.friction.is_some() {
            let center = Point3::from(prepared.god_object.translation.vector);
            let rows = set.constraints.iter().take(self.bounds.len());
            self.rough_rows.clear();
            self.rough_rows
                .extend(rows.map(|row| self.basis.half_space(row, &center)));
        }

        // Rows are known by their features. Those that held the body last time are looked for where they are now, unless the publisher has
        // done it, for a device pose of a moment ago.
        self.known.replace(&prepared.names);
        if let Some(adaptation) = &mut self.adaptation {
            adaptation.observe(&self.known);
        }
        if prepared.likely.is_empty() {
            let known = &self.known;
            self.warm_start.retain_mut(|row| {
                let place = known.place_of(*row);
                *row = place.unwrap_or(*row);
                place.is_some()
            });
        } else {
            self.warm_start.clear();
            self.warm_start.extend(&prepared.likely);
        }
        self.present = PresentSet {
            of: Some((set.sequence, set.god_object_pose, set.constraints.len())),
            god_object: prepared.god_object,
            metric: prepared.metric,
            shaded: prepared.shaded,
            moving: prepared.moving,
        };
    }

    /// Rows of obstacles that move, where those will be by now.
    fn carry_rows(&mut self, time: f64, set: &ConstraintSet) {
        let arrival = self.arrival.share_of_an_update(time);
        for (row, constraint) in set.constraints.iter().take(self.bounds.len()).enumerate() {
            if constraint.came != 0.0 {
                let bound = self.basis.bound(constraint.gap)
                    + self.settings.k_s * constraint.came * arrival;
                self.targets[row] = bound;
                self.bounds[row] = bound;
                self.projector.set_bound(row, bound);
            }
        }
    }

    /// The frictionless answer with friction, where an obstacle has some.
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
        let k_s = self.settings.k_s;
        let god_object = &self.present.god_object;
        for (row, bound) in self.rough_rows.iter_mut().zip(&self.bounds) {
            row.bound = *bound;
        }
        let problem = FrictionProblem {
            metric,
            unconstrained,
            stuck_at: &self.anchor.acceleration(god_object, unconstrained, k_s),
            reference_point: &Point3::from(god_object.translation.vector),
            rows: &self.rough_rows,
            constraints: &set.constraints,
        };
        let held = friction.hold(
            &problem,
            |a_u, warm| self.projector.project_prepared(a_u, warm),
            frictionless,
        );
        self.anchor
            .follow(god_object, &held.acceleration, k_s, friction.slid());
        held
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
