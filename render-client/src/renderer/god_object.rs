//! The god-object: the body in the user's hand where the constraints let it be.

use nalgebra::{Isometry3, Matrix4};

use super::mesh::{Instance, Material};
use crate::stage::{Stage, StageBody};

/// The god-object at a pose of the scene frame.
pub(crate) fn instance(stage: &Stage, pose: &Isometry3<f64>) -> Instance {
    let [red, green, blue] = stage.god_object.colour;
    let material = Material {
        colour: [red, green, blue, 1.0],
        gloss: 0.5,
        sharpness: 36.0,
        own_light: 0.0,
    };
    Instance::new(
        &workbench_from_mesh(stage, &stage.god_object, pose),
        &material,
    )
}

/// The map from a body's mesh to the workbench.
pub(crate) fn workbench_from_mesh(
    stage: &Stage,
    body: &StageBody,
    pose: &Isometry3<f64>,
) -> Matrix4<f64> {
    let scaling = Matrix4::new_scaling(body.scale);
    stage.workbench_from_scene.to_homogeneous() * pose.to_homogeneous() * scaling
}
