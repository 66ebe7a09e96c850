//! The path of a simulated hand for an imported scene: against what stands there, to and fro along it, and back.

use std::fmt::Write as _;
use std::sync::Arc;

use god_object::{GodObject, Pose};
use nalgebra::Vector3;

use crate::scene::BuiltScene;

/// How far the hand presses into what it touches, m, and at most as a share of the longest side of all parts together.
const PRESS: f64 = 6e-3;
const PRESS_SHARE: f64 = 0.05;
/// How far it goes to either side there, in the same measures.
const ASIDE: f64 = 15e-3;
const ASIDE_SHARE: f64 = 0.15;
/// The way to the contact is tried in steps of this share of what is pressed.
const STEP_SHARE: f64 = 0.25;
/// Most steps: whoever interrupts an import waits for them.
const MAX_STEPS: f64 = 1e3;
/// Speed of the hand on the way, m/s; the shortest and the longest time from one via point to the next, s.
const SPEED: f64 = 0.03;
const TIMES: [f64; 2] = [1.0, 6.0];

/// A path, and whether its first way was stopped.
pub(super) struct HandPath {
    /// The file's.
    pub(super) text: String,
    pub(super) meets: bool,
}

/// Via points of a hand that leads the body along `way`, m, among parts of this `size` together, m: until it has pressed it into
/// what is there, or all of the way where nothing is. `None` where the method cannot start.
pub(super) fn hand_path(built: BuiltScene, way: &Vector3<f64>, size: f64) -> Option<HandPath> {
    let press = PRESS.min(PRESS_SHARE * size);
    let aside = ASIDE.min(ASIDE_SHARE * size);
    let Pose {
        rotation,
        translation,
    } = built.start;
    let start = translation.vector;
    let (gone, meets) = pressed(built, way, press)?;
    let pressed = start + gone;
    let along = way.try_normalize(0.0).unwrap_or_else(Vector3::z);
    // Two directions across: that of the least share in the way, and what is square to both.
    let across = along.cross(&Vector3::ith(along.iamin(), 1.0)).normalize();
    let square = along.cross(&across);
    let to_and_fro = [across, -across, square, -square].map(|side| pressed + side * aside);
    let via = [start, pressed]
        .into_iter()
        .chain(to_and_fro)
        .chain([pressed, start]);
    let mut text = String::from(
        "# What the simulated hand intends: via points; between two of them a minimum-jerk motion that begins and ends at rest.\n\
         # Found by trying: the first way ends a little beyond where the body is stopped.\n\
         t,x,y,z,qw,qx,qy,qz\n",
    );
    let [qx, qy, qz, qw] = rotation.coords.into();
    let (mut time, mut before) = (0.0, None);
    for place in via {
        if let Some(before) = before.replace(place) {
            let way: Vector3<f64> = place - before;
            time += (way.norm() / SPEED).clamp(TIMES[0], TIMES[1]);
        }
        let [x, y, z] = place.into();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{time:.2},{x:.8},{y:.8},{z:.8},{qw},{qx},{qy},{qz}");
    }
    Some(HandPath { text, meets })
}

/// How far along the way the device is when the body stays behind it by `press`, and whether it does before the end.
fn pressed(built: BuiltScene, way: &Vector3<f64>, press: f64) -> Option<(Vector3<f64>, bool)> {
    let start = built.start;
    let mut god_object = GodObject::new(Arc::new(built.world), built.settings, start).ok()?;
    let length = way.norm();
    let steps = (length / (STEP_SHARE * press)).ceil().min(MAX_STEPS);
    for k in 1..=steps as u64 {
        let gone = way * (k as f64 / steps);
        let device = Pose::from_parts((start.translation.vector + gone).into(), start.rotation);
        god_object.step(&device, None);
        let behind = device.translation.vector - god_object.pose().translation.vector;
        if behind.norm() > press {
            return Some((gone, true));
        }
    }
    Some((*way, false))
}
