//! The contact points as red dots.

use nalgebra::Matrix4;
use taut_proto::Finish;

use super::mesh::{Instance, Material};
use crate::stage::Stage;
use crate::timeline::Contact;

/// Most dots drawn; a state on the wire names fewer.
pub(crate) const MAX_CONTACTS: usize = 64;

/// Radius of a dot over that of the god-object.
const DOT_SIZE: f64 = 0.055;

const MATERIAL: Material = Material {
    colour: [0.85, 0.03, 0.02, 1.0],
    finish: Finish {
        roughness: 0.4,
        metallic: 0.0,
    },
    own_light: 0.35,
    by_triangle: false,
};

/// A dot per contact; `radius` is that of the god-object in the workbench, in metres.
pub(crate) fn instances<'a>(
    stage: &'a Stage,
    contacts: &'a [Contact],
    radius: f64,
) -> impl Iterator<Item = Instance> + 'a {
    contacts.iter().take(MAX_CONTACTS).map(move |contact| {
        let place = stage.workbench_from_scene * contact.point;
        let dot = Matrix4::new_translation(&place.coords) * Matrix4::new_scaling(DOT_SIZE * radius);
        Instance::new(&dot, &MATERIAL)
    })
}
