//! A god-object with discrete collision detection: the poses between the start and the end of a step are not looked at.
//!
//! Constraints, projection and force are those of the god-object method; contacts have gaps. Only the motion differs: the body goes
//! where the projection leads if it is free there, else as far as bisection finds it free. A step that is longer
//! than body and obstacle are thick can lead through.

use std::sync::Arc;

use god_object::quasi_statics::{HalfSpace, ProjectionStatus, Projector};
use god_object::spatial::{
    advance_pose, angular, at_reference_point, from_reference_point, pose_difference,
};
use god_object::{ConstraintSet, Coupling, Pose, Settings, SolverKind, Vector6, World};
use nalgebra::{Point3, Vector3};

use super::contacts::{ContactFinder, constraint_set, intersects, row};
use crate::method::{HapticMethod, Scene};

/// Bisections of a step that ends in an obstacle: a millimetre is cut down to a nanometre.
const BISECTIONS: u32 = 20;

/// The method's state.
#[derive(Debug)]
pub struct Discrete {
    world: Arc<World>,
    settings: Settings,
    pose: Pose,
    turn: Vector3<f64>,
    finder: ContactFinder,
    rows: Vec<HalfSpace>,
    projector: Projector,
    coupling: Coupling,
    set: ConstraintSet,
    published: ConstraintSet,
}

impl Discrete {
    /// At the scene's start.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let settings = Settings {
            adaptation: None,
            ..scene.settings
        };
        let capacity = settings.max_constraints;
        let mut method = Self {
            world: scene.world.clone(),
            settings,
            pose: scene.start,
            turn: Vector3::zeros(),
            finder: ContactFinder::new(&settings),
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
        let centre = Point3::from(
            at_reference_point(&self.pose, &world.body.reference_point)
                .translation
                .vector,
        );
        let contacts = self
            .finder
            .find(world, &self.pose, settings.activation_distance);
        self.rows.clear();
        self.rows.extend(
            contacts
                .iter()
                .map(|contact| row(contact, &centre, settings.rest_distance)),
        );
        self.set = constraint_set(sequence, &self.pose, contacts, settings.max_constraints);
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
        let answer = self.projector.project(&metric, &wish, &self.rows, &[]);
        if answer.status == ProjectionStatus::Solved {
            let at = |share: f64| {
                let pose = advance_pose(&start, &answer.acceleration, share);
                from_reference_point(&pose, &body.reference_point)
            };
            let mut free = 1.0;
            if intersects(&self.world, &at(1.0)) {
                let mut blocked = 1.0;
                free = 0.0;
                for _ in 0..BISECTIONS {
                    let middle = 0.5 * (free + blocked);
                    if intersects(&self.world, &at(middle)) {
                        blocked = middle;
                    } else {
                        free = middle;
                    }
                }
            }
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
