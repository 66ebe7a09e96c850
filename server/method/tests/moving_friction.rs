//! Friction on obstacles that move: they carry along what is pressed on them, as far as friction holds, at any rate of updates.

use std::sync::Arc;

use crate::support::{box_body, box_obstacle};
use god_object::nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use god_object::{Body, Coupling, GodObject, Obstacle, Pose, Primitive, Settings, Vector6, World};

const HALF_HEIGHT: f64 = 0.01;
const STIFFNESS: f64 = 1000.0;
/// The hand's depth below the face of the plate, m: a load of 4 N.
const DEPTH: f64 = 4e-3;
const RATES: [f64; 3] = [1000.0, 300.0, 70.0];

/// What is pressed on what: meshes, whose rows are chosen; with rows re-linearised; exact shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pair {
    Meshes,
    MeshesWithRounds,
    BlockOnHalfSpace,
    BallOnHalfSpace,
}

impl Pair {
    const ALL: [Self; 4] = [
        Self::Meshes,
        Self::MeshesWithRounds,
        Self::BlockOnHalfSpace,
        Self::BallOnHalfSpace,
    ];
    /// Moment of inertia of the ball, kg m^2, mass 1 kg; it rolls where it sticks.
    const INERTIA: f64 = 4e-5;

    fn body(self) -> Body {
        let block = box_body(Vector3::new(0.02, 0.02, HALF_HEIGHT));
        if self != Self::BallOnHalfSpace {
            return block;
        }
        Body {
            primitive: Some(Primitive::Sphere {
                center: Point3::origin(),
                radius: HALF_HEIGHT,
            }),
            inertia: Matrix3::identity() * Self::INERTIA,
            ..block
        }
    }

    fn obstacle(self, friction: f64) -> Obstacle {
        let half = Vector3::new(0.2, 0.2, 0.005);
        let mut plate = box_obstacle("plate", half, Vector3::new(0.0, 0.0, -0.005));
        plate.surface.friction = friction;
        if matches!(self, Self::BlockOnHalfSpace | Self::BallOnHalfSpace) {
            plate.primitive = Some(Primitive::Plane {
                normal: Vector3::z(),
                point: Point3::new(0.0, 0.0, 0.005),
            });
        }
        plate
    }

    /// Force along the plate for each metre that a contact which sticks is carried, N/m: a ball gives way by rolling, too.
    fn stiffness(self) -> f64 {
        let rolls = HALF_HEIGHT * HALF_HEIGHT / Self::INERTIA;
        match self {
            Self::BallOnHalfSpace => STIFFNESS / (1.0 + rolls),
            _ => STIFFNESS,
        }
    }
}

/// What a hand presses on a plate, whose upper face is at z = 0 and which is sent somewhere in every update.
struct Bench {
    god_object: GodObject,
    coupling: Coupling,
    period: f64,
    next: f64,
    time: f64,
}

impl Bench {
    /// Pressed, and at rest.
    fn pressed(pair: Pair, friction: f64, rate: f64, passive: bool) -> Self {
        let world = Arc::new(World {
            body: pair.body(),
            obstacles: vec![pair.obstacle(friction)],
        });
        let rounds = if pair == Pair::Meshes { 0 } else { 3 };
        let settings = Settings {
            passive,
            implicit_rounds: rounds,
            ..Settings::for_size(0.04)
        };
        let start = Pose::translation(0.0, 0.0, HALF_HEIGHT + 1e-4);
        let mut bench = Self {
            coupling: Coupling::new(&world, &settings),
            god_object: GodObject::new(world, settings, start).expect("a free start"),
            period: 1.0 / rate,
            next: 0.0,
            time: 0.0,
        };
        for tick in 0..600 {
            let depth = DEPTH * (f64::from(tick) / 200.0).min(1.0);
            bench.tick(&hand(0.0, depth), |_| at(0.0));
        }
        bench
    }

    /// A millisecond: what updates are due, with the plate where `plate` has it at their time, and a force.
    fn tick(&mut self, device: &Pose, plate: impl Fn(f64) -> Pose) -> Vector6 {
        self.time += 1e-3;
        while self.next <= self.time {
            self.god_object.move_obstacle(0, &plate(self.next));
            let report = self.god_object.step(device, None);
            assert!(!report.rejected && report.solver_failures == 0);
            self.god_object.note_published(self.next);
            self.next += self.period;
        }
        let set = self.god_object.constraint_set();
        self.coupling.step(self.time, device, set).wrench
    }
}

fn hand(x: f64, depth: f64) -> Pose {
    Pose::translation(x, 0.0, HALF_HEIGHT - depth)
}

fn at(x: f64) -> Pose {
    Pose::translation(x, 0.0, -0.005)
}

#[test]
fn a_plate_takes_along_what_is_pressed_on_it_until_friction_gives_way() {
    let cases = Pair::ALL
        .into_iter()
        .flat_map(|pair| RATES.map(|rate| (pair, rate)));
    for (pair, rate) in cases {
        for friction in [0.1, 0.5, 0.0] {
            let mut bench = Bench::pressed(pair, friction, rate, false);
            let (begun, speed, stiffness) = (bench.time, 0.05, pair.stiffness());
            for _ in 0..100 {
                let plate = |time: f64| at(speed * (time - begun).max(0.0));
                let felt = bench.tick(&hand(0.0, DEPTH), plate);
                // An update late, until the first that moved has told the speed.
                let gone = speed * (bench.time - begun);
                let late = speed * 2.0 * bench.period;
                let most = (stiffness * gone).min(friction * felt[2]);
                let least = (stiffness * (gone - late)).min(0.98 * friction * felt[2]);
                assert!(
                    felt[0] > least - 0.02 && felt[0] < most + 0.02,
                    "{pair:?}, {rate} Hz, mu {friction}, {gone} m: {} N of {least} to {most} N",
                    felt[0]
                );
                let load = STIFFNESS * DEPTH;
                assert!(
                    felt[1].abs() < 1e-3 && (felt[2] - load).abs() < 0.05,
                    "{felt}"
                );
            }
        }
    }
}

#[test]
fn what_sticks_is_where_the_plate_has_taken_it_when_the_plate_stops() {
    let blocks = [Pair::Meshes, Pair::MeshesWithRounds, Pair::BlockOnHalfSpace];
    for (pair, rate) in blocks
        .into_iter()
        .flat_map(|pair| RATES.map(|rate| (pair, rate)))
    {
        let mut bench = Bench::pressed(pair, 0.5, rate, false);
        let begun = bench.time;
        // 1.5 mm there at 0.03 m/s, half of it back, and rest: 1.5 N of the 2 N that friction holds, 0.75 N at the end.
        let place = |t: f64| match t {
            t if t < 0.05 => 0.03 * t.max(0.0),
            t if t < 0.1 => 1.5e-3,
            t if t < 0.125 => 1.5e-3 - 0.03 * (t - 0.1),
            _ => 0.75e-3,
        };
        for (until, rests_at) in [(0.1, 1.5e-3), (0.3, 0.75e-3)] {
            let mut felt = Vector6::zeros();
            while bench.time < begun + until - 1e-4 {
                felt = bench.tick(&hand(0.0, DEPTH), |time| at(place(time - begun)));
            }
            let body = bench.god_object.pose().translation.x;
            assert!(
                (body - rests_at).abs() < 2e-5,
                "{pair:?}, {rate} Hz: the body is at {body}"
            );
            let expected = STIFFNESS * rests_at;
            assert!(
                (felt[0] - expected).abs() < 0.02,
                "{pair:?}, {rate} Hz: {} N, not {expected} N",
                felt[0]
            );
        }
    }
}

#[test]
fn a_plate_that_turns_turns_what_is_pressed_on_it() {
    for rate in RATES {
        let mut bench = Bench::pressed(Pair::Meshes, 0.5, rate, false);
        let begun = bench.time;
        let angle = |t: f64| (0.1 * t).clamp(0.0, 0.005);
        let plate = |time: f64| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * angle(time - begun));
            Pose::from_parts(Vector3::new(0.0, 0.0, -0.005).into(), turn)
        };
        let mut felt = Vector6::zeros();
        for _ in 0..200 {
            felt = bench.tick(&hand(0.0, DEPTH), plate);
        }
        let body = bench.god_object.pose().rotation.scaled_axis();
        assert!(
            (body - Vector3::z() * 0.005).norm() < 1e-4,
            "{rate} Hz: {body}"
        );
        assert!(
            felt[5] > 0.0 && felt.fixed_rows::<2>(0).norm() < 0.02,
            "{felt}"
        );
    }
}

#[test]
fn a_plate_that_rises_and_slides_carries_as_one_that_slides() {
    for rate in RATES {
        let mut bench = Bench::pressed(Pair::Meshes, 0.8, rate, false);
        let begun = bench.time;
        let gone = |time: f64| (0.03 * (time - begun)).clamp(0.0, 1.5e-3);
        let plate = |time: f64| Pose::translation(gone(time), 0.0, gone(time) - 0.005);
        let mut felt = Vector6::zeros();
        for _ in 0..250 {
            felt = bench.tick(&hand(0.0, DEPTH), plate);
        }
        assert!(
            (felt[0] - 1.5).abs() < 0.03 && (felt[2] - 5.5).abs() < 0.05,
            "{rate} Hz: {felt}"
        );
    }
}

#[test]
fn the_energy_of_a_hand_that_is_carried_is_the_plates() {
    let mut bench = Bench::pressed(Pair::Meshes, 0.5, 1000.0, true);
    let begun = bench.time;
    let mut plain = Bench::pressed(Pair::Meshes, 0.5, 1000.0, false);
    let before = plain.coupling.obstacle_work();
    for _ in 0..300 {
        // Carried to 1 N, then the hand goes with the plate: 0.05 m/s for 14 mm.
        let time = bench.time + 1e-3 - begun;
        let device = hand(0.05 * (time - 0.02).max(0.0), DEPTH);
        let plate = |at_time: f64| at(0.05 * (at_time - begun).max(0.0));
        let (passive, free) = (bench.tick(&device, plate), plain.tick(&device, plate));
        assert!(
            (passive - free).norm() < 1e-9,
            "at {time} s: {passive} beside {free}"
        );
    }
    let work = plain.coupling.obstacle_work() - before;
    let expected = 1.0 * 0.05 * 0.28 + 0.5 * STIFFNESS * 1e-3 * 1e-3;
    assert!(
        (work - expected).abs() < 0.05 * expected,
        "{work} J, not {expected} J"
    );
}
