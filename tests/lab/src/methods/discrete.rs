//! A god-object with discrete collision detection: the poses between the start and the end of a step are not looked at.
//!
//! Projection and force are those of the god-object method; contacts have gaps. The motion differs: the body goes
//! where the projection leads if it is free there, else as far as bisection finds it free. A step that is longer
//! than body and obstacle are thick can lead through. Settings say how often this is repeated within an update, with the contacts of where the body
//! is then ([`Settings::max_substeps`]), and how far beyond the activation distance contacts are looked for at most
//! ([`Settings::look_ahead_limit`]): as far as body and device may go until the next update is there.

use std::sync::Arc;

use god_object::constraint::Contact;
use god_object::quasi_statics::{HalfSpace, Projector};
use god_object::spatial::{
    advance_pose, angular, at_reference_point, from_reference_point, pose_difference,
};
use god_object::{ConstraintSet, Coupling, Pose, Settings, SolverKind, Vector6, World};
use nalgebra::{Point3, Vector3};

use super::contacts::{
    ContactFinder, PERIODS_AHEAD, constraint_set, free_share, longest_way, project,
};
use crate::method::{HapticMethod, Scene};

#[derive(Debug)]
pub(crate) struct Discrete {
    world: Arc<World>,
    settings: Settings,
    /// Of the body about its reference point, m.
    radius: f64,
    pose: Pose,
    turn: Vector3<f64>,
    /// At the last update, of the reference point.
    last_device: Option<Pose>,
    finder: ContactFinder,
    contacts: Vec<Contact>,
    rows: Vec<HalfSpace>,
    projector: Projector,
    coupling: Coupling,
    set: ConstraintSet,
    published: ConstraintSet,
}

impl Discrete {
    /// At the scene's start, with these settings but for the adaptation of constraints.
    pub(crate) fn new(scene: &Scene, settings: &Settings) -> Self {
        let settings = Settings {
            adaptation: None,
            ..*settings
        };
        let capacity = settings.max_constraints;
        let body = &scene.world.body;
        let mut method = Self {
            world: scene.world.clone(),
            settings,
            radius: body.mesh.radius_about(&body.reference_point),
            pose: scene.start,
            turn: Vector3::zeros(),
            last_device: None,
            finder: ContactFinder::new(&settings),
            contacts: Vec::with_capacity(capacity),
            rows: Vec::with_capacity(capacity),
            projector: Projector::new(SolverKind::ActiveSet, capacity),
            coupling: Coupling::new(&scene.world, &settings),
            set: ConstraintSet::with_capacity(capacity),
            published: ConstraintSet::with_capacity(capacity),
        };
        method.collect(0, 0.0);
        method.publish(0.0);
        method
    }

    /// Contacts within the activation distance and so much more, m, up to the limit.
    fn collect(&mut self, sequence: u64, ahead: f64) {
        let (world, settings) = (&self.world, &self.settings);
        let distance = settings.activation_distance + ahead.min(settings.look_ahead_limit);
        let found = self.finder.find(world, &self.pose, distance);
        self.contacts.clear();
        self.contacts.extend_from_slice(found);
        self.set = constraint_set(sequence, &self.pose, found, settings.max_constraints);
    }

    /// Goes where the contacts lead a motion of the reference point, as far as it is free there. How far the body went, m.
    fn step(&mut self, wish: &Vector6) -> f64 {
        let body = &self.world.body;
        let Some(metric) = body.metric(self.settings.rotation_metric, &self.pose) else {
            return 0.0;
        };
        let start = at_reference_point(&self.pose, &body.reference_point);
        let centre = Point3::from(start.translation.vector);
        let rows = (&mut self.projector, &mut self.rows);
        let contacts = (self.contacts.as_slice(), &centre);
        let Some(step) = project(rows, &metric, wish, contacts, self.settings.rest_distance) else {
            return 0.0;
        };
        let at = |share: f64| {
            let pose = advance_pose(&start, &step, share);
            from_reference_point(&pose, &body.reference_point)
        };
        let length = longest_way(&step, self.radius);
        let free = free_share(&self.world, length, at);
        if free > 0.0 {
            self.pose = at(free);
        }
        free * length
    }
}

impl HapticMethod for Discrete {
    fn update(&mut self, _time: f64, device: &Pose) {
        let reference = self.world.body.reference_point;
        let start = at_reference_point(&self.pose, &reference);
        let device = at_reference_point(device, &reference);
        let last = self.last_device.replace(device).unwrap_or(device);
        let moved = pose_difference(&device, &last, &Vector3::zeros());
        let moved = longest_way(&moved, self.radius);
        let difference = pose_difference(&device, &start, &self.turn);
        self.turn = angular(&difference);
        let sequence = self.set.sequence + 1;
        let wish = difference * self.settings.k_s;
        let goal = advance_pose(&start, &wish, 1.0);
        let (mut left, mut went) = (wish, 0.0);
        for step in 0..self.settings.max_substeps {
            if step > 0 {
                let here = at_reference_point(&self.pose, &reference);
                left = pose_difference(&goal, &here, &angular(&left));
                self.collect(sequence, longest_way(&left, self.radius));
            }
            let way = self.step(&left);
            went += way;
            if way <= self.settings.motion_tolerance {
                break;
            }
        }
        // This update covers a share of what is free: the next ones go on.
        let share = self.settings.k_s;
        self.collect(
            sequence,
            PERIODS_AHEAD * moved + went * (1.0 - share) / share,
        );
    }

    fn publish(&mut self, _time: f64) {
        self.published.clone_from(&self.set);
    }

    fn force(&mut self, time: f64, device: &Pose) -> Vector6 {
        self.coupling.step(time, device, &self.published).wrench
    }

    fn pose(&self) -> Pose {
        self.published.god_object_pose
    }
}
