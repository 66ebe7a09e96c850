//! The method of this project as a session runs it, with its work counted.

use god_object::collision::Work;
use god_object::{ConstraintSet, Coupling, GodObject, Pose, ShadedAcceleration, Vector6};

use crate::method::{HapticMethod, Scene};

/// Simulation, coupling, and what the updates did.
#[derive(Debug)]
pub(crate) struct Counted {
    simulation: GodObject,
    coupling: Coupling,
    published: ConstraintSet,
    shaded: Option<ShadedAcceleration>,
    moves: bool,
    /// Of all updates so far.
    pub(crate) work: Work,
}

impl Counted {
    /// At the scene's start, which has to be free, with the set of an update there: a session has run before
    /// its hand goes.
    pub(crate) fn new(scene: &Scene, device: &Pose) -> Self {
        let mut simulation = GodObject::new(scene.world.clone(), scene.settings, scene.start)
            .unwrap_or_else(|error| panic!("{error}"));
        let _ = simulation.step(device, None);
        Self {
            coupling: Coupling::new(&scene.world, &scene.settings),
            published: simulation.constraint_set().clone(),
            simulation,
            shaded: None,
            moves: false,
            work: Work::default(),
        }
    }
}

impl HapticMethod for Counted {
    fn update(&mut self, _time: f64, device: &Pose) {
        self.work += self.simulation.step(device, self.shaded.as_ref()).work;
    }

    fn publish(&mut self, _time: f64) {
        self.published.clone_from(self.simulation.constraint_set());
        if self.moves
            && let Some(pose) = self.simulation.obstacle_poses().next()
        {
            self.coupling.place_obstacle(0, pose);
        }
    }

    fn force(&mut self, time: f64, device: &Pose) -> Vector6 {
        let output = self.coupling.step(time, device, &self.published);
        self.shaded = output.shaded;
        output.wrench
    }

    fn pose(&self) -> Pose {
        self.published.god_object_pose
    }

    fn move_obstacle(&mut self, pose: &Pose) {
        self.moves = true;
        self.simulation.move_obstacle(0, pose);
    }
}
