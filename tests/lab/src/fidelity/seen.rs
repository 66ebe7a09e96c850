//! Twelve scenes that were held out from the first choice of fidelity, and have been seen since: what it missed of them led to the formulas of today.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use god_object::Pose;
use god_object::nalgebra::Vector3;

use super::held_out::egg;
use super::scenes::{ABOVE, FidelityScene, STIFFNESS, at, force, on, scene, share, with_hands};

/// Where the plate of `lift.csv` begins and ends, m, and how fast it rises, m/s.
const LIFT: [f64; 2] = [-2e-3, 4e-3];
const LIFTING: f64 = 0.02;

/// On a circle of this radius about the y axis, `depth` inside it once pressed, with this speed along it,
/// m/s; from its top on.
fn around(radius: f64, depth: f64, speed: f64) -> impl Fn(f64) -> Pose + Send + Sync {
    move |time| {
        let angle = speed * on(time) / radius;
        let out = radius - depth * (2.0 * share(time) - 1.0);
        at(out * angle.sin(), 0.0, out * angle.cos())
    }
}

/// All of them; their files are written into `directory`.
pub(crate) fn all(directory: &Path) -> std::io::Result<Vec<FidelityScene>> {
    let egg = taut_scene::write_ply(&egg(0.03, 5, 0.6));
    fs::write(directory.join("egg.ply"), egg)?;
    let lift =
        "t,x,y,z,qw,qx,qy,qz\n0,0,0,-0.002,1,0,0,0\n0.3,0,0,0.004,1,0,0,0\n1,0,0,0.004,1,0,0,0\n";
    fs::write(directory.join("lift.csv"), lift)?;
    let ball = |radius: f64| format!("sphere = {{ radius = {radius:?} }}");
    let mut scenes = round(&ball);
    scenes.extend(curved(&ball));
    scenes.extend(edged(&ball));
    scenes.extend(turning());
    with_hands(scenes, directory)
}

/// Round something of one radius.
fn round(ball: &impl Fn(f64) -> String) -> Vec<FidelityScene> {
    let shape = |shape: String| format!("shape = {{ {shape} }}");
    vec![
        scene(
            "small on small",
            (&ball(0.005), [0.0, 0.0, 0.0171], &shape(ball(0.012))),
            [0.15, 0.0, 1.5],
            0.35,
            around(0.017, 1.5e-3, 0.15),
        ),
        scene(
            "ball round a rod",
            (
                &ball(0.008),
                [0.0, 0.0, 0.0331],
                "shape = { capsule = { radius = 0.025, half_length = 0.05, axis = \"y\" } }",
            ),
            [0.25, 0.0, 2.5],
            0.5,
            around(0.033, 2.5e-3, 0.25),
        ),
        scene(
            "ball round a prism",
            (
                &ball(0.01),
                [0.0, 0.0, 0.0401],
                "shape = { cylinder = { radius = 0.03, half_length = 0.05, facets = 48, axis = \"y\" } }",
            ),
            [0.12, 0.0, 2.0],
            0.6,
            around(0.04, 2e-3, 0.12),
        ),
    ]
}

/// Over what is curved more here than there, and in what is hollow.
fn curved(ball: &impl Fn(f64) -> String) -> Vec<FidelityScene> {
    let valley = "shape = { sphere = { radius = 0.03 } }\npose = { position = [-0.02, 0.0, 0.0] }\n\
        [[obstacle]]\nname = \"b\"\nshape = { sphere = { radius = 0.03 } }\npose = { position = [0.02, 0.0, 0.0] }";
    let bottom = (0.042_f64.powi(2) - 0.02_f64.powi(2)).sqrt();
    vec![
        scene(
            "ball over an egg",
            (
                &ball(0.006),
                [0.0, 0.0, 0.0241],
                "shape = { mesh = \"egg.ply\"{simplify} }",
            ),
            [0.08, 0.0, 2.0],
            0.6,
            |time| {
                let height = 0.0241 - 2.1e-3 * share(time);
                at(
                    0.08 * on(time),
                    0.0,
                    height - 12.0 * (0.08 * on(time)).powi(2),
                )
            },
        ),
        scene(
            "ball in a valley",
            (&ball(0.012), [0.0, 0.0, bottom + 1e-4], valley),
            [0.06, 0.0, 3.0],
            0.6,
            move |time| {
                let side = 6e-3 * (10.0 * on(time)).sin();
                at(side, 0.0, bottom + 1e-4 - 3.1e-3 * share(time))
            },
        ),
    ]
}

/// Edges, corners and walls.
fn edged(ball: &impl Fn(f64) -> String) -> Vec<FidelityScene> {
    let block = "shape = { box = { half_extents = [0.02, 0.03, 0.01] } }\npose = { position = [-0.02, 0.0, -0.01] }";
    let groove = "shape = { box = { half_extents = [0.05, 0.05, 0.005] } }\n\
        pose = { position = [-0.03889, 0.0, 0.03182], rotation = [0.92388, 0.0, 0.38268, 0.0] }\n\
        [[obstacle]]\nname = \"b\"\nshape = { box = { half_extents = [0.05, 0.05, 0.005] } }\n\
        pose = { position = [0.03889, 0.0, 0.03182], rotation = [0.92388, 0.0, -0.38268, 0.0] }";
    vec![
        scene(
            "ball over an edge",
            (&ball(0.008), [-0.02, 0.0, 0.0081], block),
            [0.15, 0.0, 2.0],
            0.5,
            |time| at(-0.02 + 0.15 * on(time), 0.0, 0.0081 - 2.1e-3 * share(time)),
        ),
        scene(
            "ball along a groove",
            (&ball(0.01), [0.0, -0.03, 0.0155], groove),
            [0.2, 0.0, 3.0],
            0.5,
            |time| {
                at(
                    2e-3 * (15.0 * on(time)).sin(),
                    -0.03 + 0.2 * on(time),
                    0.0155 - 4e-3 * share(time),
                )
            },
        ),
        scene(
            "tap on a block",
            (&ball(0.008), [-0.02, 0.0, 0.03], block),
            [0.6, 0.0, 3.0],
            0.5,
            |time| at(-0.02, 0.0, 0.0175 + 0.0125 * (2.0 * PI * 6.0 * time).cos()),
        ),
        scene(
            "box with friction",
            (
                "box = { half_extents = [0.015, 0.01, 0.01] }",
                [0.0, 0.0, 0.0101],
                "shape = { plane = {} }\nsurface = { friction = 0.4 }",
            ),
            [0.08, 0.0, 2.0],
            0.6,
            |time| at(0.08 * on(time), 0.0, 0.0101 - 2.1e-3 * share(time)),
        ),
        FidelityScene {
            ideal: Some(|time| {
                let height = (LIFT[0] + LIFTING * time).min(LIFT[1]);
                force(Vector3::z() * (STIFFNESS * (height - ABOVE).max(0.0)))
            }),
            ..scene(
                "plate lifts a ball",
                (
                    &ball(0.015),
                    [0.0, 0.0, 0.0151],
                    "shape = { plane = {} }\nmotion = { trace = \"lift.csv\" }",
                ),
                [0.02, 0.0, 4.0],
                0.5,
                |_| at(0.0, 0.0, 0.0151),
            )
        },
    ]
}

/// Bodies that turn.
fn turning() -> Vec<FidelityScene> {
    let hole = "shape = { box_with_hole = { half_extents = [0.03, 0.03, 0.03], radius = 0.0102, facets = 36, axis = \"z\" } }";
    vec![
        scene(
            "peg turned in its hole",
            (
                "cylinder = { radius = 0.01, half_length = 0.025, facets = 36, axis = \"z\" }",
                [0.0, 0.0, 0.0],
                hole,
            ),
            [0.03, 1.0, 1.5],
            0.6,
            |time| {
                let side = 1.7e-3 * share(time);
                let place = Vector3::new(side, 0.0, 0.015 * on(time));
                Pose::new(place, Vector3::z() * (0.5 * on(time)))
            },
        ),
        scene(
            "plank rocked on an edge",
            (
                "box = { half_extents = [0.05, 0.01, 0.004] }",
                [0.0, 0.0, 0.0041],
                "shape = { box = { half_extents = [0.004, 0.03, 0.01] } }\npose = { position = [0.0, 0.0, -0.01] }",
            ),
            [0.05, 1.5, 2.0],
            0.7,
            |time| {
                let swing = 0.15 * (10.0 * on(time)).sin();
                let place = Vector3::new(0.0, 0.0, 0.0041 - 2.1e-3 * share(time));
                Pose::new(place, Vector3::y() * swing)
            },
        ),
    ]
}

#[cfg(test)]
mod tests {
    use god_object::Vector6;

    use super::*;

    #[test]
    fn the_plate_that_lifts_is_judged_by_its_formula() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scenes = all(folder.path()).expect("files can be written");
        let mut moving = scenes.iter().filter(|s| s.text.contains("motion"));
        let right = moving.next().and_then(|s| s.ideal).expect("a formula");
        assert!(moving.next().is_none());
        assert_eq!(right(0.1), Vector6::zeros());
        assert!((right(0.2)[2] - 1.9).abs() < 1e-9);
        assert!((right(0.4)[2] - 3.9).abs() < 1e-9);
    }
}
