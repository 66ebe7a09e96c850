//! Scenes to measure: a world, where the body starts, and a hand.
#![allow(dead_code, reason = "each bench uses its own part")]

use std::sync::Arc;

use god_object::geometry::mass_properties;
use god_object::nalgebra::Vector3;
use god_object::{Body, Mesh, Obstacle, Pose, Settings, Surface, World};

use crate::geometry_shapes::{cuboid, fine_hole, fine_peg, grid_box, hole, mesh, peg, read_ply};
use taut_test_kit::SlidingHand;

/// A scene by name.
pub(crate) const NAMES: [&str; 4] = [
    "peg 288 in hole 280",
    "bunnies 27,000",
    "peg 27,000 in hole 27,000",
    "box on 10,000 triangles",
];
const BUNNIES: usize = 1;

/// What a bench runs.
pub(crate) struct Scene {
    pub(crate) world: Arc<World>,
    pub(crate) settings: Settings,
    pub(crate) start: Pose,
    hand: Guide,
}

/// A closed path in time, or a hand that answers to the body.
enum Guide {
    Path(fn(f64) -> Pose),
    Sliding(Box<SlidingHand>),
}

/// The scenes that can be built here: the bunnies need test data.
pub(crate) fn names() -> Vec<&'static str> {
    let bunnies = read_ply("bunny_27k.ply").is_some();
    (0..NAMES.len())
        .filter(|k| bunnies || *k != BUNNIES)
        .map(|k| NAMES[k])
        .collect()
}

impl Scene {
    pub(crate) fn named(name: &str) -> Self {
        let which = NAMES.iter().position(|n| *n == name);
        match which.expect("a scene's name") {
            0 => Self::of(
                mesh(peg(10e-3, 30e-3, 72)),
                // 35 sides, 0.5 mm of clearance at their middles.
                mesh(hole(
                    10.5e-3 / (std::f64::consts::PI / 35.0).cos(),
                    30e-3,
                    30e-3,
                    35,
                )),
                0.06,
                Guide::Path(in_hole),
            ),
            BUNNIES => {
                let bunny = mesh(read_ply("bunny_27k.ply").expect("listed when it is there"));
                let hand = SlidingHand::new(Pose::translation(0.2, 0.02, 0.0), 1);
                Self::of(bunny.clone(), bunny, 0.15, Guide::Sliding(Box::new(hand)))
            }
            2 => Self::of(
                mesh(fine_peg(10e-3, 30e-3, 120, 112)),
                mesh(fine_hole(10.5e-3, 30e-3, 25e-3, 120, 109)),
                0.06,
                Guide::Path(in_hole),
            ),
            _ => Self::of(
                mesh(cuboid([0.02, 0.015, 0.01])),
                mesh(grid_box([0.1, 0.1, 0.01], [71, 71, 1])),
                0.04,
                Guide::Path(over_plane),
            ),
        }
    }

    fn of(body: Mesh, obstacle: Mesh, size: f64, hand: Guide) -> Self {
        let solid = mass_properties(&body);
        let start = match &hand {
            Guide::Path(path) => path(0.0),
            Guide::Sliding(hand) => hand.pose,
        };
        Self {
            world: Arc::new(World {
                body: Body {
                    primitive: None,
                    mesh: body,
                    mass: 1.0,
                    inertia: solid.inertia_per_density / solid.volume,
                    reference_point: solid.centroid,
                },
                obstacles: vec![Obstacle {
                    primitive: None,
                    name: "obstacle".into(),
                    mesh: obstacle,
                    pose: Pose::identity(),
                    surface: Surface::default(),
                }],
            }),
            settings: Settings::for_size(size),
            start,
            hand,
        }
    }

    /// Where the hand is at update `k`, a millisecond each.
    pub(crate) fn device(&mut self, k: u32, body: &Pose) -> Pose {
        match &mut self.hand {
            Guide::Path(path) => path(1e-3 * f64::from(k)),
            Guide::Sliding(hand) => hand.next(body),
        }
    }
}

/// In the hole, along z: pressed to the side by 2 mm all around, turned, slid along, tilted.
fn in_hole(t: f64) -> Pose {
    let in_contact = (10.0 * t).min(1.0);
    Pose::new(
        Vector3::new(2e-3 * (5.0 * t).cos(), 2e-3 * (5.0 * t).sin(), 0.0) * in_contact
            + Vector3::z() * (0.01 * (1.3 * t).sin()),
        Vector3::new(
            0.02 * (3.0 * t).sin(),
            0.02 * (2.0 * t).sin(),
            0.3 * (0.7 * t).sin(),
        ),
    )
}

/// Over the plate whose upper face is z = 10 mm: pressed in by 4 mm, slid about, tilted now and then.
fn over_plane(t: f64) -> Pose {
    let height = 0.016 + 0.006 * (1.0 - 10.0 * t).max(0.0);
    Pose::new(
        Vector3::new(0.06 * (1.1 * t).sin(), 0.06 * (1.7 * t).sin(), height),
        Vector3::new(0.0, 0.3 * (2.0 * t).sin().max(0.0), 0.5 * t),
    )
}
