//! The god-object: the body in the user's hand where the constraints let it be.

use nalgebra::{Isometry3, Matrix4};
use taut_proto::Finish;

use super::mesh::{Instance, Material};
use crate::stage::{Stage, StageBody};

/// Glossier than what stands.
const USUAL: Finish = Finish {
    roughness: 0.3,
    metallic: 0.0,
};

/// The god-object at a pose of the scene frame.
pub(crate) fn instance(stage: &Stage, pose: &Isometry3<f64>) -> Instance {
    let material = Material::of(&stage.god_object, USUAL);
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
    let in_body = Matrix4::new_translation(&body.origin.coords) * Matrix4::new_scaling(body.scale);
    (stage.workbench_from_scene * pose).to_homogeneous() * in_body
}
