//! R09: a small cube is pushed at a thin plate by a device that goes through it, stays below, slides there and comes back.

use nalgebra::{Point3, Vector3};

use super::Extent;
use super::bodies::{Path, along, block, cube, cube_mesh, force, smooth, sound_and};
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};
use crate::vertex_depth::Convex;

const HALF: f64 = 0.5e-3;
const SPEED: f64 = 0.1;
const REACH: f64 = 0.05;
/// How far below the plate's upper face the cube's lowest corner may be, m: as for penetration.
const ASTRAY: f64 = 1e-6;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    [1e-3, 1e-4]
        .map(|thickness| recipe(extent, thickness))
        .into()
}

fn recipe(extent: Extent, thickness: f64) -> Recipe {
    let low = Point3::new(-0.1, -0.1, -thickness);
    let high = Point3::new(0.1, 0.1, 0.0);
    let at = |x: f64, z: f64| Vector3::new(x, 0.0, z);
    let path = Path::from(at(0.0, REACH))
        .to(at(0.0, -REACH), SPEED)
        .hold(extent.choose(2.0, 0.1))
        .to(at(REACH, -REACH), SPEED)
        .to(at(-REACH, -REACH), SPEED)
        .to(at(-REACH, REACH), SPEED);
    let plate = block("plate", low, high);
    let scene = Scene::new(cube(HALF), [plate], 2.0 * HALF, SPEED, path.pose(0.0));
    let (stiffness, limit) = (scene.stiffness(), scene.settings.force_limit);
    let ideal = path.clone();
    let (plate, body) = (Convex::cuboid(low, high), cube_mesh(HALF));
    let case = ("R09", format!("plate of {} mm", thickness * 1e3));
    let about = "thin plate: no pop-through";
    Recipe {
        ideal: Ideal::closed(move |time| {
            let depth = (HALF - ideal.at(time).z).max(0.0);
            force(0.0, 0.0, (stiffness * depth).min(limit))
        }),
        depth: Box::new(move |pose| plate.deepest(&body, pose)),
        astray: Box::new(|_, body| (HALF - body.translation.z).max(0.0)),
        phases: extent.choose(20, 4),
        lines: sound_and(move |_| {
            [
                smooth(stiffness, SPEED),
                Measure::Astray.at_most(ASTRAY),
                Measure::FalseForce.at_most(0.0),
            ]
        }),
        ..along(case, about, scene, path)
    }
}
