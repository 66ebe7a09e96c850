//! A variant as a world, settings and the path of a hand, all from its seed.

use std::f64::consts::TAU;
use std::sync::Arc;

use god_object::{ForceShading, Mesh, Obstacle, Pose, Primitive, Settings, Surface, World};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use taut_scene::RawMesh;

use super::shapes::{Tessellation, bore, plate, rough, shaft};
use super::{Feel, Fit, Motion, Moving, Variant};
use crate::hand::Random;
use crate::solids::{body, mesh, obstacle};

/// Radius of shafts, m.
const RADIUS: f64 = 10e-3;
/// Half the length of a shaft and of its hole, m.
const HALF_SHAFT: f64 = 30e-3;
const HALF_HOLE: f64 = 25e-3;
/// Half the length of a bore that the shaft stands out of, m.
const HALF_BORE: f64 = 15e-3;
/// Half sides of a plate, m.
const PLATE: [f64; 3] = [50e-3, 40e-3, 5e-3];
/// How far below the peg its end stop lies, m.
const STOP_BELOW: f64 = 1e-3;
/// How deep the hand presses, m.
const PRESS: f64 = 1e-3;
/// Roughness moves two surfaces towards each other by up to so many times itself.
const ROUGH_SHARE: f64 = 3.0;
/// Time in which the hand begins to press, s.
const RAMP: f64 = 0.05;
/// A part that moves does so with this amplitude (m) and period (s).
const MOVED: f64 = 1e-4;
const MOVED_PERIOD: f64 = 0.3;
/// One cell for each side of a plate.
const COARSE: Tessellation = Tessellation {
    facets: 12,
    bands: 1,
};

/// A variant that is ready to run.
#[derive(Debug)]
pub struct VariantScene {
    /// Body and obstacles.
    pub world: Arc<World>,
    /// Without ramps and limits: the force is that of the set.
    pub settings: Settings,
    /// World from the frame in which the fit is made.
    pub frame: Pose,
    /// Where the body starts, world from body.
    pub start: Pose,
    /// Which obstacle moves, and where it is at rest.
    moved: Option<(usize, Pose)>,
    fit: Fit,
    motion: Motion,
}

impl VariantScene {
    /// Makes the meshes.
    pub fn new(variant: &Variant) -> Self {
        let mut random = Random(variant.seed);
        let place = Vector3::from_fn(|_, _| random.unit() - 0.5);
        let frame = Pose::from_parts(place.into(), random.rotation());
        let Parts {
            held,
            start,
            size,
            mut obstacles,
        } = match variant.fit {
            Fit::PegInHole | Fit::ShaftInBore => Parts::of_shaft(variant, frame),
            Fit::PlateInSlot | Fit::PlateOnTable | Fit::PlateOnHalfSpace => {
                Parts::of_plate(variant, frame)
            }
        };
        let surface = surface(variant.feel);
        obstacles
            .iter_mut()
            .for_each(|o| o.surface = surface.clone());
        if variant.floor {
            obstacles.push(floor(&frame));
        }
        let moving = match variant.moving {
            Moving::Nothing => None,
            Moving::Holder => Some(0),
            Moving::Aside => {
                obstacles.push(aside(&frame));
                Some(obstacles.len() - 1)
            }
        };
        let moved = moving.map(|index| (index, obstacles[index].pose));
        let settings = Settings {
            adaptation: None,
            force_limit: 1e3,
            torque_limit: 1e3,
            ..Settings::for_size(size).with_clearance(variant.clearance)
        };
        Self {
            world: Arc::new(World {
                body: body(held),
                obstacles,
            }),
            settings,
            frame,
            start,
            moved,
            fit: variant.fit,
            motion: variant.motion,
        }
    }

    /// Where the obstacle that moves is to be at `time`, s: its index and world from obstacle.
    pub fn moved(&self, time: f64) -> Option<(usize, Pose)> {
        self.moved.map(|(index, rest)| {
            let along = self.frame.rotation * Vector3::x();
            let by = along * (MOVED * (TAU * time / MOVED_PERIOD).sin());
            (
                index,
                Pose::from_parts((rest.translation.vector + by).into(), rest.rotation),
            )
        })
    }

    /// World from device at `time`, s.
    pub fn device(&self, time: f64) -> Pose {
        let (moved, turned) = match self.fit {
            Fit::PegInHole | Fit::ShaftInBore => in_hole(self.motion, time),
            Fit::PlateInSlot | Fit::PlateOnTable | Fit::PlateOnHalfSpace => {
                on_plate(self.motion, time)
            }
        };
        let start = self.frame.inverse() * self.start;
        let rotation = UnitQuaternion::from_scaled_axis(turned);
        self.frame * Pose::from_parts((start.translation.vector + moved).into(), rotation)
    }
}

/// What is held, with its start and size (m), and what it fits.
struct Parts {
    held: Mesh,
    start: Pose,
    size: f64,
    obstacles: Vec<Obstacle>,
}

impl Parts {
    fn of_shaft(variant: &Variant, frame: Pose) -> Self {
        let is_peg = variant.fit == Fit::PegInHole;
        let half = if is_peg { HALF_HOLE } else { HALF_BORE };
        let play = play(variant);
        let hole = bore(RADIUS, play, half, variant.obstacle, variant.turned);
        let mut obstacles = vec![obstacle("hole", noisy(variant, hole, 1), frame)];
        if is_peg {
            let stop = plate([15e-3, 15e-3, 2e-3], COARSE, 0.0);
            let below = Pose::translation(0.0, 0.0, -HALF_SHAFT - STOP_BELOW - 4e-3);
            obstacles.push(obstacle("stop", mesh(stop), frame * below));
        }
        let peg = shaft(RADIUS, HALF_SHAFT, variant.body, variant.crown);
        Self {
            held: noisy(variant, peg, 0),
            start: frame,
            size: 2.0 * HALF_SHAFT,
            obstacles,
        }
    }

    fn of_plate(variant: &Variant, frame: Pose) -> Self {
        let at = |z: f64| frame * Pose::translation(0.0, 0.0, z);
        let table = plate([0.1, 0.1, 10e-3], variant.obstacle, 0.0);
        let below = noisy(variant, table.clone(), 1);
        let mut obstacles = vec![obstacle("table", below, at(-20e-3))];
        if variant.fit == Fit::PlateInSlot {
            let over = 2.0 * (PLATE[2] + play(variant));
            obstacles.push(obstacle("cover", noisy(variant, table, 2), at(over)));
        }
        if variant.fit == Fit::PlateOnHalfSpace {
            obstacles[0].primitive = Some(Primitive::Plane {
                normal: Vector3::z(),
                point: Point3::new(0.0, 0.0, 20e-3),
            });
        }
        let moved = plate(PLATE, variant.body, variant.crown);
        Self {
            held: noisy(variant, moved, 0),
            start: at(play(variant)),
            size: 2.0 * PLATE[0],
            obstacles,
        }
    }
}

/// Between the parts when nothing presses, m.
fn play(variant: &Variant) -> f64 {
    variant.clearance + ROUGH_SHARE * variant.roughness
}

/// `which`: the part of the variant, of which each is rough in its own way.
fn noisy(variant: &Variant, raw: RawMesh, which: u64) -> Mesh {
    mesh(rough(raw, variant.roughness, 10 * variant.seed + which))
}

fn surface(feel: Feel) -> Surface {
    match feel {
        Feel::Plain => Surface::default(),
        Feel::Friction => Surface {
            friction: 0.1,
            ..Surface::default()
        },
        Feel::Shading => Surface {
            shading: Some(ForceShading { crease_angle: 0.3 }),
            ..Surface::default()
        },
    }
}

/// A half-space a metre below.
fn floor(frame: &Pose) -> Obstacle {
    let slab = mesh(plate([0.5, 0.5, 0.01], COARSE, 0.0));
    let pose = frame * Pose::translation(0.0, 0.0, -1.0);
    Obstacle {
        primitive: Some(Primitive::Plane {
            normal: Vector3::z(),
            point: Point3::new(0.0, 0.0, 0.02),
        }),
        ..obstacle("floor", slab, pose)
    }
}

/// A part that is out of the way.
fn aside(frame: &Pose) -> Obstacle {
    let pose = frame * Pose::translation(0.2, 0.1, 0.0);
    obstacle("aside", mesh(plate([5e-3; 3], COARSE, 0.0)), pose)
}

/// A sine of time with this period, s.
fn wave(time: f64, period: f64) -> f64 {
    (TAU * time / period).sin()
}

/// Displacement (m) and rotation vector of a hand that holds a shaft in a hole.
fn in_hole(motion: Motion, t: f64) -> (Vector3<f64>, Vector3<f64>) {
    let ramp = (t / RAMP).min(1.0);
    let aside =
        |size: f64, direction: f64| Vector3::new(direction.cos(), direction.sin(), 0.0) * size;
    let down = |z: f64| Vector3::new(0.0, 0.0, z);
    let tilt = Vector3::new(3e-3, 2e-3, 0.0);
    match motion {
        Motion::Rest => (aside(PRESS * ramp, 0.4) + down(-1.5e-3 * ramp), tilt * ramp),
        Motion::Slide => {
            let z = (5e-3 * wave(t, 0.2)).max(-1.5e-3);
            (
                aside(PRESS * ramp, 0.4 + 2.0 * t) + down(z),
                tilt * wave(t, 0.31),
            )
        }
        Motion::Turn => {
            let turn = Vector3::z() * (2.0 * t);
            (
                aside(PRESS * ramp, 0.4 + 3.0 * t),
                turn + tilt * wave(t, 0.17),
            )
        }
        Motion::Land => {
            let z = -1.5e-3 * wave(t, 0.13).max(0.0);
            (
                aside(PRESS * wave(t, 0.1), 0.4 + t) + down(z),
                tilt * wave(t, 0.09),
            )
        }
    }
}

/// The same of one that holds a plate.
fn on_plate(motion: Motion, t: f64) -> (Vector3<f64>, Vector3<f64>) {
    let ramp = (t / RAMP).min(1.0);
    let tilt = Vector3::new(2e-3, 1e-3, 0.0);
    let pressed = Vector3::new(3e-4, 0.0, -PRESS) * ramp;
    match motion {
        Motion::Rest => (pressed, tilt * ramp),
        Motion::Slide => {
            let along = Vector3::new(20e-3, 11e-3, 0.0) * wave(t, 0.4);
            (pressed + along, tilt * wave(t, 0.31))
        }
        Motion::Turn => (pressed, Vector3::z() * (2.0 * t) + tilt * wave(t, 0.17)),
        Motion::Land => {
            let z = PRESS * wave(t + 0.05, 0.1);
            (
                Vector3::new(5e-3 * wave(t, 0.4), 0.0, z),
                tilt * wave(t, 0.09),
            )
        }
    }
}
