//! The obstacles that the god-object touches.

use nalgebra::Isometry3;

use super::god_object::workbench_from_mesh;
use super::mesh::{Instance, Material};
use crate::stage::{Stage, StageBody};

/// One obstacle at a pose of the scene frame.
pub(crate) fn instance(stage: &Stage, body: &StageBody, pose: &Isometry3<f64>) -> Instance {
    let [red, green, blue] = body.colour;
    let material = Material {
        colour: [red, green, blue, 1.0],
        gloss: 0.16,
        sharpness: 28.0,
        own_light: 0.0,
    };
    Instance::new(&workbench_from_mesh(stage, body, pose), &material)
}
