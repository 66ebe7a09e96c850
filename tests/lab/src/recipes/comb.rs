//! R25: combs of eleven teeth in each other, and a gear in another: many contacts at once, then stiff.

use god_object::Pose;
use god_object::spatial::{angular, linear, six};
use nalgebra::Vector3;
use taut_method_tests::machined::{COMB_DEPTH, combs, gears};
use taut_method_tests::solids::{body, mesh, obstacle};

use super::Extent;
use super::bodies::{Path, along, force, largest_from, smooth, sound_and, turns};
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Probe, Recipe};

const CLEARANCES: [f64; 2] = [0.2e-3, 0.05e-3];
const SPEED: f64 = 0.05;
/// How far the device is pushed to either side, m.
const OFFSET: f64 = 1e-3;
/// Length of the held comb, m.
const SIZE: f64 = 0.044;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let clearances = extent.choose(&CLEARANCES[..], &CLEARANCES[1..]);
    let mut recipes: Vec<Recipe> = clearances.iter().map(|c| comb(extent, *c)).collect();
    recipes.push(gear(extent));
    recipes
}

fn comb(extent: Extent, clearance: f64) -> Recipe {
    let (held, comb) = combs(clearance);
    let at = |x: f64, z: f64| Vector3::new(x, 0.0, z);
    let inserted = COMB_DEPTH + 2e-3; // 8 mm of the teeth overlap
    let path = Path::from(at(0.0, 2.0 * COMB_DEPTH + 1e-3))
        .to(at(0.0, inserted), SPEED)
        .to(at(OFFSET, inserted), SPEED)
        .hold(0.1)
        .to(at(-OFFSET, inserted), SPEED)
        .hold(0.1)
        .to(at(0.0, inserted), SPEED);
    let scene = Scene::new(held, [comb], SIZE, SPEED, path.pose(0.0));
    let (stiffness, rest) = (scene.stiffness(), scene.settings.rest_distance);
    let ideal = path.clone();
    let case = ("R25", format!("combs, clearance {} mm", clearance * 1e3));
    let about = "many contacts: locks after its clearance, whatever their number";
    Recipe {
        ideal: Ideal::closed(move |time| {
            let x = ideal.at(time).x;
            force(
                -x.signum() * stiffness * (x.abs() - clearance).max(0.0),
                0.0,
                0.0,
            )
        }),
        phases: extent.choose(5, 1),
        lines: sound_and(move |_| {
            [
                smooth(stiffness, SPEED),
                Measure::ForceP95.at_most(3.0 * stiffness * rest),
            ]
        }),
        probes: vec![Probe::at_most(
            "torque",
            "N m",
            0.01 * stiffness * OFFSET * COMB_DEPTH,
            largest_from(0.0, |tick| angular(&tick.wrench).norm()),
        )],
        ..along(case, about, scene, path)
    }
}

/// How fast the device turns the gear, rad/s, and how far to either side, rad.
const RATE: f64 = 0.05;
const MOST: f64 = 0.012;
/// Time in which it gets there, and for which it waits, s.
const THERE: f64 = MOST / RATE;
const HELD: f64 = 0.1;

/// The angle of a gear that is turned to one side and then to the other, rad.
fn turned(time: f64) -> f64 {
    let time = time.min(3.0 * THERE + HELD);
    if time < THERE {
        RATE * time
    } else {
        (MOST - RATE * (time - THERE - HELD).max(0.0)).max(-MOST)
    }
}

fn gear(extent: Extent) -> Recipe {
    let (turning, standing, place) = gears(extent.choose(24, 12));
    let held = body(mesh(turning.mesh()));
    let (inertia, base) = (held.inertia[(2, 2)], turning.base_radius());
    let device = |time: f64| Pose::new(Vector3::zeros(), Vector3::z() * turned(time));
    let gear = obstacle("gear", mesh(standing.mesh()), place);
    let scene = Scene::new(held, [gear], SIZE, RATE * 0.022, device(0.0));
    let gain = scene.settings.k_h * scene.settings.k_s;
    let rest = scene.settings.rest_distance;
    let play = turning.set_back / turning.pitch_radius();
    let torque = move |time: f64| {
        let beyond = (turned(time).abs() - play).max(0.0);
        -turned(time).signum() * gain * base * base * beyond / (1.0 + base * base / inertia)
    };
    let most = torque(THERE).abs();
    let case = ("R25", "gear in gear".to_owned());
    let about = "gears: free through their backlash, then stiff";
    Recipe {
        // The force stands beside the torque; its direction is the line of action's, which the flank in contact decides.
        ideal: Ideal::closed(move |time| {
            let torque = torque(time);
            let along = turning.pressure_angle;
            let size = torque.abs() / base;
            let side = -torque.signum();
            let force = Vector3::new(-along.sin(), -side * along.cos(), 0.0) * size;
            six(&force, &(Vector3::z() * torque))
        }),
        lines: sound_and(move |_| {
            // Facets of the flanks, and the rest distance at the second pair of teeth.
            let slack = 0.02 * most + gain * base * 3.0 * rest;
            [Measure::TorqueP95.at_most(slack)]
        }),
        probes: vec![Probe::at_most(
            "force_across_plane",
            "N",
            1e-6,
            largest_from(0.0, |tick| linear(&tick.wrench).z.abs()),
        )],
        out_of_scope: turns,
        ..Recipe::new(case, about, scene, 3.0 * THERE + 2.0 * HELD, device)
    }
}
