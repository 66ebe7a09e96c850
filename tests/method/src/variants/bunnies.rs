//! One bunny that a hand slides over another.

use std::sync::Arc;

use god_object::{GodObject, Mesh, Pose, Settings, World};
use nalgebra::Vector3;
use taut_scene::{data_file, read_mesh};
use taut_test_kit::{SlidingHand, subdivided};

use super::oracle::Oracle;
use crate::solids::{body, obstacle};

/// Size of a bunny, m.
const SIZE: f64 = 0.15;
/// Updates before the body has come to the obstacle.
const APPROACH: usize = 60;
/// Every so many sets are held against the oracle.
const ERROR_STRIDE: usize = 5;
/// Each hand whose sets are compared makes a half of the slide's updates.
const ERROR_SHARE: usize = 2;

/// How a hand slides a bunny.
#[derive(Clone, Copy, Debug)]
pub struct Slide {
    /// Its name in tables.
    pub name: &'static str,
    /// Shortest and longest step of the hand, m.
    pub step: [f64; 2],
    /// Updates in contact.
    pub updates: usize,
    /// Each makes four triangles of one of 27,000.
    pub subdivisions: u32,
}

/// The slides that are measured.
pub const SLIDES: [Slide; 3] = [
    Slide {
        name: "bunnies",
        step: [0.3e-3, 1.4e-3],
        updates: 2500,
        subdivisions: 0,
    },
    Slide {
        name: "bunnies-fast",
        step: [0.5e-3, 3e-3],
        updates: 2500,
        subdivisions: 0,
    },
    Slide {
        name: "bunnies-1.7M",
        step: [0.5e-3, 3e-3],
        updates: 120,
        subdivisions: 3,
    },
];

/// A bunny of the test data; `None` where it is not there.
pub fn load(name: &str) -> Option<Mesh> {
    let raw = read_mesh(&data_file(name)?).ok()?;
    Mesh::new(raw.vertices, raw.triangles).ok()
}

impl Slide {
    /// Two of these bunnies, as dense as the slide asks for.
    pub fn world(&self, bunny: &Mesh) -> Arc<World> {
        let soup = (bunny.vertices().to_vec(), bunny.triangles().to_vec());
        let (vertices, triangles) = subdivided(&soup, self.subdivisions);
        let mesh = Mesh::new(vertices, triangles).expect("a subdivided bunny is closed");
        Arc::new(World {
            body: body(mesh.clone()),
            obstacles: vec![obstacle("bunny", mesh, Pose::identity())],
        })
    }

    /// Of each update in contact the time, in the unit of `clock`, and what its work would take on a nominal machine, us.
    pub fn times(&self, world: &Arc<World>, clock: impl Fn() -> f64) -> [Vec<f64>; 2] {
        let (mut times, mut works) = (Vec::new(), Vec::new());
        self.lead(world, 1, self.updates, |k, god_object, device| {
            let before = clock();
            let report = god_object.step(device, None);
            if k >= APPROACH {
                times.push(clock() - before);
                works.push(report.work.nominal_us() as f64);
            }
        });
        [times, works]
    }

    /// How far every fifth set of so many hands is from what all pairs say, for the device one step on; see [`Difference`](super::oracle::Difference).
    /// The worst percent of one hand is a few sets, and hands differ in it by far.
    pub fn errors(&self, world: &Arc<World>, hands: u64) -> Vec<f64> {
        let mut oracle = Oracle::default();
        let mut errors = Vec::new();
        for hand in 1..=hands {
            self.lead(
                world,
                hand,
                self.updates / ERROR_SHARE,
                |k, god_object, device| {
                    if k > APPROACH && k % ERROR_STRIDE == 0 {
                        errors.push(oracle.compare(world, god_object, device).relative);
                    }
                    god_object.step(device, None);
                },
            );
        }
        errors
    }

    /// Calls `step` with each pose of the device in the hand of a seed, which answers to the body.
    fn lead(
        &self,
        world: &Arc<World>,
        seed: u64,
        updates: usize,
        mut step: impl FnMut(usize, &mut GodObject, &Pose),
    ) {
        let start = Pose::new(Vector3::new(0.16, 0.02, 0.0), Vector3::new(0.0, 2.0, 0.0));
        let settings = Settings::for_size(SIZE);
        let mut god_object =
            GodObject::new(Arc::clone(world), settings, start).expect("apart at the start");
        let mut hand = SlidingHand::new(start, seed, self.step);
        for k in 0..APPROACH + updates {
            let device = hand.next(god_object.pose());
            step(k, &mut god_object, &device);
        }
    }
}
