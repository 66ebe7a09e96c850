//! A scene's god-object led along a path under a virtual clock, with everything recorded: no process, no thread, no sleep.

use std::sync::Arc;

use god_object::{Coupling, GodObject, Pose, Vector6};
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
}

/// A shipped scene, ready to run; its meshes must be there.
#[must_use]
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
    let world = Arc::new(scene.world.clone());
    let mut coupling = Coupling::new(&world, &scene.settings);
    let mut god_object = GodObject::new(world, scene.settings, scene.start)
        .unwrap_or_else(|error| panic!("{error}"));
    let mut shaded = None;
    device.map(move |(time, pose)| {
        god_object.step(&pose, shaded.as_ref());
        let set = god_object.constraint_set();
        let output = coupling.step(time, &pose, set);
        shaded = output.shaded;
        Sample {
            time,
            device: pose,
            god_object: set.god_object_pose,
            wrench: output.wrench,
            gap_min: set.gap_min,
            active: output.active,
        }
    })
}
