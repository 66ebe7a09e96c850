//! R10a: a cube of a millimetre is thrown at a plate of a tenth of one: up to 71 mm between updates.

use nalgebra::{Point3, Vector3};

use super::Extent;
use super::bodies::{Path, along, block, cube, cube_mesh, force, smooth, sound_and};
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};
use crate::vertex_depth::Convex;

const HALF: f64 = 0.5e-3;
const THICKNESS: f64 = 1e-4;
/// Farthest from the plate that the cube may come to rest, m.
const REST_ERROR: f64 = 1e-5;
/// How long the device waits below the plate, s; the cube has come to rest for the last share.
const WAIT: f64 = 0.5;
const AT_REST: f64 = 0.1;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    [0.5, 2.0, 5.0].map(|speed| recipe(extent, speed)).into()
}

fn recipe(extent: Extent, speed: f64) -> Recipe {
    let low = Point3::new(-0.1, -0.1, -THICKNESS);
    let high = Point3::new(0.1, 0.1, 0.0);
    let at = |z: f64| Vector3::new(1e-3, 2e-3, z);
    let path = Path::from(at(0.25)).to(at(-0.05), speed).hold(WAIT);
    let plate = block("plate", low, high);
    let scene = Scene::new(cube(HALF), [plate], 2.0 * HALF, speed, path.pose(0.0));
    let (stiffness, limit) = (scene.stiffness(), scene.settings.force_limit);
    let ideal = path.clone();
    let rest = path.duration() - AT_REST;
    let (plate, body) = (Convex::cuboid(low, high), cube_mesh(HALF));
    let case = ("R10a", format!("{speed} m/s"));
    let about = "fast impact: stops at first contact";
    Recipe {
        ideal: Ideal::closed(move |time| {
            let depth = (HALF - ideal.at(time).z).max(0.0);
            force(0.0, 0.0, (stiffness * depth).min(limit))
        }),
        depth: Box::new(move |pose| plate.deepest(&body, pose)),
        astray: Box::new(move |time, body| {
            let above = body.translation.z - HALF;
            if time < rest {
                (-above).max(0.0)
            } else {
                above.abs()
            }
        }),
        phases: extent.choose(20, 4),
        lines: sound_and(move |_| {
            [
                smooth(stiffness, speed),
                Measure::Astray.at_most(REST_ERROR),
            ]
        }),
        ..along(case, about, scene, path)
    }
}
