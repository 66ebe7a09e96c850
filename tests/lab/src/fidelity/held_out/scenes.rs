//! The scenes: kinds of shape, edge, hollow, surface and motion that neither the recipes nor the scenes seen before have.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fs;
use std::path::Path;
use std::sync::Arc;

use god_object::Pose;
use god_object::nalgebra::{UnitQuaternion, Vector3};
use taut_scene::write_ply;

use super::super::scenes::{FidelityScene, at, on, share, with_hands};
use super::moving::{lid_trace, surfaces, turning};
use super::solids::{egg, prism, relief};

/// Of the roof: its slopes, rad, and its length to either side, m.
const SLOPE: f64 = 0.35;
const ROOF: f64 = 0.06;
/// Of the bumps: height, m, and wavelengths along x and y, m.
const BUMP: f64 = 1e-3;
const WAVES: [f64; 2] = [0.012, 0.015];

/// From a tenth of a millimetre above a surface to `depth` inside, m.
pub(super) fn down(time: f64, depth: f64) -> f64 {
    1e-4 - (depth + 1e-4) * share(time)
}

pub(super) fn turned(place: Vector3<f64>, rotation: UnitQuaternion<f64>) -> Pose {
    Pose::from_parts(place.into(), rotation)
}

pub(super) fn about_y(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle)
}

/// A scene file with the default coupling, and what is known of its use: how fast the hand goes, m/s, and
/// turns, rad/s, and how hard it presses, N.
pub(super) fn scene(
    name: &'static str,
    (body, obstacles): (&str, &str),
    [speed, turn, force]: [f64; 3],
    duration: f64,
    device: impl Fn(f64) -> Pose + Send + Sync + 'static,
) -> FidelityScene {
    let start = device(0.0);
    let (p, q) = (start.translation.vector, start.rotation.quaternion());
    FidelityScene {
        name,
        text: format!(
            "name = \"fidelity\"\n[god_object]\nshape = {{ {body} }}\nmass = 1.0\n\
             pose = {{ position = [{:?}, {:?}, {:?}], rotation = [{:?}, {:?}, {:?}, {:?}] }}\n\
             [fidelity]\nmode = \"auto\"\nspeed = {speed:?}\nturn_rate = {turn:?}\nforce = {force:?}\n{obstacles}",
            p.x, p.y, p.z, q.w, q.i, q.j, q.k
        ),
        duration,
        device: Arc::new(device),
        ideal: None,
    }
}

pub(super) fn obstacle(name: &str, lines: &str) -> String {
    format!("[[obstacle]]\nname = \"{name}\"\n{lines}\n")
}

/// All of them; their files are written into `directory`.
pub fn all(directory: &Path) -> std::io::Result<Vec<FidelityScene>> {
    let slope = -ROOF * SLOPE.tan();
    let outline = [
        [-ROOF, -0.04],
        [ROOF, -0.04],
        [ROOF, slope],
        [0.0, 0.0],
        [-ROOF, slope],
    ];
    let meshes = [
        ("roof.ply", prism(&outline, 0.03)),
        ("rough.ply", egg(0.015, 1, 1.0)),
        ("small-egg.ply", egg(0.02, 3, 0.7)),
        ("large-egg.ply", egg(0.03, 4, 0.6)),
        ("bumps.ply", relief([48, 20], 1.25e-3, -0.01, bump)),
    ];
    for (file, mesh) in meshes {
        fs::write(directory.join(file), write_ply(&mesh))?;
    }
    fs::write(directory.join("lid.csv"), lid_trace())?;
    let scenes = [edges(), hollows(), turning(), surfaces()];
    with_hands(scenes.into_iter().flatten().collect(), directory)
}

/// Edges of other turns and under other bodies.
fn edges() -> Vec<FidelityScene> {
    let block = obstacle(
        "a",
        "shape = { box = { half_extents = [0.03, 0.04, 0.01] } }\npose = { position = [-0.03, 0.0, -0.01] }",
    );
    vec![
        // Along the top, about the edge, and down the side.
        scene(
            "capsule about a kerb",
            (
                "capsule = { radius = 0.006, half_length = 0.02, axis = \"y\" }",
                &block,
            ),
            [0.1, 0.0, 2.0],
            0.6,
            |time| {
                let (way, radius) = (0.1 * on(time), 0.004);
                let (flat, arc) = (0.02, radius * FRAC_PI_2);
                if way < flat {
                    at(way - flat, 0.0, 0.006 + down(time, 2e-3))
                } else if way < flat + arc {
                    let angle = (way - flat) / radius;
                    at(radius * angle.sin(), 0.0, radius * angle.cos())
                } else {
                    at(radius, 0.0, flat + arc - way)
                }
            },
        ),
        scene(
            "ball over a roof",
            (
                "sphere = { radius = 0.01 }",
                &obstacle("a", "shape = { mesh = \"roof.ply\" }"),
            ),
            [0.11, 0.0, 2.0],
            0.7,
            |time| {
                let x = -0.025 + 0.1 * on(time);
                at(x, 0.0, roof(x) + down(time, 2e-3))
            },
        ),
        scene(
            "cube over a kerb",
            ("box = { half_extents = [0.01, 0.01, 0.01] }", &block),
            [0.1, 0.0, 2.0],
            0.55,
            |time| {
                let x = (-0.03 + 0.1 * on(time)).min(-0.004);
                at(x, 0.0, 0.01 + down(time, 2e-3))
            },
        ),
    ]
}

/// Where the middle of a ball of 10 mm lies on the roof, m.
fn roof(x: f64) -> f64 {
    let radius = 0.01_f64;
    if x.abs() < radius * SLOPE.sin() {
        (radius * radius - x * x).sqrt()
    } else {
        radius / SLOPE.cos() - x.abs() * SLOPE.tan()
    }
}

fn bump(x: f64, y: f64) -> f64 {
    BUMP * (TAU * x / WAVES[0]).sin() * (TAU * y / WAVES[1]).cos()
}

/// Hollows: a bore, a slot, and bumps between which a tip finds its way.
fn hollows() -> Vec<FidelityScene> {
    let slab = |name: &str, z: f64| {
        let pose = format!("pose = {{ position = [0.0, 0.0, {z:?}] }}");
        let shape = "shape = { box = { half_extents = [0.03, 0.03, 0.01] } }";
        obstacle(name, &format!("{shape}\n{pose}"))
    };
    let slot = slab("a", 0.0123) + &slab("b", -0.0123);
    vec![
        scene(
            "ball round a bore",
            (
                "sphere = { radius = 0.008 }",
                &obstacle(
                    "a",
                    "shape = { box_with_hole = { half_extents = [0.04, 0.03, 0.04], radius = 0.025, facets = 72, axis = \"y\" } }",
                ),
            ),
            [0.15, 0.0, 2.0],
            0.6,
            |time| {
                let (out, angle) = (0.019 * share(time), 0.15 * on(time) / 0.019);
                at(out * angle.sin(), 0.0, -out * angle.cos())
            },
        ),
        scene(
            "key tilted in a slot",
            ("box = { half_extents = [0.02, 0.01, 0.002] }", &slot),
            [0.05, 1.0, 1.0],
            0.8,
            |time| {
                let place = Vector3::new(0.01 * (5.0 * on(time)).sin(), 0.0, 1.3e-3 * share(time));
                turned(place, about_y(0.08 * (12.0 * on(time)).sin()))
            },
        ),
        scene(
            "tip over bumps",
            (
                "sphere = { radius = 0.0025 }",
                &obstacle("a", "shape = { mesh = \"bumps.ply\" }"),
            ),
            [0.06, 0.0, 1.2],
            0.9,
            |time| {
                let (x, y) = (-0.02 + 0.05 * on(time), 4e-4);
                at(x, y, bump(x, y) + 2.6e-3 + down(time, 1.3e-3))
            },
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_ball_on_the_roof_goes_smoothly() {
        let (step, bend) = (1e-6, 0.01 * SLOPE.sin());
        let slope = |x: f64| (roof(x + step) - roof(x)) / step;
        assert!((slope(bend - 2.0 * step) - slope(bend + step)).abs() < 1e-3);
        assert!((roof(bend - 1e-12) - roof(bend + 1e-12)).abs() < 1e-9);
    }
}
