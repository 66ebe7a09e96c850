//! A peg that is pushed askew into a rough hole jams where statics says so.
//!
//! Plane case of Whitney, "Quasi-static assembly of compliantly supported rigid parts", J. Dyn. Sys. Meas. Control 104 (1982): a peg of half width r,
//! in by l, touches the mouth of the hole and, with its tip, the wall opposite. It slides in where the two contacts cannot balance the push with
//! both of their friction cones full: without a side force, where the push is more than `2 mu M / l`; with one, on the side of his parallelogram.
//! Here the tilt of the peg is not neglected.

use god_object::spatial::{angular, linear};
use god_object::{Coupling, GodObject, Pose, Settings};
use nalgebra::{Matrix3, Vector2, Vector3};
use taut_method_tests::solids::{body, mesh, obstacle, world};
use taut_scene::shapes::cuboid;

/// Half of the peg across the hole, along it and in depth, m; clearance on each side.
const HALF: [f64; 3] = [0.01, 0.03, 0.01];
const CLEARANCE: f64 = 1e-4;
/// Of each wall, m.
const WALL: [f64; 3] = [0.02, 0.03, 0.03];
const TICK: f64 = 1e-3;
/// Ticks to turn the hand, and to let the peg come to rest.
const TURNING: u32 = 100;
const RESTING: u32 = 50;
/// How fast and how far the hand pushes, m/s and m.
const PUSHING: f64 = 0.01;
const FAR: f64 = 8e-3;
/// The peg slides when it has gone this far, m.
const SLID: f64 = 5e-5;

/// The push, N, at which a peg turned to the left and in by `inserted` slides, and what statics says of the wrench there.
fn push_at_slip(friction: f64, inserted: f64, turn: f64, aside: f64) -> [f64; 2] {
    let wall = |name: &str, side: f64| {
        let at = Pose::translation(side * (HALF[0] + CLEARANCE + WALL[0]), -WALL[1], 0.0);
        let mut wall = obstacle(name, mesh(cuboid(WALL)), at);
        wall.surface.friction = friction;
        wall
    };
    let walls = [wall("left", -1.0), wall("right", 1.0)];
    let world = world(body(mesh(cuboid(HALF))), walls);
    let settings = Settings {
        force_limit: 1e3,
        torque_limit: 1e3,
        ..Settings::for_size(2.0 * HALF[1]).with_clearance(CLEARANCE)
    };
    let start = HALF[1] - inserted;
    let device = |turned: f64, pushed: f64| {
        Pose::new(
            Vector3::new(aside * turned / turn, start - pushed, 0.0),
            Vector3::z() * turned,
        )
    };
    let mut peg = GodObject::new(world.clone(), settings, device(0.0, 0.0)).expect("it is free");
    let mut coupling = Coupling::new(&world, &settings);
    let mut time = 0.0;
    let mut step = |device: &Pose| {
        let _ = peg.step(device, None);
        time += TICK;
        peg.note_published(time);
        let wrench = coupling.step(time, device, peg.constraint_set()).wrench;
        (peg.constraint_set().god_object_pose, wrench)
    };
    for tick in 0..TURNING + RESTING {
        let share = f64::from((tick + 1).min(TURNING)) / f64::from(TURNING);
        step(&device(share * turn, 0.0));
    }
    let (rest, _) = step(&device(turn, 0.0));
    let mut before = None;
    let mut pushed = 0.0;
    while pushed < FAR {
        pushed += PUSHING * TICK;
        let (pose, wrench) = step(&device(turn, pushed));
        if rest.translation.y - pose.translation.y > SLID {
            let (pose, wrench) = before.expect("it stuck at first");
            return statics(friction, &pose, &wrench);
        }
        // The last instant at which it stood where it was.
        if rest.translation.y - pose.translation.y < 0.1 * SLID {
            before = Some((pose, wrench));
        }
    }
    panic!("mu {friction}, in by {inserted}, turned by {turn}, {aside} m aside: it does not slide");
}

/// The push at a pose, N, and the one at which both cones are full, by three equations of the plane.
fn statics(friction: f64, pose: &Pose, wrench: &god_object::Vector6) -> [f64; 2] {
    let (force, moment) = (linear(wrench), angular(wrench).z);
    let tilt = pose.rotation.scaled_axis().z;
    let middle = Vector2::new(pose.translation.x, pose.translation.y);
    let turned = |x: f64, y: f64| {
        Vector2::new(
            x * tilt.cos() - y * tilt.sin(),
            x * tilt.sin() + y * tilt.cos(),
        )
    };
    // Turned to the left: the right side of the tip meets the right wall, and the left side the left mouth.
    let mouth = Vector2::new(-(HALF[0] + CLEARANCE), 0.0) - middle;
    let tip = turned(HALF[0], -HALF[1]);
    let along = |normal: Vector2<f64>, up: Vector2<f64>| normal + up * friction;
    let at_mouth = along(turned(1.0, 0.0), turned(0.0, 1.0));
    let at_tip = along(Vector2::new(-1.0, 0.0), Vector2::new(0.0, 1.0));
    let cross = |at: Vector2<f64>, of: Vector2<f64>| at.x * of.y - at.y * of.x;
    // The hand's wrench is what the contacts carry: unknown are both normal forces and the push.
    #[rustfmt::skip]
    let equations = Matrix3::new(
        at_mouth.x, at_tip.x, 0.0,
        at_mouth.y, at_tip.y, -1.0,
        cross(mouth, at_mouth), cross(tip, at_tip), 0.0,
    );
    let known = Vector3::new(force.x, 0.0, moment);
    let solved = equations.lu().solve(&known).expect("two contacts");
    [force.y, solved.z]
}

#[test]
fn a_peg_slides_in_where_its_friction_cones_are_full() {
    let (mut worst, mut cases) = (0.0_f64, 0);
    for friction in [0.1, 0.3, 0.6] {
        for inserted in [0.015, 0.02, 0.03] {
            for turn in [0.1, 0.2] {
                for aside in [-2e-4, 0.0, 2e-4] {
                    let [push, right] = push_at_slip(friction, inserted, turn, aside);
                    let off = (push / right - 1.0).abs();
                    println!("{friction} {inserted} {turn} {aside}: {push:.4} N, {right:.4} N");
                    worst = worst.max(off);
                    cases += 1;
                }
            }
        }
    }
    assert_eq!(cases, 54);
    // The hand pushes on by 10 mN between two updates.
    assert!(worst < 0.02, "off by {:.1} %", 100.0 * worst);
}
