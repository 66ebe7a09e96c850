//! Corners that pass each other are not felt, and those that do not are held by the face that they come upon, however rarely rows are made anew.

use std::sync::Arc;

use god_object::nalgebra::Vector3;
use god_object::spatial::linear;
use god_object::{Coupling, GodObject, Pose, Settings, World};

use crate::support::{box_body, box_obstacle};

/// Of the body, m, and of the obstacle: as wide as the body, so that corners face corners, and wider, so that they face edges.
const HALF: f64 = 5e-3;
const HALF_WIDTHS: [f64; 2] = [HALF, 6e-3];
/// Time between forces, s, and forces between updates: some 70 updates a second.
const TICK: f64 = 1e-3;
const UPDATE: usize = 14;
/// Of the device along each axis, m/s.
const SPEED: f64 = 0.05;

/// Device and force of one tick in the obstacle's frame: how far the body is beside the obstacle, and how far above it, m, and N.
struct Felt {
    beside: f64,
    above: f64,
    force: Vector3<f64>,
}

/// A box goes by a block: `beside` and `above` it at first, m, in the direction `way`, for `time`, s; the first update comes `phase` ticks late.
fn felt([beside, above]: [f64; 2], way: [f64; 2], time: f64, phase: usize) -> Vec<Felt> {
    let all = HALF_WIDTHS.map(|width| felt_by(width, [beside, above], way, time, phase));
    all.into_iter().flatten().collect()
}

fn felt_by(
    width: f64,
    [beside, above]: [f64; 2],
    way: [f64; 2],
    time: f64,
    phase: usize,
) -> Vec<Felt> {
    let half = Vector3::new(HALF, HALF, HALF);
    let place = Pose::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.7, -0.4, 1.1));
    let mut block = box_obstacle("block", Vector3::new(HALF, width, HALF), Vector3::zeros());
    block.pose = place;
    let world = Arc::new(World {
        body: box_body(half),
        obstacles: vec![block],
    });
    let settings = Settings {
        adaptation: None,
        ..world.settings_for(Settings::for_size(2.0 * HALF))
    };
    let at = |tick: usize| {
        let gone = SPEED * TICK * tick as f64;
        [beside + way[0] * gone, above + way[1] * gone]
    };
    let device = |tick: usize| {
        let [beside, above] = at(tick);
        place * Pose::translation(2.0 * HALF + beside, 0.0, 2.0 * HALF + above)
    };
    let mut god_object =
        GodObject::new(world.clone(), settings, device(0)).expect("the start is free");
    let mut coupling = Coupling::new(&world, &settings);
    let ticks = (time / TICK) as usize;
    let of_tick = |tick: usize| {
        let device_pose = device(tick);
        if tick >= phase && (tick - phase).is_multiple_of(UPDATE) {
            let _ = god_object.step(&device_pose, None);
        }
        let set = god_object.constraint_set();
        let output = coupling.step(TICK * tick as f64, &device_pose, set);
        let [beside, above] = at(tick);
        Felt {
            beside,
            above,
            force: place.rotation.inverse() * linear(&output.wrench),
        }
    };
    (0..ticks).map(of_tick).collect()
}

#[test]
fn corners_that_pass_each_other_are_not_felt() {
    for beside in [2e-5, 1e-4] {
        for phase in 0..UPDATE {
            for tick in felt([beside, 2e-3], [0.0, -1.0], 0.06, phase) {
                let felt = tick.force.norm();
                assert!(
                    felt < 1e-12,
                    "{felt:e} N, {beside} m beside, {} m above",
                    tick.above
                );
            }
        }
    }
}

#[test]
fn corners_that_come_at_a_slant_meet_the_face_that_they_come_upon() {
    for phase in 0..UPDATE {
        // Above the block before it is beside it no more, and the reverse.
        for [beside, above] in [[1e-3, 1.5e-3], [1.5e-3, 1e-3]] {
            for tick in felt([beside, above], [-1.0, -1.0], 0.04, phase) {
                let (on_top, depth) = (tick.above > tick.beside, -tick.above.max(tick.beside));
                let normal = if on_top { Vector3::z() } else { Vector3::x() };
                let felt = tick.force.norm();
                let of = format!("{} N at {} {}", tick.force, tick.beside, tick.above);
                if depth < -2e-6 {
                    assert_eq!(felt, 0.0, "{of}");
                } else if depth > 5e-5 {
                    assert!(felt > 0.0 && tick.force.dot(&normal) > 0.99 * felt, "{of}");
                }
            }
        }
    }
}
