//! R25: combs of eleven teeth in each other, and a gear in another: many contacts at once, then stiff.

use std::f64::consts::PI;

use god_object::Pose;
use god_object::spatial::{angular, linear, six};
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use taut_method_tests::machined::Gear;
use taut_method_tests::solids::{body, cells, mesh, obstacle};

use super::Extent;
use super::bodies::{Path, along, force, largest_from, smooth, sound_and, turns};
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Probe, Recipe};

const PITCH: f64 = 4e-3;
const TOOTH: f64 = 2e-3;
const DEPTH: f64 = 10e-3;
const BAR: f64 = 3e-3;
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
    let planes = |width: f64, teeth: usize| -> Vec<f64> {
        let first = -0.5 * (teeth - 1) as f64 * PITCH;
        (0..teeth)
            .flat_map(|k| {
                let middle = first + k as f64 * PITCH;
                [middle - 0.5 * width, middle + 0.5 * width]
            })
            .collect()
    };
    let y = [-5e-3, 5e-3];
    // Teeth down, under a bar; teeth up, on a bar, in the gaps of the other and beyond.
    let upper_x = planes(TOOTH, 11);
    let upper = cells([&upper_x, &y, &[-DEPTH, 0.0, BAR]], |[i, _, k]| {
        k == 1 || i % 2 == 0
    });
    let lower_x = planes(PITCH - TOOTH - 2.0 * clearance, 12);
    let lower = cells([&lower_x, &y, &[-BAR, 0.0, DEPTH]], |[i, _, k]| {
        k == 0 || i % 2 == 0
    });
    let mut held = body(mesh(upper));
    // In the middle of the teeth: a push to the side has no lever.
    held.reference_point = Point3::new(0.0, 0.0, -0.5 * DEPTH);
    let at = |x: f64, z: f64| Vector3::new(x, 0.0, z);
    let inserted = DEPTH + 2e-3; // 8 mm of the teeth overlap
    let path = Path::from(at(0.0, 2.0 * DEPTH + 1e-3))
        .to(at(0.0, inserted), SPEED)
        .to(at(OFFSET, inserted), SPEED)
        .hold(0.1)
        .to(at(-OFFSET, inserted), SPEED)
        .hold(0.1)
        .to(at(0.0, inserted), SPEED);
    let comb = obstacle("comb", mesh(lower), Pose::identity());
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
            0.01 * stiffness * OFFSET * DEPTH,
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

/// Module 2 mm, 20 teeth against 40 that stand, each flank of the turning one set back by 0.1 mm along the pitch circle.
///
/// Involutes stay parallel under rotation: the free play is 0.1 mm / 20 mm = 0.005 rad each way. Then the contact is a force along the line of
/// action, which touches the base circle r_b: turning on by d gives lambda = r_b d / (1/m + r_b^2 / I), torque k_h k_s r_b lambda.
fn gear(extent: Extent) -> Recipe {
    let turning = Gear {
        module: 2e-3,
        teeth: 20,
        pressure_angle: 20.0_f64.to_radians(),
        set_back: 0.1e-3,
        half_width: 5e-3,
        pieces: extent.choose(24, 12),
    };
    let standing = Gear {
        teeth: 40,
        set_back: 0.0,
        half_width: 8e-3,
        ..turning
    };
    // A gap between two teeth faces the tooth at x.
    let place = Pose::from_parts(
        Translation3::new(turning.pitch_radius() + standing.pitch_radius(), 0.0, 0.0),
        UnitQuaternion::from_scaled_axis(Vector3::z() * (PI + PI / standing.teeth as f64)),
    );
    let held = body(mesh(turning.mesh()));
    let (inertia, base) = (held.inertia[(2, 2)], turning.base_radius());
    let device = |time: f64| {
        Pose::from_parts(
            Translation3::identity(),
            UnitQuaternion::from_scaled_axis(Vector3::z() * turned(time)),
        )
    };
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
