//! R30: a box on a rough table, pulled to the side: it sticks up to the cone, slides above it, in every direction alike.

use god_object::Pose;
use nalgebra::Vector3;
use taut_method_tests::solids::{body, mesh};
use taut_scene::shapes::cuboid;

use super::Extent;
use super::bodies::{Path, force, ground, ours_alone, smooth, sound_and};
use crate::clock::{TICK, Tick};
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Probe, Recipe};

const HALF: [f64; 3] = [0.02, 0.02, 0.01];
/// tan 20 degrees.
const COEFFICIENT: f64 = 0.363_970_234_266_202_4;
const DEPTH: f64 = 5e-3;
const PRESSING: f64 = 0.05;
const PULLING: f64 = 0.01;
/// How far the device is pulled, m: twice what sticks.
const REACH: f64 = 4e-3;
/// m/s.
const CREEP: f64 = 1e-6;
/// %, of the force: isotropy and size of the cone.
const MAGNITUDE: f64 = 2.0;
/// Degrees.
const DIRECTION: f64 = 1.0;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let angles = extent.choose(&[0.0, 0.4, 0.785, 1.9][..], &[0.4][..]);
    angles.iter().map(|angle| recipe(*angle)).collect()
}

/// `angle`: of the pull, rad.
fn recipe(angle: f64) -> Recipe {
    let mut table = ground();
    table.surface.friction = COEFFICIENT;
    let at = |x: f64, z: f64| Vector3::new(x * angle.cos(), x * angle.sin(), HALF[2] + z);
    let path = Path::from(at(0.0, 1e-3))
        .to(at(0.0, -DEPTH), PRESSING)
        .hold(0.1);
    let pulled = path.duration();
    let path = path.to(at(REACH, -DEPTH), PULLING).hold(0.1);
    let held = body(mesh(cuboid(HALF)));
    let scene = Scene::new(held, [table], 2.0 * HALF[0], PRESSING, path.pose(0.0));
    let stiffness = scene.stiffness();
    let (ideal, device) = (path.clone(), path.clone());
    // The device is here when the cone is nearly full.
    let stuck_until = pulled + 0.95 * COEFFICIENT * DEPTH / PULLING;
    let creep = move |ticks: &[Tick]| {
        let stuck: Vec<_> = ticks
            .iter()
            .filter(|tick| (pulled..stuck_until).contains(&tick.time))
            .map(|tick| tick.body.translation.vector)
            .collect();
        let way = stuck
            .iter()
            .map(|p| (p - stuck[0]).norm())
            .fold(0.0, f64::max);
        way / (stuck_until - pulled)
    };
    let case = (
        "R30",
        format!("box on a rough table, pulled at {angle} rad"),
    );
    let about = "friction: sticks below the cone, slides on it";
    let duration = path.duration();
    Recipe {
        ideal: Ideal::closed(move |time| {
            let place = ideal.at(time);
            let load = stiffness * (HALF[2] - place.z).max(0.0);
            let pull = Vector3::new(place.x, place.y, 0.0);
            let size = (stiffness * pull.norm()).min(COEFFICIENT * load);
            let back = pull * (-size / pull.norm().max(f64::MIN_POSITIVE));
            force(back.x, back.y, load)
        }),
        depth: Box::new(|body: &Pose| (HALF[2] - body.translation.z).max(0.0)),
        lines: sound_and(move |_| {
            [
                smooth(stiffness, PRESSING),
                Measure::MagnitudeP95.at_most(MAGNITUDE),
                Measure::DirectionMax.at_most(DIRECTION),
            ]
        }),
        probes: vec![Probe::at_most("creep", "m/s", CREEP, creep)],
        out_of_scope: |method| ours_alone(method, "it is frictionless"),
        ..Recipe::new(case, about, scene, duration + TICK, move |time| {
            device.pose(time)
        })
    }
}
