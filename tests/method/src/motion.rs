//! A scene's god-object led along a path under a virtual clock, with everything recorded: no process, no thread, no sleep.

use std::sync::Arc;

use god_object::{
    Coupling, GodObject, Pose, Settings, ShadedAcceleration, StepReport, Vector6, World,
};
use taut_scene::{BuiltScene, DeviceTrace, Scene};

/// One update of both loops.
#[derive(Clone, Debug)]
pub struct Sample {
    /// s.
    pub time: f64,
    /// Where the device was.
    pub device: Pose,
    /// Where the god-object went.
    pub god_object: Pose,
    /// On the hand, N and N m.
    pub wrench: Vector6,
    /// Smallest distance between the bodies, m.
    pub gap_min: f64,
    /// Rows in the active set of the force.
    pub active: usize,
    /// What the update did.
    pub report: StepReport,
}

/// A shipped scene, ready to run; its meshes must be there.
pub fn shipped(name: &str) -> BuiltScene {
    Scene::named_or_file(name)
        .and_then(|scene| scene.build())
        .unwrap_or_else(|error| panic!("{error}"))
}

/// The trace's samples as times and poses.
pub fn traced(trace: &DeviceTrace) -> impl Iterator<Item = (f64, Pose)> {
    trace
        .samples()
        .iter()
        .map(|sample| (sample.time, sample.pose))
}

/// Leads the god-object along `device`: for each pose one update, then one force, as the loops do when neither is late.
pub fn lead(
    scene: &BuiltScene,
    device: impl Iterator<Item = (f64, Pose)>,
) -> impl Iterator<Item = Sample> {
    let mut led = Led::new(scene);
    device.map(move |(time, pose)| led.step(time, &pose))
}

/// Both loops of a scene, when neither is late.
#[derive(Debug)]
pub struct Led {
    god_object: GodObject,
    coupling: Coupling,
    shaded: Option<ShadedAcceleration>,
}

impl Led {
    /// At the scene's start.
    pub fn new(scene: &BuiltScene) -> Self {
        Self::in_world(Arc::new(scene.world.clone()), &scene.settings, scene.start)
    }

    /// The body of this world, at this start, which must be free.
    pub fn in_world(world: Arc<World>, settings: &Settings, start: Pose) -> Self {
        Self {
            coupling: Coupling::new(&world, settings),
            god_object: GodObject::new(world, *settings, start)
                .unwrap_or_else(|error| panic!("{error}")),
            shaded: None,
        }
    }

    /// World from body.
    pub fn pose(&self) -> &Pose {
        self.god_object.pose()
    }

    /// One update, then one force.
    ///
    /// # Panics
    /// Something stopped the body that gives no force.
    pub fn step(&mut self, time: f64, device: &Pose) -> Sample {
        let report = self.god_object.step(device, self.shaded.as_ref());
        assert!(
            !report.stopped_without_row,
            "at {time} s what stops the body gives no force"
        );
        let set = self.god_object.constraint_set();
        let output = self.coupling.step(time, device, set);
        self.shaded = output.shaded;
        Sample {
            time,
            device: *device,
            god_object: set.god_object_pose,
            wrench: output.wrench,
            gap_min: set.gap_min,
            active: output.active,
            report,
        }
    }
}
