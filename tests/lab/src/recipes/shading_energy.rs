//! R31: a ball goes round a cylinder of 32 shaded sides, ten times each way. What the hand gets out of a turn must not be positive.

use std::f64::consts::TAU;

use god_object::spatial::linear;
use god_object::{ForceShading, Pose, World};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use taut_method_tests::solids::{mesh, obstacle};
use taut_scene::shapes::{Axis, cylinder};

use super::Extent;
use super::bodies::{ball, force, ours_alone, sound};
use super::prism::Prism;
use crate::clock::Tick;
use crate::measure::{JND_MAGNITUDE, Measure};
use crate::method::{Method, Scene};
use crate::recipe::{Ideal, OURS, Probe, Recipe, open_for};

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
    let prism = Prism {
        sides: SIDES,
        radius: RADIUS,
        tip: TIP,
    };
    // The ball comes down on the middle of a side.
    let half_side = Vector3::y() * (0.5 * prism.side());
    let turned = Pose::from_parts(
        Translation3::identity(),
        UnitQuaternion::from_scaled_axis(half_side),
    );
    let mut round = obstacle(
        "cylinder",
        mesh(cylinder(RADIUS, 0.05, SIDES, Axis::Y)),
        turned,
    );
    round.surface.shading = shaded.then_some(ForceShading { crease_angle: 1.0 });
    let world = World {
        body: ball(TIP),
        obstacles: vec![round],
    };
    let turns = extent.choose(10, 1);
    let deep = RADIUS + TIP - DEPTH;
    let (begin, period) = (APPROACH + WAIT, TAU * deep / SPEED);
    let out = |angle: f64| Vector3::new(angle.sin(), 0.0, angle.cos());
    // Depth, angle, and the largest angle so far.
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
        (depth, angle, if gone < whole { angle } else { TAU * whole })
    };
    let device = move |time: f64| {
        let (depth, angle, _) = place(time);
        let at = out(angle) * (RADIUS + TIP - depth);
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
    // What gives no force gives no energy, and is no answer: its size is that of the depth, on the average of a side.
    let mean = move |ticks: &[Tick]| {
        let turning = ticks.iter().filter(|tick| tick.time >= begin);
        let sizes: Vec<f64> = turning.map(|tick| linear(&tick.wrench).norm()).collect();
        let mean = sizes.iter().sum::<f64>() / sizes.len() as f64;
        100.0 * (mean / (stiffness * DEPTH) - 1.0).abs()
    };
    let surface = if shaded { "shaded" } else { "plain" };
    let case = ("R31", format!("cylinder of {SIDES} sides, {surface}"));
    let about = "energy of a closed path: nothing to be got out of it";
    let duration = begin + 2.0 * f64::from(turns) * period;
    Recipe {
        // How a shaded normal turns is the shading's own choice: there is no right answer to compare with, but for the size of the force.
        ideal: if shaded {
            Ideal::None
        } else {
            Ideal::closed(move |time| {
                let (depth, angle, most) = place(time);
                let (deep, normal) = prism.depth(angle, most, RADIUS + TIP - depth);
                let push = out(normal) * (stiffness * deep);
                force(push.x, push.y, push.z)
            })
        },
        lines: Box::new(|_| sound()),
        probes: vec![
            Probe::at_most("work_of_a_turn", "J", ROUNDING, most),
            Probe::at_most("mean_force", "%", 100.0 * JND_MAGNITUDE, mean),
        ],
        open: if shaded {
            Vec::new()
        } else {
            let reason = "the force turns by 11 degrees at a corner, an update after the right answer does; there is a corner in 19 ms";
            let mut open = open_for(OURS, &[70, 300], Measure::JndP95.key(), reason);
            open.extend(open_for(OURS, &[70], Measure::JndShare.key(), reason));
            open
        },
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
