//! What the hand does in the study of coupling at the edge: a wall, a corner, a dome, a peg in its hole.
//!
//! All with 1 kg and k_h = 2000/s², so that the hand feels 1000 N/m. The hand is light: what a firm one would damp shows. It
//! intends to go some centimetres through the surface, which leaves some millimetres and newtons.

use std::ops::Range;
use std::path::Path;

use nalgebra::Vector3;
use taut_bridge::{MinJerkPath, Pose, ViaPoint};
use taut_scene::{BuiltScene, Scene};

/// Intended depth behind a surface, m: about 3.7 mm and 3.7 N against the light hand's 120 N/m.
const DEPTH: f64 = 0.035;
/// Radius of the ball of wall and corner, m.
const RADIUS: f64 = 0.02;

/// A plane through the origin.
const FLOOR: &str = r#"{ name = "floor", shape = { plane = { axis = "z" } } }"#;
const LEFT: &str = r#"{ name = "left", shape = { plane = { axis = "x" } } }"#;
const FRONT: &str = r#"{ name = "front", shape = { plane = { axis = "y" } } }"#;
const DOME: &str = r#"{ name = "dome", shape = { sphere = { radius = 0.030 } } }"#;

/// A scene and what the hand does there.
#[derive(Debug)]
pub struct Task {
    /// For tables and charts.
    pub name: &'static str,
    /// What the server simulates.
    pub scene: BuiltScene,
    /// The hand's intention, body poses.
    pub intention: MinJerkPath,
    /// Seconds in which the intention stands still in contact, long after it came there: what moves then is not the hand's doing.
    pub rest: Range<f64>,
    /// Length, s.
    pub duration: f64,
}

impl Task {
    /// Presses a ball on a wall, slides it and lifts it.
    pub fn wall() -> Self {
        let at = |x, z| Pose::translation(x, 0.0, z);
        let pressed = RADIUS - DEPTH;
        Self {
            name: "wall",
            scene: ball_before("wall", [0.0, 0.0, 0.04], &[FLOOR]),
            intention: intention(&[
                (0.0, at(0.0, 0.04)),
                (0.5, at(0.0, pressed)),
                (0.8, at(0.0, pressed)),
                (1.6, at(0.08, pressed)),
                (2.6, at(0.08, pressed)),
                (3.1, at(0.08, 0.04)),
            ]),
            rest: 2.1..2.6,
            duration: 3.4,
        }
    }

    /// A plate comes up under what is held: the shipped scene.
    pub fn plate() -> Self {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../server/scenes/moving-plate.toml");
        let start = Pose::translation(0.0, 0.0, 0.030);
        Self {
            name: "plate",
            scene: build(Scene::load(&file)),
            intention: intention(&[(0.0, start), (8.0, start)]),
            rest: 2.0..2.3,
            duration: 8.0,
        }
    }

    /// Slides a ball along a floor into one wall and then into another.
    pub fn corner() -> Self {
        let at = Pose::translation;
        let pressed = RADIUS - DEPTH;
        Self {
            name: "corner",
            scene: ball_before("corner", [0.08, 0.08, 0.05], &[FLOOR, LEFT, FRONT]),
            intention: intention(&[
                (0.0, at(0.08, 0.08, 0.05)),
                (0.5, at(0.08, 0.08, pressed)),
                (1.2, at(pressed, 0.08, pressed)),
                (1.9, at(pressed, pressed, pressed)),
                (2.9, at(pressed, pressed, pressed)),
                (3.5, at(0.08, 0.08, 0.05)),
            ]),
            rest: 2.4..2.9,
            duration: 3.8,
        }
    }

    /// Slides a ball over another one, from one side of it to the other: the centres stay 50 mm apart, so that half-spaces are
    /// wrong by a radian every 50 mm.
    pub fn dome() -> Self {
        let at = |x, z| Pose::translation(x, 0.0, z);
        Self {
            name: "dome",
            scene: ball_before("dome", [-0.05, 0.0, 0.08], &[DOME]),
            intention: intention(&[
                (0.0, at(-0.05, 0.08)),
                (0.6, at(-DEPTH / 2.0, DEPTH / 2.0)),
                (0.9, at(-DEPTH / 2.0, DEPTH / 2.0)),
                (1.6, at(DEPTH / 2.0, DEPTH / 2.0)),
                (2.6, at(DEPTH / 2.0, DEPTH / 2.0)),
                (3.1, at(0.05, 0.08)),
            ]),
            rest: 2.1..2.6,
            duration: 3.4,
        }
    }

    /// Puts a peg (288 triangles) into a hole (280 triangles) with 0.5 mm of clearance, presses it to the side and tilts it there, and takes it out.
    pub fn peg() -> Self {
        let at = |x, y| Pose::translation(x, y, 0.0);
        let tilted = Pose::new(Vector3::new(DEPTH, 0.01, 0.0), Vector3::z() * 0.4);
        let scene =
            build(Scene::named_or_file("peg-in-a-hole").and_then(|scene| {
                scene.with_override("god_object.pose={position=[0.0,0.08,0.0]}")
            }));
        Self {
            name: "peg",
            scene,
            intention: intention(&[
                (0.0, at(0.0, 0.08)),
                (1.0, at(0.0, 0.01)),
                (1.4, at(DEPTH, 0.01)),
                (2.2, at(DEPTH, 0.01)),
                (2.6, tilted),
                (3.4, tilted),
                (3.8, at(0.0, 0.01)),
                (4.6, at(0.0, 0.08)),
            ]),
            rest: 3.0..3.4,
            duration: 4.8,
        }
    }

    /// All of them.
    pub fn all() -> [Self; 4] {
        [Self::wall(), Self::corner(), Self::dome(), Self::peg()]
    }
}

/// A ball of 1 kg at `start` before exact obstacles.
fn ball_before(name: &str, start: [f64; 3], obstacles: &[&str]) -> BuiltScene {
    let text = format!(
        r#"
name = "{name}"
obstacle = [{}]
[god_object]
shape = {{ sphere = {{ radius = {RADIUS} }} }}
mass = 1.0
pose = {{ position = {start:?} }}
[coupling]
k_s = 0.5
k_h = 2000.0
"#,
        obstacles.join(", ")
    );
    build(Scene::parse("study.toml", &text, Path::new("")))
}

fn build(scene: Result<Scene, taut_scene::SceneError>) -> BuiltScene {
    scene
        .and_then(|scene| scene.build())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn intention(points: &[(f64, Pose)]) -> MinJerkPath {
    path(points, false)
}

/// Through poses at times, s; again and again with `repeats`.
pub(crate) fn path(points: &[(f64, Pose)], repeats: bool) -> MinJerkPath {
    let via = |&(time_s, pose): &(f64, Pose)| ViaPoint { time_s, pose };
    MinJerkPath::new(points.iter().map(via).collect(), repeats)
        .unwrap_or_else(|error| panic!("{error}"))
}
