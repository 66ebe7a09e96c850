//! R11: a ball is moved into a plane at constant speed and out again. A force that begins late begins as a step.

use nalgebra::Vector3;

use super::Extent;
use super::bodies::{Path, along, ball, force, ground, sound_and};
use crate::clock::TICK;
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};

const RADIUS: f64 = 5e-3;
/// Where the device begins, turns and ends, m above the plane.
const FROM: f64 = 0.05;
const TURN: f64 = -0.015;
const END: f64 = 0.005;
/// Rounding of a difference of forces, as a share of it.
const ROUNDING: f64 = 1e-6;
/// Force along the plane over that across it.
const FRICTION: f64 = 1e-9;

pub(super) fn recipes(_extent: Extent) -> Vec<Recipe> {
    [0.05, 0.3, 1.0].map(recipe).into()
}

fn recipe(speed: f64) -> Recipe {
    let height = |z: f64| Vector3::new(0.0, 0.0, RADIUS + z);
    let path = Path::from(height(FROM))
        .to(height(TURN), speed)
        .to(height(END), speed)
        .hold(0.05);
    let scene = Scene::new(
        ball(RADIUS),
        [ground()],
        2.0 * RADIUS,
        speed,
        path.pose(0.0),
    );
    let stiffness = scene.stiffness();
    let ideal = path.clone();
    let case = ("R11", format!("{speed} m/s"));
    let about = "late contact: force begins where the hand crosses the surface";
    Recipe {
        ideal: Ideal::closed(move |time| {
            force(0.0, 0.0, stiffness * (RADIUS - ideal.at(time).z).max(0.0))
        }),
        depth: Box::new(|body| (RADIUS - body.translation.z).max(0.0)),
        phases: 20,
        lines: sound_and(move |_| {
            let step = stiffness * speed * TICK * (1.0 + ROUNDING);
            [
                Measure::Step.at_most(step),
                Measure::FirstForceDepth.at_most(speed * TICK),
                Measure::Friction.at_most(FRICTION),
            ]
        }),
        ..along(case, about, scene, path)
    }
}
