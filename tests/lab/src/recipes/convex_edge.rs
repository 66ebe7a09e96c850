//! R08: a small ball is moved over a convex edge by a device inside the solid. The force turns where the ideal one does, and no later.

use god_object::spatial::linear;
use god_object::{ForceShading, Obstacle, Pose, Vector6};
use nalgebra::Vector3;
use taut_method_tests::solids::obstacle;

use super::Extent;
use super::bodies::{Path, along, ball, does_not_shade, drawn_out, force, ghost_time, sound_and};
use crate::clock::{TICK, Tick};
use crate::measure::{JND_MAGNITUDE, Measure, largest};
use crate::method::Scene;
use crate::recipe::{Ideal, Probe, Recipe};

const TIP: f64 = 1e-3;
const DEPTH: f64 = 3e-3;
const SPEED: f64 = 0.1;
/// Of the solid, m.
const LENGTH: f64 = 0.1;
/// Ticks that sampling may add at either end of a push.
const TICKS: f64 = 2.0;
/// Most that a shaded force may turn in a millisecond, degrees.
const TURN: f64 = 5.0;
/// Forces below this have no direction, N.
const FELT: f64 = 0.1;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let mut recipes: Vec<Recipe> = [10.0, 45.0, 90.0, 170.0]
        .iter()
        .map(|degrees| recipe(extent, *degrees, false))
        .collect();
    recipes.push(recipe(extent, 45.0, true));
    recipes
}

/// The edge is the y axis, at which the surface turns by `degrees`; the top is z = 0 for x < 0.
fn solid(degrees: f64, shaded: bool) -> Obstacle {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let mut outline = vec![
        [-LENGTH, 0.0],
        [0.0, 0.0],
        [LENGTH * cosine, -LENGTH * sine],
    ];
    if degrees <= 90.0 {
        outline.push([-LENGTH, -2.0 * LENGTH]);
    }
    let mut solid = obstacle("solid", drawn_out(&outline, 0.05), Pose::identity());
    solid.surface.shading = shaded.then_some(ForceShading { crease_angle: 1.0 });
    solid
}

/// The right answer for a device at a place.
fn ideal(degrees: f64, stiffness: f64, place: Vector3<f64>) -> Vector6 {
    if place.x < 0.0 {
        return force(0.0, 0.0, stiffness * (TIP - place.z).max(0.0));
    }
    // Past the edge only the slope holds it, or the edge itself, or nothing.
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let out = Vector3::new(sine, 0.0, cosine);
    let along = Vector3::new(cosine, 0.0, -sine);
    let push = if along.dot(&place) >= 0.0 {
        out * (TIP - out.dot(&place)).max(0.0)
    } else {
        let apart = place.norm();
        place * ((TIP - apart).max(0.0) / apart)
    } * stiffness;
    force(push.x, push.y, push.z)
}

/// By how much a force that is felt turns in a millisecond, at its most, degrees.
fn largest_turn(ticks: &[Tick]) -> f64 {
    let felt = |tick: &Tick| Some(linear(&tick.wrench)).filter(|f| f.norm() > FELT);
    let turns = ticks
        .windows(2)
        .filter_map(|pair| Some(felt(&pair[0])?.angle(&felt(&pair[1])?).to_degrees()));
    turns.fold(0.0, f64::max)
}

fn recipe(extent: Extent, degrees: f64, shaded: bool) -> Recipe {
    let at = |x: f64, z: f64| Vector3::new(x, 0.0, TIP + z);
    let path = Path::from(at(-0.03, 1e-3))
        .to(at(-0.03, -DEPTH), 0.05)
        .hold(0.1)
        .to(at(0.03, -DEPTH), SPEED)
        .hold(0.05);
    let scene = Scene::new(
        ball(TIP),
        [solid(degrees, shaded)],
        2.0 * TIP,
        SPEED,
        path.pose(0.0),
    );
    let (stiffness, k_s) = (scene.stiffness(), scene.settings.k_s);
    let led = path.clone();
    let surface = if shaded { ", shaded" } else { "" };
    let case = ("R08", format!("edge of {degrees} degrees{surface}"));
    let about = "convex edge: the force turns where the ideal one does";
    let right = stiffness * DEPTH;
    // The device is at its depth, and the ball has come to rest.
    let (from, to) = (0.08 + 0.05, 0.08 + 0.1);
    let before = move |ticks: &[Tick]| {
        let held = ticks.iter().filter(|t| (from..to).contains(&t.time));
        largest(held.map(|tick| 100.0 * (linear(&tick.wrench).norm() / right - 1.0).abs()))
    };
    let limit = if shaded { TURN } else { f64::INFINITY };
    Recipe {
        // How a shaded normal turns is the shading's own choice: there is no right answer to compare with, but for the force before the edge.
        ideal: if shaded {
            Ideal::None
        } else {
            Ideal::closed(move |time| ideal(degrees, stiffness, led.at(time)))
        },
        phases: extent.choose(20, 2),
        lines: sound_and(move |rate| {
            let late = ghost_time(k_s, rate) + TICKS * TICK;
            (!shaded).then_some(Measure::FalseForce.at_most(late))
        }),
        probes: vec![
            Probe::at_most("turn_of_force", "deg/ms", limit, largest_turn),
            Probe::at_most("force_before_edge", "%", 100.0 * JND_MAGNITUDE, before),
        ],
        out_of_scope: if shaded { does_not_shade } else { |_| None },
        ..along(case, about, scene, path)
    }
}
