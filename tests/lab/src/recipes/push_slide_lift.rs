//! R02: a ball is pushed on a plane, slid along it and lifted while it slides. A force along the plane is artificial friction.

use nalgebra::Vector3;

use super::Extent;
use super::bodies::{Path, along, ball, force, ground, smooth, sound_and};
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};

const RADIUS: f64 = 0.01;
const DEPTH: f64 = 5e-3;
const SLIDE_SPEED: f64 = 0.1;
const LIFT_SPEED: f64 = 0.05;
/// Force along the plane over that across it.
const FRICTION: f64 = 1e-9;

pub(super) fn recipes(_extent: Extent) -> Vec<Recipe> {
    let height = |z: f64| Vector3::new(0.0, 0.0, RADIUS + z);
    let slid = Vector3::new(0.1, 0.0, 0.0);
    // Up at the speed of lifting while it still slides.
    let rise = 2.0 * DEPTH;
    let lifted = slid + Vector3::new(SLIDE_SPEED * rise / LIFT_SPEED, 0.0, rise);
    let path = Path::from(height(DEPTH))
        .to(height(-DEPTH), LIFT_SPEED)
        .hold(0.1)
        .to(height(-DEPTH) + slid, SLIDE_SPEED)
        .to(height(-DEPTH) + lifted, SLIDE_SPEED.hypot(LIFT_SPEED))
        .hold(0.1);
    let (size, speed) = (2.0 * RADIUS, SLIDE_SPEED.hypot(LIFT_SPEED));
    let scene = Scene::new(ball(RADIUS), [ground()], size, speed, path.pose(0.0));
    let stiffness = scene.stiffness();
    let ideal = path.clone();
    let case = ("R02", "ball on a plane".into());
    let about = "push, slide, lift: no artificial friction";
    vec![Recipe {
        ideal: Ideal::closed(move |time| {
            force(0.0, 0.0, stiffness * (RADIUS - ideal.at(time).z).max(0.0))
        }),
        depth: Box::new(|body| (RADIUS - body.translation.z).max(0.0)),
        lines: sound_and(move |_| {
            [
                smooth(stiffness, SLIDE_SPEED),
                Measure::Friction.at_most(FRICTION),
                Measure::FalseForce.at_most(0.0),
            ]
        }),
        ..along(case, about, scene, path)
    }]
}
