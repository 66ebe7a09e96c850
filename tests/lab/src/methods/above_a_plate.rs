//! What the methods' tests share: a body of 10 mm above a plate whose face is z = 0.

use god_object::{Body, Pose};

use crate::method::Scene;
use crate::recipes::block;

/// With its lowest point at a height, m.
pub(super) fn scene(body: Body, height: f64) -> Scene {
    let plate = block("plate", [-0.1, -0.1, -0.05].into(), [0.1, 0.1, 0.0].into());
    Scene::new(body, [plate], 0.01, 0.1, at(height))
}

pub(super) fn at(height: f64) -> Pose {
    Pose::translation(0.0, 0.0, 0.005 + height)
}
