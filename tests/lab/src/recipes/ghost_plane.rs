//! R13: a small ball slides off the end of a plate. Planes that are some updates old reach past the end and push on.

use nalgebra::{Point3, Vector3};

use super::Extent;
use super::bodies::{Path, along, ball, block, force, ghost_time, sound_and};
use crate::clock::TICK;
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, OURS, Recipe, STANDS_ASIDE, open_for};
use crate::vertex_depth::Convex;

const TIP: f64 = 1e-3;
const DEPTH: f64 = 5e-3;
const SPEED: f64 = 0.2;
/// Ticks that sampling may add at either end of a push.
const TICKS: f64 = 2.0;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let low = Point3::new(-0.2, -0.1, -0.02);
    let high = Point3::new(0.0, 0.1, 0.0);
    let at = |x: f64, z: f64| Vector3::new(x, 0.0, TIP + z);
    let path = Path::from(at(-0.05, 1e-3))
        .to(at(-0.05, -DEPTH), 0.05)
        .hold(0.1)
        .to(at(0.05, -DEPTH), SPEED)
        .hold(0.1);
    let plate = block("plate", low, high);
    let scene = Scene::new(ball(TIP), [plate], 2.0 * TIP, SPEED, path.pose(0.0));
    let (stiffness, k_s) = (scene.stiffness(), scene.settings.k_s);
    let ideal = path.clone();
    let plate = Convex::cuboid(low, high);
    let case = ("R13", "end of a plate".into());
    let about = "ghost plane: no force past the end";
    vec![Recipe {
        ideal: Ideal::closed(move |time| {
            // Past the end the ball falls to the side of the plate, which holds its centre one radius away.
            let place = ideal.at(time);
            if place.x < 0.0 {
                force(0.0, 0.0, stiffness * (TIP - place.z).max(0.0))
            } else {
                force(stiffness * (TIP - place.x).max(0.0), 0.0, 0.0)
            }
        }),
        depth: Box::new(move |body| {
            // Of the ball's centre in the plate grown by its radius, by the distance to the nearest point.
            let centre = Point3::from(body.translation.vector);
            let nearest = Point3::from(centre.coords.sup(&low.coords).inf(&high.coords));
            let apart = (centre - nearest).norm();
            if apart > 0.0 {
                (TIP - apart).max(0.0)
            } else {
                TIP + plate.depth(&centre)
            }
        }),
        phases: extent.choose(20, 4),
        lines: sound_and(move |rate| {
            let push = ghost_time(k_s, rate) + TICKS * TICK;
            [Measure::FalseForce.at_most(push)]
        }),
        open: open_for(OURS, &[300], &[Measure::JndShare], STANDS_ASIDE),
        ..along(case, about, scene, path)
    }]
}
