//! Friction on obstacles that move, in many variants: sizes, tessellations, loads, directions, rates of updates, rows that are chosen, re-linearised
//! or of exact shapes, and textures with it.
//!
//! 16 of each, or as many as are asked for: `PROPTEST_CASES=500 cargo test --release -p god-object --test all moving_friction_variants::`.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use crate::geometry_shapes::{grid_box, mesh};
use crate::support::box_body;
use god_object::nalgebra::{Point3, UnitQuaternion, Vector3};
use god_object::spatial::{linear, pose_difference};
use god_object::{
    Body, Coupling, GodObject, Obstacle, Pose, Primitive, Settings, SineTexture, Surface, Texture,
    Vector6, World,
};
use proptest::prelude::*;

/// N/m, of a body of 1 kg.
const STIFFNESS: f64 = 1000.0;
/// The plate is so many times as wide as the body.
const PLATE: f64 = 6.0;

/// A block that is pressed on a plate whose upper face is at z = 0.
#[derive(Clone, Copy, Debug)]
struct Variant {
    /// Half the width of the block, m; it is half as high.
    half: f64,
    /// Cells along the sides of block and plate.
    cells: [usize; 2],
    /// Direction of the plate's way, rad.
    heading: f64,
    /// How the plate lies about the z axis, rad.
    turned: f64,
    friction: f64,
    /// Hz.
    rate: f64,
    /// The plate is a half-space.
    exact: bool,
    rounds: u32,
    /// m.
    depth: f64,
    /// Tangent of the largest tilt of the texture.
    texture: f64,
}

fn variants() -> impl Strategy<Value = Variant> {
    let rates = prop::sample::select(vec![1000.0, 300.0, 70.0]);
    let rounds = prop::sample::select(vec![0_u32, 1, 3]);
    let shape = (5e-3..80e-3_f64, [1..6_usize, 1..9], 0.0..TAU, 0.0..TAU);
    let feel = (0.02..1.0_f64, 1e-3..8e-3_f64, 0.0..0.3_f64);
    (shape, feel, rates, rounds, any::<bool>()).prop_map(
        |((half, cells, heading, turned), (friction, depth, texture), rate, rounds, exact)| {
            Variant {
                half,
                cells,
                heading,
                turned,
                friction,
                rate,
                exact,
                rounds,
                depth,
                texture,
            }
        },
    )
}

impl Variant {
    fn size(&self) -> f64 {
        2.0 * self.half
    }

    fn height(&self) -> f64 {
        0.5 * self.half
    }

    fn body(&self) -> Body {
        let half = Vector3::new(self.half, self.half, self.height());
        Body {
            mesh: mesh(grid_box(half.into(), [self.cells[0], self.cells[0], 1])),
            ..box_body(half)
        }
    }

    fn world(&self, textured: bool) -> Arc<World> {
        let half = [PLATE * self.half, PLATE * self.half, self.height()];
        let sine = SineTexture {
            axis: Vector3::x(),
            wavelength: 0.1 * self.half,
            amplitude: self.texture,
        };
        let plane = Primitive::Plane {
            normal: Vector3::z(),
            point: Point3::new(0.0, 0.0, self.height()),
        };
        let plate = Obstacle {
            name: "plate".into(),
            mesh: mesh(grid_box(half, [self.cells[1], self.cells[1], 1])),
            primitive: self.exact.then_some(plane),
            pose: self.plate(0.0),
            surface: Surface {
                friction: self.friction,
                texture: textured.then_some(Texture::Sine(sine)),
                ..Surface::default()
            },
        };
        Arc::new(World {
            body: self.body(),
            obstacles: vec![plate],
        })
    }

    fn settings(&self) -> Settings {
        Settings {
            implicit_rounds: self.rounds,
            force_limit: 1e3,
            torque_limit: 1e3,
            ..Settings::for_size(self.size())
        }
    }

    /// How far the set that is in use may be behind the plate, s: an update, until the first that moved has told the speed.
    fn late(&self) -> f64 {
        2.0 / self.rate
    }

    fn along(&self) -> Vector3<f64> {
        Vector3::new(self.heading.cos(), self.heading.sin(), 0.0)
    }

    /// World from plate when it has gone so far, m.
    fn plate(&self, gone: f64) -> Pose {
        let place = self.along() * gone - Vector3::z() * self.height();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * self.turned);
        Pose::from_parts(place.into(), turn)
    }

    /// A hand so far along the plate's way, and above where the block would touch, m.
    fn hand(&self, along: f64, above: f64) -> Pose {
        let place = self.along() * along + Vector3::z() * (self.height() + above);
        Pose::from_parts(place.into(), UnitQuaternion::identity())
    }
}

/// Both loops.
struct Bench {
    variant: Variant,
    god_object: GodObject,
    coupling: Coupling,
    next: f64,
    time: f64,
}

impl Bench {
    /// Above the plate.
    fn new(variant: &Variant, textured: bool) -> Self {
        let (world, settings) = (variant.world(textured), variant.settings());
        let start = variant.hand(0.0, variant.depth);
        Self {
            variant: *variant,
            coupling: Coupling::new(&world, &settings),
            god_object: GodObject::new(world, settings, start).expect("a free start"),
            next: 0.0,
            time: 0.0,
        }
    }

    /// A millisecond: what updates are due, with the plate as far as `gone` (m) says at their time, and a force.
    fn tick(&mut self, device: &Pose, gone: impl Fn(f64) -> f64) -> Vector6 {
        self.time += 1e-3;
        while self.next <= self.time {
            let plate = self.variant.plate(gone(self.next));
            self.god_object.move_obstacle(0, &plate);
            let report = self.god_object.step(device, None);
            assert!(!report.rejected && report.solver_failures == 0);
            self.god_object.note_published(self.next);
            self.coupling.place_obstacle(0, &plate);
            self.next += 1.0 / self.variant.rate;
        }
        let set = self.god_object.constraint_set();
        self.coupling.step(self.time, device, set).wrench
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 16, failure_persistence: None, ..ProptestConfig::default() })]

    /// min(k v t, mu N); a texture tilts it, and keeps how large it is.
    #[test]
    fn a_hand_at_rest_feels_how_far_the_plate_has_gone_and_no_more_than_friction_holds(
        variant in variants(),
        speed in 0.01..0.1_f64,
    ) {
        let mut benches = [Bench::new(&variant, false), Bench::new(&variant, true)];
        let press = |tick: u32| variant.depth * (1.0 - f64::from(tick) / 100.0).max(-1.0);
        for tick in 0..600 {
            let device = variant.hand(0.0, press(tick));
            benches.iter_mut().for_each(|bench| { bench.tick(&device, |_| 0.0); });
        }
        let device = variant.hand(0.0, -variant.depth);
        let begun = benches[0].time;
        let load = STIFFNESS * (variant.depth + variant.settings().rest_distance);
        for _ in 0..150 {
            let gone = |time: f64| speed * (time - begun).max(0.0);
            let [plain, textured] = benches.each_mut().map(|bench| bench.tick(&device, gone));
            let force = linear(&plain);
            let gone = gone(benches[0].time);
            let most = (STIFFNESS * gone).min(variant.friction * force.z);
            let least = (STIFFNESS * (gone - speed * variant.late())).min(0.98 * variant.friction * force.z);
            let felt = force.dot(&variant.along());
            let slack = 0.01 * load;
            prop_assert!(
                felt > least - slack && felt < most + slack,
                "{gone} m: {felt} N of {least} to {most} N"
            );
            let across = force - variant.along() * felt - Vector3::z() * force.z;
            prop_assert!(across.norm() < slack && (force.z - load).abs() < slack, "{force}");
            let kept = linear(&textured).norm() - force.norm();
            prop_assert!(kept.abs() < 1e-6 * load, "{kept} N by the texture");
        }
    }

    /// The hand goes down, to and fro on a plate that goes to and fro, and up again to where it was.
    #[test]
    fn a_hand_on_a_plate_gets_no_more_energy_than_the_plate_gives(
        variant in variants(),
        ways in [-1.0..1.0_f64, -1.0..1.0],
        turns in [1..4_u32, 1..4],
    ) {
        let mut bench = Bench::new(&variant, false);
        let (ticks, duration) = (2000, 2.0);
        let amplitude = 2.0 * variant.depth;
        let wave = |k: usize, share: f64| {
            amplitude * ways[k] * (TAU * f64::from(turns[k]) * share.clamp(0.0, 1.0)).sin()
        };
        let share = |time: f64| time / duration;
        let (mut given, mut exchanged) = (0.0, 0.0);
        let mut last: Option<(Pose, Vector6)> = None;
        for _ in 0..ticks {
            let now = share(bench.time + 1e-3);
            let ramp = (FRAC_PI_2 * (10.0 * now.min(1.0 - now)).clamp(0.0, 1.0)).sin();
            let device = variant.hand(wave(0, now), variant.depth * (1.0 - 2.0 * ramp));
            let felt = bench.tick(&device, |time| wave(1, share(time)));
            if let Some((pose, wrench)) = last {
                let moved = pose_difference(&device, &pose, &Vector3::zeros());
                let work = 0.5 * (felt + wrench).dot(&moved);
                given += work;
                exchanged += work.abs();
            }
            last = Some((device, felt));
        }
        // Where hand and plate turn back on each other, a late set has friction against the way before: twice what friction holds, along what
        // is gone with the speed that comes in that time. The work is that of a force that is sampled finely, not of a held one.
        let acceleration: f64 = [0, 1]
            .map(|k| ways[k].abs() * (TAU * f64::from(turns[k]) / duration).powi(2))
            .iter()
            .sum();
        let way = 0.5 * amplitude * acceleration * variant.late().powi(2);
        let reversals = f64::from(2 * (turns[0] + turns[1]));
        let held = variant.friction * STIFFNESS * variant.depth;
        let bound = 1e-3 * exchanged + reversals * 2.0 * held * way;
        let by_plate = bench.coupling.obstacle_work();
        prop_assert!(
            given <= by_plate + bound,
            "{given} J, {by_plate} J of them by the plate, of {exchanged} J"
        );
    }
}
