//! The device ghost: the god-object's body where the device is, translucent. The gap between the
//! two is what the coupling turns into force.

use nalgebra::Isometry3;
use taut_proto::Finish;

use super::god_object::workbench_from_mesh;
use super::mesh::{Instance, Material};
use crate::stage::Stage;

const MATERIAL: Material = Material {
    colour: [0.02, 0.50, 0.64, 0.16],
    finish: Finish {
        roughness: 1.0,
        metallic: 0.0,
    },
    own_light: 0.0,
    by_triangle: false,
};

/// The ghost at the device's pose, scene frame.
pub(crate) fn instance(stage: &Stage, device_pose: &Isometry3<f64>) -> Instance {
    Instance::new(
        &workbench_from_mesh(stage, &stage.god_object, device_pose),
        &MATERIAL,
    )
}
