//! R01: a cube far from everything, moved and turned in all directions at once. Any force is one at a distance.

use std::f64::consts::TAU;

use god_object::spatial::{Pose, angular, linear};
use nalgebra::{Point3, Vector3};

use super::Extent;
use super::bodies::{block, cube, force, largest_from, sound};
use crate::clock::TICK;
use crate::method::Scene;
use crate::recipe::{Ideal, Probe, Recipe};

const HALF: f64 = 0.01;
const REACH: f64 = 0.1;
/// Hz, along x, y and z.
const FREQUENCIES: [f64; 3] = [2.0, 3.0, 1.0];
/// Largest rotation, rad.
const TURN: f64 = 1.0;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let low = Point3::new(-0.3, -0.3, -1.1);
    let obstacles = [block("far ground", low, Point3::new(0.3, 0.3, -1.0))];
    let device = |time: f64| {
        let [x, y, z] = FREQUENCIES.map(|f| REACH * (TAU * f * time).sin());
        let axis = Vector3::new(1.0, 2.0, 3.0) / 14.0_f64.sqrt();
        let turn = axis * (TURN * (TAU * time).sin());
        Pose::new(Vector3::new(x, y, z), turn)
    };
    let speed = REACH * TAU * Vector3::from(FREQUENCIES).norm();
    let scene = Scene::new(cube(HALF), obstacles, 2.0 * HALF, speed, device(0.0));
    let case = ("R01", "Lissajous figure".to_owned());
    let about = "free space: no force and no torque";
    let k_s = scene.settings.k_s;
    // The body goes with the device: behind it by 1/k_s updates, one that is made and one that is used.
    let lag = Probe {
        key: "lag",
        unit: "m",
        value: Box::new(largest_from(0.0, |tick| {
            (tick.device.translation.vector - tick.body.translation.vector).norm()
        })),
        limit: Box::new(move |rate| speed * ((1.0 / k_s + 2.0) / f64::from(rate) + TICK)),
    };
    let duration = extent.choose(4.0, 1.0);
    vec![Recipe {
        ideal: Ideal::closed(|_| force(0.0, 0.0, 0.0)),
        lines: Box::new(|_| sound()),
        probes: vec![
            lag,
            Probe::at_most(
                "force_at_a_distance",
                "N",
                0.0,
                largest_from(0.0, |tick| linear(&tick.wrench).norm()),
            ),
            Probe::at_most(
                "torque_at_a_distance",
                "N m",
                0.0,
                largest_from(0.0, |tick| angular(&tick.wrench).norm()),
            ),
        ],
        ..Recipe::new(case, about, scene, duration, device)
    }]
}
