//! Of the scenes: bodies that turn, meshes on meshes, friction, and a surface that comes and goes.

use god_object::nalgebra::{UnitQuaternion, Vector3};

use super::super::scenes::{FidelityScene, STIFFNESS, at, force, on};
use super::scenes::{about_y, down, obstacle, scene, turned};

/// Of the lid: how far it goes to either side, m, and when it is up, when it leaves, and when it is down, s.
/// Height of the ball above it at rest, m.
const LID: f64 = 3e-3;
const LID_TIMES: [f64; 3] = [0.3, 0.5, 0.8];
const ABOVE_LID: f64 = 1e-4;
/// Tilt of the coin, rad.
const COIN_TILT: f64 = 0.3;

/// Bodies that turn, roll and tilt.
pub(super) fn turning() -> Vec<FidelityScene> {
    let plane = obstacle("a", "shape = { plane = {} }");
    vec![
        scene(
            "box on a post",
            (
                "box = { half_extents = [0.012, 0.012, 0.012] }",
                &obstacle(
                    "a",
                    "shape = { cylinder = { radius = 0.02, half_length = 0.05, axis = \"y\" } }",
                ),
            ),
            [0.05, 0.0, 2.0],
            0.8,
            |time| {
                let aside = 6e-3 * (8.0 * on(time)).sin();
                at(aside, 0.0, 0.032 + down(time, 2e-3))
            },
        ),
        scene(
            "rough ball rolls",
            ("mesh = \"rough.ply\"", &plane),
            [0.1, 6.7, 2.0],
            0.6,
            |time| {
                let way = 0.1 * on(time);
                let place = Vector3::new(way, 0.0, 0.015 + down(time, 2e-3));
                turned(place, about_y(way / 0.015))
            },
        ),
        scene(
            "coin on its rim",
            (
                "cylinder = { radius = 0.015, half_length = 0.003, axis = \"z\" }",
                &plane,
            ),
            [0.01, 0.9, 0.5],
            0.9,
            |time| {
                let round = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 3.0 * on(time));
                let lowest = 0.015 * COIN_TILT.sin() + 0.003 * COIN_TILT.cos();
                let place = Vector3::z() * (lowest + down(time, 2.5e-3));
                turned(place, round * about_y(COIN_TILT) * round.inverse())
            },
        ),
    ]
}

/// Meshes on meshes, friction, and a surface that comes and goes.
pub(super) fn surfaces() -> Vec<FidelityScene> {
    vec![
        scene(
            "egg on egg",
            (
                "mesh = \"small-egg.ply\"{simplify}",
                &obstacle("a", "shape = { mesh = \"large-egg.ply\"{simplify} }"),
            ),
            [0.07, 0.0, 2.0],
            0.6,
            |time| {
                let x = 0.06 * on(time);
                at(x, 0.3 * x, 0.032 + down(time, 2e-3) - 6.4 * x * x)
            },
        ),
        scene(
            "rough box in a circle",
            (
                "box = { half_extents = [0.015, 0.015, 0.008] }",
                &obstacle("a", "shape = { plane = {} }\nsurface = { friction = 0.6 }"),
            ),
            [0.06, 0.0, 2.0],
            1.0,
            |time| {
                let angle = 6.0 * on(time);
                let (x, y) = (0.01 * (1.0 - angle.cos()), 0.01 * angle.sin());
                at(x, y, 0.008 + down(time, 2e-3))
            },
        ),
        FidelityScene {
            ideal: Some(|time| {
                let push = STIFFNESS * (lid(time) - ABOVE_LID).max(0.0);
                force(Vector3::z() * push)
            }),
            ..scene(
                "lid that comes and goes",
                (
                    "sphere = { radius = 0.01 }",
                    &obstacle(
                        "a",
                        "shape = { plane = {} }\nmotion = { trace = \"lid.csv\" }",
                    ),
                ),
                [0.01, 0.0, 2.9],
                0.75,
                |_| at(0.0, 0.0, 0.01 + ABOVE_LID),
            )
        },
    ]
}

/// Height of the lid, m.
fn lid(time: f64) -> f64 {
    let [up, leaves, low] = LID_TIMES;
    if time < up {
        LID * (2.0 * time / up - 1.0)
    } else if time < leaves {
        LID
    } else {
        LID * (1.0 - 2.0 * (time - leaves) / (low - leaves)).max(-1.0)
    }
}

/// The lid's motion as a trace.
pub(super) fn lid_trace() -> String {
    let [up, leaves, low] = LID_TIMES;
    format!(
        "t,x,y,z,qw,qx,qy,qz\n0,0,0,{0},1,0,0,0\n{up},0,0,{LID},1,0,0,0\n{leaves},0,0,{LID},1,0,0,0\n{low},0,0,{0},1,0,0,0\n",
        -LID
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lid_is_as_high_as_its_trace_says() {
        for (time, height) in [
            (0.0, -LID),
            (0.3, LID),
            (0.4, LID),
            (0.65, 0.0),
            (0.8, -LID),
        ] {
            assert!((lid(time) - height).abs() < 1e-12, "{time}");
        }
    }
}
