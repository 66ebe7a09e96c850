//! What is pressed where: a ball on a wall, into a corner, and in a hollow, along which the contact turns, there as an exact ball and as a mesh; and a peg
//! against the side of its hole.

use std::f64::consts::FRAC_1_SQRT_2;

use god_object::{Body, Obstacle, Pose, Settings};
use nalgebra::{Point3, Vector3};
use taut_method_tests::solids::{body, mesh, obstacle};
use taut_scene::shapes::{Axis, box_with_hole, cylinder};

use crate::method::Scene;
use crate::recipes::{ball, block, ground};

/// Of the ball, m.
const RADIUS: f64 = 0.01;
/// What presses the device on walls, N.
const PUSH: f64 = 5.0;
/// Disturbance on walls and along the hollow, m.
const DISTURBANCE: f64 = 1e-4;
const DISTURBANCE_ALONG: f64 = 1e-3;
/// Of the hollow: its radius, m, how many facets it has, and half the size of the block that it is in, m. A disturbance is six facets wide.
const HOLLOW: f64 = 0.02;
const FACETS: usize = 360;
const BLOCK: f64 = 0.03;
/// Sides of the peg, which is as round as the ball, and of its hole: corners of the one face the middles of
/// the other's, so that the middle of the peg has
/// a polygon of as many sides to move in, one of them below. Half of the peg's length and clearance, m.
const SIDES: usize = 72;
const PEG: f64 = 0.03;
const CLEARANCE: f64 = 5e-4;
/// Depth in the hollow over the ball's way from its axis. The force points at the axis: along the surface it is a spring of force over distance, so
/// the surface itself is as many times stiffer.
const DEPTH_SHARE: f64 = 0.1;
/// Of force and torque, N and N m: none is in the way.
const LIMIT: f64 = 1e9;

/// What holds the ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Contact {
    /// One wall across z.
    Wall,
    /// Two walls, across x and z.
    Corner,
    /// The inside of a cylinder about y: the ball moves along x, and the normal turns with it.
    Hollow,
    /// The same, and the ball is a mesh of 320 triangles.
    MeshInHollow,
    /// A peg against the side of its hole about y: it moves across the hole, and the normal turns about the
    /// hole's axis.
    PegInHole,
}

/// A ball that is pressed and disturbed.
pub(super) struct Pressed {
    pub(super) scene: Scene,
    /// N.
    pub(super) push: Vector3<f64>,
    /// Where the device is in balance, m.
    pub(super) at_rest: Vector3<f64>,
    /// m.
    pub(super) disturbance: Vector3<f64>,
    /// 1 for each axis that the device moves along.
    pub(super) free: Vector3<f64>,
}

impl Contact {
    /// At rest on a spring of `stiffness`, N/m, along the free axes.
    pub(super) fn pressed(self, stiffness: f64) -> Pressed {
        let (x, z) = (Vector3::x(), Vector3::z());
        let above = RADIUS + DISTURBANCE;
        match self {
            Self::Wall => Pressed {
                scene: scene((ball(RADIUS), vec![ground()]), stiffness, above * z),
                push: -PUSH * z,
                at_rest: (RADIUS - PUSH / stiffness) * z,
                disturbance: -DISTURBANCE * z,
                free: z,
            },
            Self::Corner => {
                let (low, high) = (Point3::new(-0.1, -0.3, -0.3), Point3::new(0.0, 0.3, 0.3));
                let walls = vec![ground(), block("side", low, high)];
                let push = PUSH * FRAC_1_SQRT_2;
                Pressed {
                    scene: scene((ball(RADIUS), walls), stiffness, above * (x + z)),
                    push: -push * (x + z),
                    at_rest: (RADIUS - push / stiffness) * (x + z),
                    disturbance: -DISTURBANCE * (0.8 * x + 0.6 * z),
                    free: x + z,
                }
            }
            Self::PegInHole => {
                let hole = box_with_hole([PEG; 3], RADIUS + CLEARANCE, SIDES, Axis::Y);
                let walls = vec![obstacle("hole", mesh(hole), Pose::identity())];
                let peg = body(mesh(cylinder(RADIUS, PEG, SIDES, Axis::Y)));
                Pressed {
                    scene: scene_of(2.0 * PEG, (peg, walls), stiffness, Vector3::zeros()),
                    push: -PUSH * z,
                    at_rest: -(CLEARANCE + PUSH / stiffness) * z,
                    disturbance: -DISTURBANCE * (0.8 * x + 0.6 * z),
                    free: x + z,
                }
            }
            Self::Hollow | Self::MeshInHollow => {
                let hole = box_with_hole([BLOCK; 3], HOLLOW, FACETS, Axis::Y);
                let walls = vec![obstacle("hollow", mesh(hole), Pose::identity())];
                let down = (HOLLOW - RADIUS) / (1.0 - DEPTH_SHARE);
                let mut body = ball(RADIUS);
                if self == Self::MeshInHollow {
                    body.primitive = None;
                }
                Pressed {
                    scene: scene((body, walls), stiffness / DEPTH_SHARE, Vector3::zeros()),
                    push: -stiffness * down * z,
                    at_rest: -down * z,
                    disturbance: DISTURBANCE_ALONG * x,
                    free: x,
                }
            }
        }
    }
}

fn scene(bodies: (Body, Vec<Obstacle>), stiffness: f64, start: Vector3<f64>) -> Scene {
    scene_of(2.0 * RADIUS, bodies, stiffness, start)
}

/// Of a body of this size, m.
fn scene_of(
    size: f64,
    (body, obstacles): (Body, Vec<Obstacle>),
    stiffness: f64,
    start: Vector3<f64>,
) -> Scene {
    let mut scene = Scene::new(body, obstacles, size, 0.1, Pose::from(start));
    let mass = scene.world.body.mass;
    scene.settings = Settings {
        k_h: stiffness / (scene.settings.k_s * mass),
        force_limit: LIMIT,
        torque_limit: LIMIT,
        adaptation: None,
        ..scene.settings
    };
    scene
}
