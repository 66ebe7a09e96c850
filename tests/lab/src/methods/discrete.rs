//! A god-object with discrete collision detection: the poses between the start and the end of a step are not looked at.
//!
//! Projection and force are those of the god-object method; contacts have gaps. The motion differs: the body goes
//! where the projection leads if it is free there, else as far as bisection finds it free, once an update. A step that is longer
//! than body and obstacle are thick can lead through. Contacts are those within the activation distance: there is no look-ahead, so a faster device
//! meets them late.

use std::sync::Arc;

use god_object::constraint::Contact;
use god_object::quasi_statics::{HalfSpace, Projector};
use god_object::spatial::{
    advance_pose, angular, at_reference_point, from_reference_point, linear, pose_difference,
};
use god_object::{ConstraintSet, Coupling, Pose, Settings, SolverKind, Vector6, World};
use nalgebra::{Point3, Vector3};

use super::contacts::{ContactFinder, constraint_set, free_share, project};
use crate::method::{HapticMethod, Scene};

/// The method's state.
#[derive(Debug)]
pub struct Discrete {
    world: Arc<World>,
    settings: Settings,
    /// Of the body about its reference point, m.
    radius: f64,
    pose: Pose,
    turn: Vector3<f64>,
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
    pub fn new(scene: &Scene, settings: &Settings) -> Self {
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
            finder: ContactFinder::new(&settings),
            contacts: Vec::with_capacity(capacity),
            rows: Vec::with_capacity(capacity),
            projector: Projector::new(SolverKind::ActiveSet, capacity),
            coupling: Coupling::new(&scene.world, &settings),
            set: ConstraintSet::with_capacity(capacity),
            published: ConstraintSet::with_capacity(capacity),
        };
        method.collect(0);
        method.publish(0.0);
        method
    }

    fn collect(&mut self, sequence: u64) {
        let (world, settings) = (&self.world, &self.settings);
        let found = (self.finder).find(world, &self.pose, settings.activation_distance);
        self.contacts.clear();
        self.contacts.extend_from_slice(found);
        self.set = constraint_set(sequence, &self.pose, found, settings.max_constraints);
    }
}

impl HapticMethod for Discrete {
    fn update(&mut self, _time: f64, device: &Pose) {
        let body = &self.world.body;
        let start = at_reference_point(&self.pose, &body.reference_point);
        let device = at_reference_point(device, &body.reference_point);
        let difference = pose_difference(&device, &start, &self.turn);
        self.turn = angular(&difference);
        let Some(metric) = body.metric(self.settings.rotation_metric, &self.pose) else {
            return;
        };
        let wish = difference * self.settings.k_s;
        let centre = Point3::from(start.translation.vector);
        let rows = (&mut self.projector, &mut self.rows);
        let contacts = (self.contacts.as_slice(), &centre);
        let step = project(rows, &metric, &wish, contacts, self.settings.rest_distance);
        if let Some(step) = step {
            let at = |share: f64| {
                let pose = advance_pose(&start, &step, share);
                from_reference_point(&pose, &body.reference_point)
            };
            let length = linear(&step).norm() + self.radius * angular(&step).norm();
            let free = free_share(&self.world, length, at);
            if free > 0.0 {
                self.pose = at(free);
            }
        }
        self.collect(self.set.sequence + 1);
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
