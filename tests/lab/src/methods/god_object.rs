//! The god-object method of this project, with whatever settings: its defaults, or as published.

use god_object::{ConstraintSet, Coupling, GodObject, Pose, Settings, ShadedAcceleration, Vector6};

use crate::method::{HapticMethod, Scene};

/// Simulation and coupling, and the constraint set between them.
#[derive(Debug)]
pub(crate) struct GodObjectMethod {
    simulation: GodObject,
    coupling: Coupling,
    published: ConstraintSet,
    shaded: Option<ShadedAcceleration>,
}

impl GodObjectMethod {
    /// At the scene's start, which has to be free.
    pub(crate) fn new(scene: &Scene, settings: &Settings) -> Self {
        let simulation = GodObject::new(scene.world.clone(), *settings, scene.start)
            .unwrap_or_else(|error| panic!("{error}"));
        Self {
            coupling: Coupling::new(&scene.world, settings),
            published: simulation.constraint_set().clone(),
            simulation,
            shaded: None,
        }
    }
}

impl HapticMethod for GodObjectMethod {
    fn update(&mut self, _time: f64, device: &Pose) {
        let _ = self.simulation.step(device, self.shaded.as_ref());
    }

    fn publish(&mut self, time: f64) {
        self.simulation.note_published(time);
        self.published.clone_from(self.simulation.constraint_set());
    }

    fn force(&mut self, time: f64, device: &Pose) -> Vector6 {
        let output = self.coupling.step(time, device, &self.published);
        self.shaded = output.shaded;
        output.wrench
    }

    fn move_obstacle(&mut self, pose: &Pose) {
        self.simulation.move_obstacle(0, pose);
    }

    fn pose(&self) -> Pose {
        self.published.god_object_pose
    }
}
