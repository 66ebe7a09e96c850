//! R04: a box pressed flat on a plane by a device that goes through it and tilts. While the contacts can hold the tilt the box stays flat.

use god_object::spatial::{Pose, six};
use nalgebra::Vector3;
use taut_method_tests::solids::{body, mesh};
use taut_scene::shapes::cuboid;

use super::Extent;
use super::bodies::{ground, smooth, sound_and, turns};
use crate::clock::TICK;
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};
use crate::vertex_depth::Convex;

/// Of the box, m.
const HALF: [f64; 3] = [0.05, 0.05, 0.02];
const DEPTH: f64 = 5e-3;
const SPEED: f64 = 0.05;
/// Height from which the device comes, m.
const FROM: f64 = 2e-3;
/// The tilt, as a share of that at which the box would pivot, and the time it takes, s.
const SHARE: f64 = 0.8;
const TILTING: f64 = 0.2;
/// Longest that the force may be off, s beside updates: none.
const TICKS: f64 = 2.0;
/// Of the torque, as a share of its largest.
const TORQUE_ERROR: f64 = 0.01;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let held = body(mesh(cuboid(HALF)));
    let inertia = held.inertia[(1, 1)];
    // While |I w| <= m d a the resultant stays within the base.
    let tilt = SHARE * held.mass * DEPTH * HALF[0] / inertia;
    let pressed = (FROM + DEPTH) / SPEED;
    let place = move |time: f64| {
        let depth = (time * SPEED).min(FROM + DEPTH) - FROM;
        let turned = tilt * ((time - pressed - 0.1) / TILTING).clamp(0.0, 1.0);
        (depth, turned)
    };
    let device = move |time: f64| {
        let (depth, turned) = place(time);
        Pose::new(
            Vector3::new(0.0, 0.0, HALF[2] - depth),
            Vector3::new(0.0, turned, 0.0),
        )
    };
    let mut scene = Scene::new(held.clone(), [ground()], 2.0 * HALF[0], SPEED, device(0.0));
    // What the tilt asks for is above the default limit of a device.
    scene.settings.torque_limit = 10.0;
    let (stiffness, gain) = (scene.stiffness(), scene.settings.k_h * scene.settings.k_s);
    let half_space = Convex::cuboid(
        nalgebra::Point3::new(-0.3, -0.3, -0.1),
        nalgebra::Point3::new(0.3, 0.3, 0.0),
    );
    let case = ("R04", "box on a plane, tilted".to_owned());
    let about = "flat on flat: the box stays flat, however many contacts hold it";
    let duration = pressed + 0.1 + TILTING + extent.choose(0.3, 0.1);
    vec![Recipe {
        ideal: Ideal::closed(move |time| {
            let (depth, turned) = place(time);
            let up = Vector3::z() * (stiffness * depth.max(0.0));
            six(&up, &(Vector3::y() * (-gain * inertia * turned)))
        }),
        depth: Box::new(move |pose| half_space.deepest(&held.mesh, pose)),
        phases: extent.choose(5, 1),
        lines: sound_and(move |_| {
            let most = gain * inertia * tilt;
            [
                smooth(stiffness, SPEED),
                Measure::FalseForce.at_most(TICKS * TICK),
                Measure::TorqueP95.at_most(TORQUE_ERROR * most),
            ]
        }),
        out_of_scope: turns,
        ..Recipe::new(case, about, scene, duration, device)
    }]
}
