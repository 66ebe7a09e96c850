//! Scenes of different need, each as a file says it, with the hand's motion and the right answer.
//!
//! | scene           | what it needs                                                    |
//! |-----------------|------------------------------------------------------------------|
//! | box on plane    | nothing: a plane's rows are exact however old they are           |
//! | sphere on sphere| a rate: the normal turns                                         |
//! | peg in hole     | rows for turns in a clearance of 0.5 mm                          |
//! | curved mesh     | a rate, and as many triangles as can be felt                     |
//! | thin plate      | no rate either: continuous collision detection stops a fast body |
//! | moving plate    | a rate, for an obstacle that moves by itself                     |
//! | tilted rod      | rounds: the body turns quickly on a long lever                   |

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use god_object::nalgebra::{UnitQuaternion, Vector3};
use god_object::{Pose, Vector6};
use taut_scene::shapes;

/// 1/(k_h k_s m): 2000 / s^2, 0.5, 1 kg.
pub(super) const STIFFNESS: f64 = 1000.0;
/// How deep the device goes, m: 2 N.
const DEPTH: f64 = 2e-3;
/// Radii of the spheres, m.
const BALL: f64 = 0.02;
const MESH_BALL: f64 = 0.03;
const SMALL_BALL: f64 = 0.01;
/// Speeds of the hand, m/s, and of the moving plate.
const SLIDE: f64 = 0.1;
const FAST: f64 = 1.0;
const PLATE: f64 = 5e-3;
/// Where the fast hand stops, and how high the hand waits for the plate, m.
const ARRIVED: f64 = SMALL_BALL - 0.012;
pub(super) const ABOVE: f64 = 1e-4;
/// Turns of the rod, rad/s, and half its length, m.
const TURN: f64 = 2.0;
const ROD: f64 = 0.04;
/// Most force on the rod in the reference run, N.
const ROD_FORCE: f64 = 4.15;
/// Time to come down and press before anything else, s.
const PRESS: f64 = 0.2;
/// Time between the poses of a hand's path in a file, s.
const SAMPLED: f64 = 0.02;

/// The hand's pose at a time, s.
pub type Motion = Arc<dyn Fn(f64) -> Pose + Send + Sync>;

/// One scene.
pub struct FidelityScene {
    /// Name in tables and files.
    pub name: &'static str,
    /// The scene file; `{simplify}` stands where a mesh may be simplified.
    pub text: String,
    /// The hand.
    pub device: Motion,
    /// s.
    pub duration: f64,
    /// The right wrench at a time, s; `None` takes a run of the oracle, or with friction a reference run: no
    /// obstacle moves in either.
    pub ideal: Option<fn(f64) -> Vector6>,
}

/// All of them; their mesh files and traces are written into `directory`.
pub fn all(directory: &Path) -> std::io::Result<Vec<FidelityScene>> {
    let ball = shapes::sphere(MESH_BALL, 5);
    fs::write(directory.join("ball.ply"), taut_scene::write_ply(&ball))?;
    let rise = 2.0 * DEPTH / PLATE;
    let trace = format!(
        "t,x,y,z,qw,qx,qy,qz\n0,0,0,{0},1,0,0,0\n{rise},0,0,{DEPTH},1,0,0,0\n{1},0,0,{DEPTH},1,0,0,0\n",
        -DEPTH,
        rise + 1.0
    );
    fs::write(directory.join("plate.csv"), trace)?;
    let scenes = vec![
        box_on_plane(),
        sphere_on_sphere(),
        peg_in_hole(),
        curved_mesh(),
        thin_plate(),
        moving_plate(rise),
        rod_on_plane(),
    ];
    with_hands(scenes, directory)
}

/// The same with the hand's path in each scene file, as its author knows it: where the hand does not come,
/// nothing is met.
pub(super) fn with_hands(
    scenes: Vec<FidelityScene>,
    directory: &Path,
) -> std::io::Result<Vec<FidelityScene>> {
    let with_hand = |scene: FidelityScene| {
        let file = format!("{}-hand.csv", scene.name.replace([' ', ','], "-"));
        fs::write(directory.join(&file), scene.trace())?;
        let text = format!("{}[hand]\npath = \"{file}\"\n", scene.text);
        Ok(FidelityScene { text, ..scene })
    };
    scenes.into_iter().map(with_hand).collect()
}

impl FidelityScene {
    /// The hand's path as a trace.
    fn trace(&self) -> String {
        let mut csv = "t,x,y,z,qw,qx,qy,qz\n".to_owned();
        let samples = (self.duration / SAMPLED).ceil() as u32;
        for sample in 0..=samples {
            let time = (f64::from(sample) * SAMPLED).min(self.duration);
            let pose = (self.device)(time);
            let (p, q) = (pose.translation.vector, pose.rotation.quaternion());
            let time = f64::from(sample) * SAMPLED;
            let _ = writeln!(
                csv,
                "{time:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
                p.x, p.y, p.z, q.w, q.i, q.j, q.k
            );
        }
        csv
    }
}

/// A body at its start before an obstacle; how fast the hand goes, m/s, and turns, rad/s, and how hard it presses, N; no right answer yet.
pub(super) fn scene(
    name: &'static str,
    (body, [x, y, z], obstacle): (&str, [f64; 3], &str),
    [speed, turn, force]: [f64; 3],
    duration: f64,
    device: impl Fn(f64) -> Pose + Send + Sync + 'static,
) -> FidelityScene {
    FidelityScene {
        name,
        text: format!(
            "name = \"fidelity\"\n[god_object]\nshape = {{ {body} }}\nmass = 1.0\npose = {{ position = [{x:?}, {y:?}, {z:?}] }}\n\
             [coupling]\nk_s = 0.5\nk_h = 2000.0\nadaptation = false\n[fidelity]\nmode = \"auto\"\nspeed = {speed:?}\nturn_rate = {turn:?}\nforce = {force:?}\n\
             [[obstacle]]\nname = \"a\"\n{obstacle}\n"
        ),
        device: Arc::new(device),
        duration,
        ideal: None,
    }
}

/// Share of a minimum-jerk motion of `PRESS` seconds, as hands make them.
pub(super) fn share(time: f64) -> f64 {
    let t = (time / PRESS).clamp(0.0, 1.0);
    t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
}

/// Seconds since the hand has pressed.
pub(super) fn on(time: f64) -> f64 {
    (time - PRESS).max(0.0)
}

pub(super) fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

/// Depth, m, from above the surface to [`DEPTH`] in `PRESS` seconds, and then for how long it has been so, s.
fn pressed(time: f64) -> (f64, f64) {
    let depth = DEPTH * (2.0 * share(time) - 1.0);
    (depth, on(time))
}

pub(super) fn force(vector: Vector3<f64>) -> Vector6 {
    Vector6::new(vector.x, vector.y, vector.z, 0.0, 0.0, 0.0)
}

const PLANE: &str = "shape = { plane = {} }";
const BOX: &str = "box = { half_extents = [0.01, 0.01, 0.01] }";

fn box_on_plane() -> FidelityScene {
    FidelityScene {
        ideal: Some(|time| force(Vector3::z() * (STIFFNESS * pressed(time).0.max(0.0)))),
        ..scene(
            "box on plane",
            (BOX, [0.0, 0.0, 0.0101], PLANE),
            [SLIDE, 0.0, STIFFNESS * DEPTH],
            0.6,
            |time| {
                let (depth, slid) = pressed(time);
                at(SLIDE * slid, 0.0, SMALL_BALL - depth)
            },
        )
    }
}

/// On a circle about the obstacle's centre, at the depth of [`pressed`]; distance of the centres where they touch.
fn around(time: f64, distance: f64) -> Pose {
    let (depth, slid) = pressed(time);
    let angle = SLIDE * slid / distance;
    let radius = distance - depth;
    at(radius * angle.sin(), 0.0, radius * angle.cos())
}

fn outward(time: f64, distance: f64) -> Vector6 {
    let (depth, slid) = pressed(time);
    let angle = SLIDE * slid / distance;
    force(Vector3::new(angle.sin(), 0.0, angle.cos()) * (STIFFNESS * depth.max(0.0)))
}

fn sphere_on_sphere() -> FidelityScene {
    let obstacle = "shape = { sphere = { radius = 0.02 } }";
    FidelityScene {
        ideal: Some(|time| outward(time, 2.0 * BALL)),
        ..scene(
            "sphere on sphere",
            ("sphere = { radius = 0.02 }", [0.0, 0.0, 0.0401], obstacle),
            [SLIDE, 0.0, STIFFNESS * DEPTH],
            0.6,
            |time| around(time, 2.0 * BALL),
        )
    }
}

fn curved_mesh() -> FidelityScene {
    let obstacle = "shape = { mesh = \"ball.ply\"{simplify} }";
    FidelityScene {
        ideal: Some(|time| outward(time, MESH_BALL + SMALL_BALL)),
        ..scene(
            "curved mesh",
            ("sphere = { radius = 0.01 }", [0.0, 0.0, 0.0401], obstacle),
            [SLIDE, 0.0, STIFFNESS * DEPTH],
            0.6,
            |time| around(time, MESH_BALL + SMALL_BALL),
        )
    }
}

fn peg_in_hole() -> FidelityScene {
    scene(
        "peg in hole",
        (
            "cylinder = { radius = 0.01, half_length = 0.03, facets = 24, axis = \"z\" }",
            [0.0, 0.0, 0.0],
            "shape = { box_with_hole = { half_extents = [0.03, 0.03, 0.03], radius = 0.0105, facets = 24, axis = \"z\" } }",
        ),
        [0.05, 0.5, STIFFNESS * DEPTH],
        0.6,
        // Against the wall, along it, and leaned.
        |time| {
            let on = pressed(time).1;
            let lean = 0.05 * (10.0 * on).sin();
            let aside = share(time) * (5e-4 + DEPTH);
            Pose::from_parts(
                Vector3::new(aside, 1e-3 * (20.0 * on).sin(), 0.02 * on).into(),
                UnitQuaternion::from_axis_angle(&Vector3::y_axis(), lean),
            )
        },
    )
}

fn thin_plate() -> FidelityScene {
    FidelityScene {
        ideal: Some(|time| {
            let depth = (SMALL_BALL - arrival(time)).max(0.0);
            force(Vector3::z() * (STIFFNESS * depth))
        }),
        ..scene(
            "thin plate",
            (
                "sphere = { radius = 0.01 }",
                [0.0, 0.0, 0.1],
                "shape = { box = { half_extents = [0.1, 0.1, 0.0005] } }\npose = { position = [0.0, 0.0, -0.0005] }",
            ),
            [FAST, 0.0, STIFFNESS * (SMALL_BALL - ARRIVED)],
            0.4,
            |time| at(0.0, 0.0, arrival(time)),
        )
    }
}

/// Height of a hand that comes at full speed and stops with the body's middle beneath the plate, m.
fn arrival(time: f64) -> f64 {
    (0.1 - FAST * time).max(ARRIVED)
}

fn moving_plate(rise: f64) -> FidelityScene {
    let plate = "shape = { plane = {} }\nmotion = { trace = \"plate.csv\" }";
    FidelityScene {
        ideal: Some(|time| {
            let height = (PLATE * time - DEPTH).min(DEPTH);
            force(Vector3::z() * (STIFFNESS * (height - ABOVE).max(0.0)))
        }),
        ..scene(
            "moving plate",
            (BOX, [0.0, 0.0, 0.0101], plate),
            [0.01, 0.0, STIFFNESS * (DEPTH - ABOVE)],
            rise + 0.1,
            |_| at(0.0, 0.0, SMALL_BALL + ABOVE),
        )
    }
}

fn rod_on_plane() -> FidelityScene {
    let rod = "box = { half_extents = [0.04, 0.005, 0.005] }";
    scene(
        "turning rod",
        (rod, [0.0, 0.0, 0.0051], PLANE),
        [0.05, TURN, ROD_FORCE],
        0.8,
        // Its end goes down and up again while its middle stays.
        |time| {
            let swing = 0.5 * (TURN / 0.5 * time).sin();
            Pose::from_parts(
                Vector3::new(0.0, 0.0, 0.005 + ROD * 0.1).into(),
                UnitQuaternion::from_axis_angle(&Vector3::y_axis(), swing),
            )
        },
    )
}
