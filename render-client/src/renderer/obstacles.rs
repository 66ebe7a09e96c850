//! The obstacles that the god-object touches.

use nalgebra::Isometry3;
use taut_proto::Finish;

use super::god_object::workbench_from_mesh;
use super::mesh::{Instance, Material};
use crate::stage::{Stage, StageBody};

/// Satin.
const USUAL: Finish = Finish {
    roughness: 0.5,
    metallic: 0.0,
};

/// One obstacle at a pose of the scene frame.
pub(crate) fn instance(stage: &Stage, body: &StageBody, pose: &Isometry3<f64>) -> Instance {
    let material = Material::of(body, USUAL);
    Instance::new(&workbench_from_mesh(stage, body, pose), &material)
}
