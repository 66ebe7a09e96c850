//! The state of loop 1 and one update as a whole: where to, sub-step by sub-step, and what is published at the end.

use std::sync::Arc;

use arrayvec::ArrayVec;
use nalgebra::Vector3;

use super::carry::Carry;
use super::generation::LEADING_MOTIONS;
use super::placed_obstacle::PlacedObstacle;
use super::substep::{StepMemory, Update};
use super::{StartError, StepReport};
use crate::collision::{CollisionWorkspace, Work};
use crate::constraint::{ConstraintSet, Contact, RowReduction};
use crate::implicit::ImplicitRounds;
use crate::quasi_statics::{HalfSpace, Projector};
use crate::settings::Settings;
use crate::spatial::{
    Pose, Vector6, advance_pose, angular, at_reference_point, linear, pose_difference,
    pose_is_finite,
};
use crate::surface::{Friction, ShadedAcceleration, ShadingNormals};
use crate::turn_memory::TurnMemory;
use crate::world::World;

/// Update periods from a device pose to the last use of the set that answers it: one until the set is there, and one until the next is. Where an update
/// takes less than a period, or the caller waits for it, that is more than is needed.
pub(super) const SET_PERIODS: f64 = 2.0;

/// Most that an update turns the body, rad. A turn is known by where it ends: after half of one, the rotation left to the device and whoever draws the body
/// would take it for one the other way.
const LARGEST_TURN: f64 = 1.5;

/// Loop 1 of the method.
#[derive(Debug)]
pub struct GodObject {
    pub(super) world: Arc<World>,
    pub(super) settings: Settings,
    pub(super) obstacles: Vec<PlacedObstacle>,
    pub(super) pose: Pose,
    pub(super) set: ConstraintSet,
    pub(super) shading: Vec<Option<ShadingNormals>>,
    pub(super) projector: Projector,
    pub(super) friction: Option<Friction>,
    pub(super) carry: Carry,
    pub(super) collision: CollisionWorkspace,
    pub(super) contacts: Vec<Contact>,
    pub(super) implicit: ImplicitRounds,
    pub(super) rows: Vec<HalfSpace>,
    pub(super) warm_start: Vec<u32>,
    pub(super) turn: TurnMemory,
    pub(super) radius: f64,
    pub(super) trust_length: f64,
    /// The last update's motion, and how much of its way the next one makes, where the hand rests.
    pub(super) rest_memory: StepMemory,
    pub(super) last_device: Option<Pose>,
    /// Motion of the device since the update before, m and rad.
    pub(super) device_step: Vector6,
    /// How far the set that is published would look ahead if it cost nothing, m.
    pub(super) wanted: f64,
    /// How much farther than its pose says the device may be, m: see [`GodObject::set_device_ahead`].
    pub(super) device_ahead: f64,
    /// The obstacle that has stopped a motion since the rows were last taken to the body's pose: the pair that did is a row.
    pub(super) stopped: Option<usize>,
    /// One has in this update: there may be more pairs that no row stands for.
    pub(super) was_stopped: bool,
    /// The obstacle that cut this update's last motion short.
    pub(super) last_stop: Option<usize>,
    /// Motions from here along which rows were searched for, for the force.
    pub(super) searched: ArrayVec<Vector6, LEADING_MOTIONS>,
    /// Pairs of pieces that the last motion's search for impact looked at.
    pub(super) impact_pairs: u64,
    /// Distance within which the present set has every row, m.
    pub(super) collected_within: f64,
    /// Finds rows as they are needed; `None` for the paper's cone.
    pub(super) reduction: Option<Box<RowReduction>>,
    /// Where each obstacle is.
    pub(super) places: Arc<[Pose]>,
    /// Pairs that the last collection of each obstacle looked at.
    pub(super) looked_at: Vec<u64>,
    /// No pair of each was nearer than this then, m.
    pub(super) nearest: Vec<f64>,
    /// The obstacles, the nearest first.
    pub(super) order: Vec<usize>,
}

impl GodObject {
    /// Checks the start, sizes every buffer and collects the first constraint set.
    pub fn new(world: Arc<World>, settings: Settings, start: Pose) -> Result<Self, StartError> {
        Self::check_start(&world, &settings, &start)?;
        let capacity = settings.max_constraints;
        let radius = world.body.mesh.radius_about(&world.body.reference_point);
        let obstacles = world.obstacles.len();
        let mut god_object = Self {
            friction: Friction::of(&world, &settings),
            carry: Carry::default(),
            shading: world.obstacles.iter().map(ShadingNormals::of).collect(),
            obstacles: world
                .obstacles
                .iter()
                .map(PlacedObstacle::at_rest)
                .collect(),
            reduction: Self::reduction_for(&world, &settings),
            places: world
                .obstacles
                .iter()
                .map(|obstacle| obstacle.pose)
                .collect(),
            looked_at: vec![0; obstacles],
            nearest: vec![f64::INFINITY; obstacles],
            order: (0..obstacles).collect(),
            world,
            settings,
            pose: start,
            // The nearest rows of some obstacles, and all of one more.
            set: ConstraintSet::with_capacity(2 * capacity),
            projector: Projector::new(settings.solver, capacity).with_reference_fallback(true),
            collision: CollisionWorkspace::for_obstacles(obstacles),
            contacts: Vec::with_capacity(capacity),
            // Within the rest distance the linear rows do, and their sub-steps come to rest where those of the rounds may circle.
            implicit: ImplicitRounds::new(
                &settings,
                radius,
                settings.rest_distance,
                Projector::new(settings.solver, capacity).with_reference_fallback(true),
                capacity,
            ),
            rows: Vec::with_capacity(capacity),
            warm_start: Vec::with_capacity(6),
            turn: TurnMemory::default(),
            radius,
            trust_length: f64::INFINITY,
            rest_memory: StepMemory::default(),
            last_device: None,
            device_step: Vector6::zeros(),
            wanted: settings.activation_distance,
            device_ahead: 0.0,
            stopped: None,
            was_stopped: false,
            last_stop: None,
            searched: ArrayVec::new(),
            impact_pairs: 0,
            collected_within: 0.0,
        };
        let work = &mut Work::default();
        god_object.collect(settings.activation_distance, work);
        god_object.choose(&Vector6::zeros(), settings.activation_distance, work);
        god_object
            .set
            .prepare(&god_object.world.body, &settings, None);
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

    /// Writes into the set when it is published, s, on the clock of the coupling's times. Whose obstacles move calls it after each update.
    pub fn note_published(&mut self, time: f64) {
        self.set.published = Some(time);
    }

    /// The settings in force.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// One update: moves the body the share k_s of the way to the device, as far as the obstacles let it, and collects the
    /// constraint set there.
    ///
    /// `shaded` is the first pass of force shading; it replaces a_u when it was computed on the present set. The bodies
    /// never intersect on the way, whatever the input; a pose that is not finite moves nothing. Obstacles that
    /// [`Self::move_obstacle`] sent somewhere go there first.
    pub fn step(&mut self, device_pose: &Pose, shaded: Option<&ShadedAcceleration>) -> StepReport {
        let mut report = StepReport::default();
        self.was_stopped = false;
        self.last_stop = None;
        if !pose_is_finite(device_pose) {
            report.rejected = true;
            self.describe_set(&mut report);
            return report;
        }

        // 1. and 2. The share of the way that this update is to cover, as a pose to arrive at.
        let start = self.pose_at_reference_point();
        let device = at_reference_point(device_pose, &self.world.body.reference_point);
        let difference = self.turn.difference(&device, &start);
        let wish = match shaded {
            Some(pass) if pass.sequence == self.set.sequence => pass.acceleration,
            _ => difference * self.settings.k_s,
        };
        let last = self.last_device.replace(device).unwrap_or(device);
        self.device_step = pose_difference(&device, &last, &Vector3::zeros());
        let device_moved = self.motion_length(&self.device_step);
        let device_next = SET_PERIODS * device_moved + self.device_ahead;

        // What moves by itself comes first: the body is out of its way before it follows the hand.
        let (obstacle_way, went_along) = self.carry_obstacles(&device, device_next, &mut report);
        self.begin_carry(&start);

        // Where the hand rests, an update that turns back on the last says that the last went too far: sub-steps make the whole way to their goal,
        // so the goal is what comes nearer.
        if device_moved + self.device_ahead + obstacle_way > self.settings.rest_distance {
            self.rest_memory = StepMemory::default();
        }
        let part = self.rest_memory.damping() * (LARGEST_TURN / angular(&wish).norm()).min(1.0);
        let unconstrained = wish * part;
        let goal = advance_pose(&start, &unconstrained, 1.0);

        let until_next =
            SET_PERIODS * self.way_beside_obstacles(&device, &last) + self.device_ahead;
        let mut update = Update {
            until_next,
            went_along,
            share: self.settings.k_s * part,
            look_ahead: until_next,
            made: 0.0,
            branch: angular(&unconstrained),
            step_memory: StepMemory::default(),
        };
        self.approach(&goal, &mut update, &mut report);
        let made = pose_difference(&self.pose_at_reference_point(), &start, &Vector3::zeros());
        if self.motion_length(&made) > self.settings.motion_tolerance {
            self.rest_memory.relax(&made, self.radius);
        }
        // Sets between sub-steps serve the next sub-step alone; the one that is published looks ahead.
        let published = self.published_distance(&update);
        if self.reduction.is_none() && self.collected_within < published {
            self.collect(published, &mut report.work);
        }
        let difference = self
            .turn
            .difference(&device, &self.pose_at_reference_point());
        self.publish(&difference, &update, &mut report);
        self.set
            .prepare(&self.world.body, &self.settings, Some(device_pose));
        self.describe_set(&mut report);
        report
    }

    /// Steps 3 to 5, repeated, until the body is at the goal or as near as obstacles let it: a budget that runs out is safe, the pose reached is valid.
    fn approach(&mut self, goal: &Pose, update: &mut Update, report: &mut StepReport) {
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
            let left = pose_difference(goal, &self.pose_at_reference_point(), &update.branch);
            update.branch = angular(&left);
            if !self.substep(&left, update, report) {
                report.unfinished = false;
                break;
            }
        }
    }

    pub(super) fn pose_at_reference_point(&self) -> Pose {
        at_reference_point(&self.pose, &self.world.body.reference_point)
    }

    /// Bound on the path of the body's fastest point, m.
    pub(super) fn motion_length(&self, displacement: &Vector6) -> f64 {
        linear(displacement).norm() + self.radius * angular(displacement).norm()
    }
}
