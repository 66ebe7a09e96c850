//! R31: a ball goes round a cylinder of 32 shaded sides, ten times each way. What the hand gets out of a turn must not be positive.

use std::f64::consts::TAU;

use god_object::spatial::linear;
use god_object::{ForceShading, Pose, World};
use nalgebra::Vector3;
use taut_method_tests::solids::{mesh, obstacle};
use taut_scene::shapes::{Axis, cylinder};

use super::Extent;
use super::bodies::{ball, force, ours_alone, sound};
use crate::clock::Tick;
use crate::method::{Method, Scene};
use crate::recipe::{Ideal, Probe, Recipe};

const RADIUS: f64 = 0.02;
const TIP: f64 = 2e-3;
const DEPTH: f64 = 3e-3;
const SIDES: usize = 32;
/// m/s.
const SPEED: f64 = 0.2;
/// Way in, s, and time to come to rest before the first turn, s.
const APPROACH: f64 = 0.1;
const WAIT: f64 = 0.2;
/// Rounding of a sum of a thousand terms of a millijoule, J.
const ROUNDING: f64 = 1e-12;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    vec![recipe(extent, false), recipe(extent, true)]
}

fn recipe(extent: Extent, shaded: bool) -> Recipe {
    let mut round = obstacle(
        "cylinder",
        mesh(cylinder(RADIUS, 0.05, SIDES, Axis::Y)),
        Pose::identity(),
    );
    round.surface.shading = shaded.then_some(ForceShading { crease_angle: 1.0 });
    let world = World {
        body: ball(TIP),
        obstacles: vec![round],
    };
    let turns = extent.choose(10, 1);
    let deep = RADIUS + TIP - DEPTH;
    let (begin, period) = (APPROACH + WAIT, TAU * deep / SPEED);
    let place = move |time: f64| {
        let depth = -1e-3 + (DEPTH + 1e-3) * (time / APPROACH).min(1.0);
        let gone = ((time - begin) / period).max(0.0);
        let whole = f64::from(turns);
        // There, and back again.
        let angle = TAU
            * if gone < whole {
                gone
            } else {
                2.0 * whole - gone
            };
        (depth, Vector3::new(angle.sin(), 0.0, angle.cos()))
    };
    let device = move |time: f64| {
        let (depth, out) = place(time);
        let at = out * (RADIUS + TIP - depth);
        Pose::translation(at.x, at.y, at.z)
    };
    let scene = Scene::new(world, 2.0 * TIP, SPEED, device(0.0));
    let stiffness = scene.stiffness();
    let most = move |ticks: &[Tick]| {
        let mut of_turn = vec![0.0; 2 * turns as usize];
        for pair in ticks.windows(2) {
            let turn = (pair[0].time - begin) / period;
            if let Some(work) = (turn >= 0.0)
                .then(|| of_turn.get_mut(turn as usize))
                .flatten()
            {
                let way = pair[1].device.translation.vector - pair[0].device.translation.vector;
                *work += linear(&pair[0].wrench).dot(&way);
            }
        }
        of_turn.into_iter().fold(f64::NEG_INFINITY, f64::max)
    };
    let surface = if shaded { "shaded" } else { "plain" };
    let case = ("R31", format!("cylinder of {SIDES} sides, {surface}"));
    let about = "energy of a closed path: nothing to be got out of it";
    let duration = begin + 2.0 * f64::from(turns) * period;
    Recipe {
        ideal: Ideal::closed(move |time| {
            let (depth, out) = place(time);
            let push = out * (stiffness * depth.max(0.0));
            force(push.x, push.y, push.z)
        }),
        lines: Box::new(|_| sound()),
        probes: vec![Probe::at_most("work_of_a_turn", "J", ROUNDING, most)],
        out_of_scope: if shaded {
            |method| match method {
                Method::Paper | Method::PaperAdapted => None,
                _ => ours_alone(method, "it has no force shading"),
            }
        } else {
            |_| None
        },
        check_every: 10,
        ..Recipe::new(case, about, scene, duration, device)
    }
}
