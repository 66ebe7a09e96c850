//! R26: a nut turned on a bolt of M10 x 1.5 with 0.2 mm of radial clearance, the hand half a millimetre behind: the flanks carry it along.

use std::f64::consts::TAU;

use god_object::Pose;
use god_object::spatial::angular;
use nalgebra::Vector3;
use taut_method_tests::machined::Thread;
use taut_method_tests::solids::{body, mesh, obstacle};

use super::Extent;
use super::bodies::{force, largest_from, sound_and, turns};
use crate::clock::TICK;
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Probe, Recipe};

const CLEARANCE: f64 = 0.2e-3;
/// Turns a second.
const RATE: f64 = 0.5;
const BEHIND: f64 = 0.5e-3;
/// Until the flanks have met and the body has come to rest on them, s.
const SETTLING: f64 = 0.15;
/// N m.
const AXIAL_TORQUE: f64 = 1e-3;
/// N, of 0.4.
const FORCE_ERROR: f64 = 0.05;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    // Half of the facets is a nut of some thousand triangles, whose flanks are still within 15 um of the screw's.
    let facets = extent.choose(64, 32);
    let thread = Thread {
        major_radius: 5e-3,
        pitch: 1.5e-3,
        facets,
    };
    let obstacles = [obstacle("bolt", mesh(thread.bolt(7)), Pose::identity())];
    let pitch = thread.pitch;
    // The hand comes down to its place behind the flank, then turns.
    let coming = 0.05;
    let advance = move |time: f64| pitch * RATE * (time - coming).max(0.0);
    let device = move |time: f64| {
        let behind = BEHIND * (time / coming).min(1.0);
        Pose::new(
            Vector3::new(0.0, 0.0, pitch + advance(time) - behind),
            Vector3::z() * (TAU * RATE * (time - coming).max(0.0)),
        )
    };
    let nut = body(mesh(thread.nut(2, CLEARANCE, 8e-3)));
    let scene = Scene::new(nut, obstacles, 0.016, TAU * RATE * 5e-3, device(0.0));
    let stiffness = scene.stiffness();
    let play = CLEARANCE / Thread::SLOPE;
    let case = ("R26", format!("M10 nut, {facets} facets a turn"));
    let about = "nut on bolt: advances with the thread, no torque about the axis";
    vec![Recipe {
        ideal: Ideal::closed(move |time| {
            let behind = BEHIND * (time / coming).min(1.0);
            force(0.0, 0.0, stiffness * (behind - play).max(0.0))
        }),
        lines: sound_and(|_| [Measure::ForceP95.at_most(FORCE_ERROR)]),
        probes: vec![
            Probe {
                key: "off_the_thread",
                unit: "m",
                value: Box::new(largest_from(SETTLING, move |tick| {
                    (tick.body.translation.z - pitch - advance(tick.time)).abs()
                })),
                // The body is as old as an update is: it comes later by what the thread carries it in that time.
                limit: Box::new(move |rate| {
                    1.1 * play + pitch * RATE * (4.0 / f64::from(rate) + TICK)
                }),
            },
            Probe::at_most(
                "torque_about_axis",
                "N m",
                AXIAL_TORQUE,
                largest_from(SETTLING, |tick| angular(&tick.wrench).z.abs()),
            ),
        ],
        check_every: 20,
        out_of_scope: turns,
        ..Recipe::new(case, about, scene, extent.choose(6.0, 0.3), device)
    }]
}
