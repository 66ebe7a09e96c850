//! R37: a plate rises into a still hand. It must push the body and never pass through it.

use god_object::Pose;
use nalgebra::Point3;

use super::Extent;
use super::bodies::{block, cube, force, ours_alone, smooth, sound};
use crate::clock::Tick;
use crate::measure::{Measure, largest};
use crate::method::Scene;
use crate::recipe::{Ideal, Probe, Recipe};

const HALF: f64 = 0.01;
/// m/s.
const SPEED: f64 = 0.1;
/// How far the plate rises, m, and where the hand is.
const RISE: f64 = 0.04;
const HAND: f64 = 0.03;
/// How long the plate then stands, s; the body has come to rest for the last share.
const WAIT: f64 = 0.3;
const AT_REST: f64 = 0.1;
/// m.
const PASSED: f64 = 1e-6;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    [5e-3, 1e-4]
        .map(|thickness| recipe(extent, thickness))
        .into()
}

fn recipe(extent: Extent, thickness: f64) -> Recipe {
    let low = Point3::new(-0.1, -0.1, -thickness);
    let still = Pose::translation(0.0, 0.0, HAND);
    let plate = block("plate", low, Point3::new(0.1, 0.1, 0.0));
    let scene = Scene::new(cube(HALF), [plate], 2.0 * HALF, SPEED, still);
    let stiffness = scene.stiffness();
    let top = |time: f64| (SPEED * time).min(RISE);
    let end = RISE / SPEED + WAIT;
    let case = ("R37", format!("rising plate of {} mm", thickness * 1e3));
    let about = "moving obstacle: pushes the body, never passes it";
    let passed = move |ticks: &[Tick]| {
        let late = ticks.iter().filter(|tick| tick.time > end - AT_REST);
        largest(late.map(|tick| (RISE + HALF - tick.body.translation.z).max(0.0)))
    };
    Recipe {
        ideal: Ideal::closed(move |time| {
            force(0.0, 0.0, stiffness * (top(time) + HALF - HAND).max(0.0))
        }),
        phases: extent.choose(20, 2),
        lines: Box::new(move |_| {
            // Intersections are not looked for where obstacles move: the probe does it.
            let mut lines = sound();
            lines.retain(|line| line.measure != Measure::Intersections);
            lines.push(smooth(stiffness, SPEED));
            lines
        }),
        probes: vec![Probe::at_most("passed", "m", PASSED, passed)],
        out_of_scope: |method| ours_alone(method, "its obstacles stand still"),
        moving: Some(Box::new(move |time| {
            Pose::translation(0.0, 0.0, top(time) - 0.5 * thickness)
        })),
        ..Recipe::new(case, about, scene, end, move |_| still)
    }
}
