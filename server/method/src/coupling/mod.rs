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
//! The stages of a step, in their order: [`present`] what a new set changes, [`answer`] the projection with friction and rounds, [`felt`] textures, limits and energy.
//! Source: Ortega et al. 2007, Section 5; force shading Section 6.1.3; the bound beyond the paper.

mod answer;
mod arrival;
mod felt;
mod output;
mod present;

pub use output::CouplingOutput;

use crate::adaptation::AdaptationState;
use crate::constraint::ConstraintSet;
use crate::damping::ContactDamping;
use crate::implicit::ImplicitRounds;
use crate::known_rows::KnownRows;
use crate::obstacle_work::ObstacleWork;
use crate::prepared_rows::{PreparedRows, RowBasis};
use crate::quasi_statics::{ProjectionStatus, Projector};
use crate::settings::Settings;
use crate::spatial::{Pose, Vector6, at_reference_point, pose_is_finite};
use crate::surface::{EnergyObserver, Friction, ShadedAcceleration, StickAnchor, Textures};
use crate::turn_memory::TurnMemory;
use crate::world::World;
use arrival::Arrival;
use present::PresentSet;

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
            present: PresentSet::none(),
            projector: Projector::new(settings.solver, capacity),
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
                .map(|a| AdaptationState::new(a, settings.k_s, capacity)),
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
        let arrived = self.receive(time, set);
        if let Some(damping) = &mut self.damping {
            damping.observe(time, &device);
        }
        let difference = self.turn.difference(&device, &self.present.god_object);
        let unconstrained = difference * self.settings.k_s;
        let Some(metric) = self.present.metric else {
            return self.without_force(ProjectionStatus::NotFinite, new_sample);
        };
        self.adapt(time, &unconstrained, set);
        let answer = match self.constrained(&metric, &unconstrained, set) {
            Ok(answer) => answer,
            Err(status) => return self.without_force(status, new_sample),
        };
        self.correction = answer.projection.acceleration - unconstrained;
        let felt = self.felt(&answer, set, moved);
        if arrived {
            self.note_obstacle_work(&answer.projection, set, &felt);
        }
        let felt = self.within_energy(&metric, &device, felt, moved);
        CouplingOutput {
            wrench: felt.wrench,
            shaded: self.present.shaded.then_some(ShadedAcceleration {
                sequence: set.sequence,
                acceleration: answer.projection.acceleration,
            }),
            active: answer.projection.active.len(),
            kkt: answer.projection.kkt_residual,
            status: answer.projection.status,
            saturated: felt.saturated,
        }
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
}
