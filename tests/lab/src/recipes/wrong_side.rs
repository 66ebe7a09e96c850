//! R28: a ball in a U with walls of a millimetre. The device goes through a wall, stays there, then walks round the open end.

use god_object::Pose;
use nalgebra::{Point3, Vector3};
use taut_method_tests::solids::{cells, mesh, obstacle};

use super::Extent;
use super::bodies::{Path, along, ball, force, ghost_time, sound_and};
use crate::clock::TICK;
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, OURS, Recipe, STANDS_ASIDE, open_for};

const RADIUS: f64 = 4e-3;
/// Inner and outer face of the walls, and their upper end, m.
const INNER: f64 = 0.020;
const OUTER: f64 = 0.021;
const RIM: f64 = 0.1;
const SPEED: f64 = 0.1;
/// Ticks that sampling may add at either end of a push.
const TICKS: f64 = 2.0;
/// How far beyond the wall's face the ball may be, m: as for penetration.
const ASTRAY: f64 = 1e-6;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let planes_x = [-OUTER, -INNER, INNER, OUTER];
    let u_shape = cells(
        [&planes_x, &[-0.05, 0.05], &[-0.001, 0.0, RIM]],
        |[i, _, k]| k == 0 || i != 1,
    );
    let at = |x: f64, z: f64| Vector3::new(x, 0.0, z);
    let path = Path::from(at(0.0, 0.03))
        .to(at(0.045, 0.03), SPEED)
        .hold(extent.choose(2.0, 0.2))
        .to(at(0.045, 0.13), SPEED)
        .hold(0.2);
    let u_shape = obstacle("u", mesh(u_shape), Pose::identity());
    let scene = Scene::new(ball(RADIUS), [u_shape], 2.0 * RADIUS, SPEED, path.pose(0.0));
    let (stiffness, limit) = (scene.stiffness(), scene.settings.force_limit);
    let k_s = scene.settings.k_s;
    let ideal = path.clone();
    let device = path.clone();
    let case = ("R28", "wall of a U".into());
    let about = "wrong side: the body stays on its side until the way is free";
    vec![Recipe {
        ideal: Ideal::closed(move |time| {
            // The ball slides up the wall and, once its centre is above the rim, round it.
            let place = ideal.at(time);
            let depth = (place.x - (INNER - RADIUS)).max(0.0);
            let held = if place.z <= RIM { depth } else { 0.0 };
            force(-(stiffness * held).min(limit), 0.0, 0.0)
        }),
        depth: Box::new(|body| {
            let centre = Point3::from(body.translation.vector);
            let wall = |low: f64, high: f64| {
                let nearest = Point3::new(
                    centre.x.clamp(low, high),
                    centre.y.clamp(-0.05, 0.05),
                    centre.z.clamp(-0.001, RIM),
                );
                (RADIUS - (centre - nearest).norm()).max(0.0)
            };
            let floor = (RADIUS - centre.z).max(0.0);
            let inside = centre.x.abs() < INNER && centre.z < RIM;
            let floor = if inside { floor } else { 0.0 };
            wall(INNER, OUTER).max(wall(-OUTER, -INNER)).max(floor)
        }),
        astray: Box::new(move |time, body| {
            let held = device.at(time).z <= RIM;
            let beyond = (body.translation.x - (INNER - RADIUS)).max(0.0);
            if held { beyond } else { 0.0 }
        }),
        phases: extent.choose(20, 4),
        lines: sound_and(move |rate| {
            // It points back all the time that the wall is between them, and no longer.
            let late = ghost_time(k_s, rate) + TICKS * TICK;
            [
                Measure::Astray.at_most(ASTRAY),
                Measure::FalseForce.at_most(late),
            ]
        }),
        open: open_for(OURS, &[300], &[Measure::JndShare], STANDS_ASIDE),
        ..along(case, about, scene, path)
    }]
}
