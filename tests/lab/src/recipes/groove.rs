//! R06 and R07 with bodies: a ball in a V-groove, and a ball in a corner of three walls.

use god_object::{Obstacle, Pose};
use nalgebra::{UnitQuaternion, Vector3};
use taut_method_tests::solids::{mesh, obstacle};
use taut_scene::shapes::cuboid;

use super::Extent;
use super::bodies::{Path, along, ball, block, force, ghost_time, smooth, sound_and};
use crate::clock::TICK;
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};

const RADIUS: f64 = 5e-3;
const SPEED: f64 = 0.05;
const DOWN: f64 = 4e-3;
/// Half of each slab of the groove, m.
const SLAB: f64 = 0.05;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let mut recipes: Vec<Recipe> = extent
        .choose(&[30.0, 45.0, 80.0][..], &[45.0][..])
        .iter()
        .map(|degrees| groove(*degrees))
        .collect();
    recipes.push(corner());
    recipes
}

/// A slab whose upper face goes through `point` with this normal, which has no y.
fn slab(name: &str, point: Vector3<f64>, normal: Vector3<f64>) -> Obstacle {
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &normal).unwrap_or_default();
    let middle = point - normal * SLAB;
    let pose = Pose::from_parts(middle.into(), turn);
    obstacle(name, mesh(cuboid([2.0 * SLAB, SLAB, SLAB])), pose)
}

/// `degrees`: the half-angle between a face and the plane of symmetry's normal, as in the oracle.
fn groove(degrees: f64) -> Recipe {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let normals = [1.0, -1.0].map(|side| Vector3::new(side * cosine, 0.0, sine));
    // The centre at the bottom is the origin.
    let faces = [0, 1].map(|i| slab(["left", "right"][i], normals[i] * -RADIUS, normals[i]));
    let limit = DOWN * cosine / sine;
    let across = 2.0 * limit.min(5e-3);
    let path = Path::from(Vector3::new(0.0, 0.0, 3e-3))
        .to(Vector3::new(0.0, 0.0, -DOWN), SPEED)
        .hold(0.05)
        .to(Vector3::new(across, 0.0, -DOWN), SPEED)
        .to(Vector3::new(-across, 0.0, -DOWN), SPEED)
        .hold(0.05);
    let scene = Scene::new(ball(RADIUS), faces, 2.0 * RADIUS, SPEED, path.pose(0.0));
    let stiffness = scene.stiffness();
    let ideal = path.clone();
    let case = ("R06", format!("ball in a groove of {degrees} degrees"));
    let about = "V-groove: held within its angle, up one face beyond";
    Recipe {
        ideal: Ideal::closed(move |time| {
            let place = ideal.at(time);
            let depths = normals.map(|n| -n.dot(&place));
            // The nearest allowed place: on both faces, on one, or where it is.
            let single = |i: usize| normals[i] * depths[i].max(0.0);
            let held = [0, 1].map(single);
            let free = |to: Vector3<f64>| normals.iter().all(|n| n.dot(&(place + to)) >= -1e-15);
            let push = if free(Vector3::zeros()) {
                Vector3::zeros()
            } else if free(held[0]) {
                held[0]
            } else if free(held[1]) {
                held[1]
            } else {
                Vector3::new(-place.x, 0.0, -place.z)
            } * stiffness;
            force(push.x, push.y, push.z)
        }),
        depth: Box::new(move |body| {
            let place = body.translation.vector;
            normals.iter().map(|n| -n.dot(&place)).fold(0.0, f64::max)
        }),
        lines: sound_and(move |_| [smooth(stiffness, SPEED), Measure::FalseForce.at_most(0.0)]),
        ..along(case, about, scene, path)
    }
}

fn corner() -> Recipe {
    let walls = [
        ("floor", [0.2, 0.2, 0.0]),
        ("left", [0.0, 0.2, 0.2]),
        ("back", [0.2, 0.0, 0.2]),
    ];
    let walls = walls.map(|(name, high)| block(name, [-0.1; 3].into(), high.into()));
    let at = |x: f64, y: f64, z: f64| Vector3::new(x, y, z) + Vector3::repeat(RADIUS);
    let path = Path::from(at(0.01, 0.012, 0.008))
        .to(at(0.01, 0.012, -2e-3), SPEED)
        .to(at(-3e-3, 0.012, -2e-3), SPEED)
        .to(at(-3e-3, -4e-3, -2e-3), SPEED)
        .hold(0.1)
        .to(at(5e-3, -4e-3, 5e-3), SPEED)
        .to(at(5e-3, 5e-3, 5e-3), SPEED);
    let scene = Scene::new(ball(RADIUS), walls, 2.0 * RADIUS, SPEED, path.pose(0.0));
    let (stiffness, k_s) = (scene.stiffness(), scene.settings.k_s);
    let ideal = path.clone();
    let case = ("R07", "ball in a corner".to_owned());
    let about = "corner of three walls: each holds its axis";
    Recipe {
        ideal: Ideal::closed(move |time| {
            let depth = (Vector3::repeat(RADIUS) - ideal.at(time)).sup(&Vector3::zeros());
            let push = depth * stiffness;
            force(push.x, push.y, push.z)
        }),
        depth: Box::new(|body| {
            let place = body.translation.vector;
            (RADIUS - place.min()).max(0.0)
        }),
        lines: sound_and(move |rate| {
            let settle = ghost_time(k_s, rate) + 2.0 * TICK;
            [
                smooth(stiffness, SPEED),
                Measure::FalseForce.at_most(settle),
            ]
        }),
        ..along(case, about, scene, path)
    }
}
