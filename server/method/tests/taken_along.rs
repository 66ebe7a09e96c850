//! Obstacles that move beside the body: what does not push or hold it leaves it in the hand, also in a late update.

use std::sync::Arc;

use crate::moving_obstacles::{CLEARANCE, overlaps, slot};
use crate::support::{box_body, box_obstacle};
use god_object::nalgebra::{UnitQuaternion, Vector3};
use god_object::{GodObject, Mesh, Obstacle, Pose, Settings, World};

/// A fence from the z axis along a radius, `degrees` from the x axis, that ends (m) inside the arc on which the body would ride round.
fn fence(end: f64, half_height: f64, height: f64, degrees: f64) -> Obstacle {
    let half = Vector3::new(0.5 * end, 1e-3, half_height);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
    let middle = turn * Vector3::new(0.5 * end, 0.0, height);
    Obstacle {
        pose: Pose::from_parts(middle.into(), turn),
        ..box_obstacle("fence", half, Vector3::zeros())
    }
}

/// 90 degrees, so many at a time.
fn quarter(step: f64) -> Vec<f64> {
    let turns = (1_u32..).map(|k| step * f64::from(k));
    turns.take_while(|turn| turn.abs() <= 90.0).collect()
}

/// How far a body is from a hand that stands, m, after the first obstacle has turned about the z axis to these angles, an update each, degrees.
fn off_after(world: &Arc<World>, [start, hand]: [&Pose; 2], turns: &[f64]) -> f64 {
    let settings = Settings {
        look_ahead_limit: 0.5,
        ..Settings::for_size(0.02)
    };
    let mut god_object = GodObject::new(world.clone(), settings, *start).expect("a free start");
    for _ in 0..20 {
        god_object.step(hand, None);
    }
    for turn in turns {
        let target = Pose::rotation(Vector3::z() * turn.to_radians()) * world.obstacles[0].pose;
        god_object.move_obstacle(0, &target);
        let report = god_object.step(hand, None);
        assert_eq!(report.obstacles_blocked, 0, "{turns:?} at {turn}");
        assert!(!overlaps(world, &god_object));
    }
    for _ in 0..50 {
        god_object.step(hand, None);
    }
    let place = god_object.pose().translation.vector;
    (place - hand.translation.vector).xy().norm()
}

/// Height over a table, or distance from a door, at which a body touches without a load, m: between one rest distance and two.
const LAID_ON: f64 = 3e-6;

/// Pressed by 1 mm on a smooth table, held just above a rough one, and laid on it without a load.
#[test]
fn a_turntable_that_does_not_hold_carries_no_body_behind_a_fence() {
    let laid_on = 0.01 + LAID_ON;
    let cases = [
        (0.0, 0.011, 9e-3),
        (0.5, 0.01005, 0.01005),
        (0.5, laid_on, laid_on),
    ];
    for (friction, start, hand) in cases {
        let mut table = box_obstacle(
            "table",
            Vector3::new(0.3, 0.3, 5e-3),
            Vector3::new(0.0, 0.0, -5e-3),
        );
        table.surface.friction = friction;
        let world = Arc::new(World {
            body: box_body(Vector3::repeat(0.01)),
            obstacles: vec![table, fence(0.078, 0.02, 0.021, 45.0)],
        });
        let [start, hand] = [start, hand].map(|z| Pose::translation(0.1, 0.0, z));
        for step in [1.0, 10.0, 45.0, 90.0] {
            let off = off_after(&world, [&start, &hand], &quarter(step));
            assert!(off < 1e-4, "friction {friction}, by {step} degrees: {off}");
        }
    }
}

/// A door that is hinged on the z axis, and a body whose lower half is beside it and whose upper half is over it, where the fence is.
fn door(degrees: f64, fence: Obstacle) -> Arc<World> {
    let half = Vector3::new(0.075, 1e-3, 9e-3);
    let plate = box_obstacle("door", half, Vector3::zeros());
    let lowered = Vector3::new(half.x, 0.0, -0.011);
    let vertices = plate.mesh.vertices().iter().map(|v| v + lowered);
    let mesh = Mesh::new(vertices.collect(), plate.mesh.triangles().to_vec());
    let door = Obstacle {
        mesh: mesh.expect("a closed box"),
        pose: Pose::rotation(Vector3::z() * degrees.to_radians()),
        ..plate
    };
    Arc::new(World {
        body: box_body(Vector3::repeat(0.01)),
        obstacles: vec![door, fence],
    })
}

/// A smooth door beside the body, and a rough one that touches it.
#[test]
fn a_door_that_swings_away_carries_no_body_behind_a_fence() {
    for (friction, gap) in [(0.0, 5e-5), (0.5, LAID_ON)] {
        let mut world = World::clone(&door(0.0, fence(0.078, 4e-3, 6e-3, -45.0)));
        world.obstacles[0].surface.friction = friction;
        let world = Arc::new(world);
        let hand = Pose::translation(0.1, 0.011 + gap, 0.0);
        for step in [-1.0, -10.0, -45.0, -90.0] {
            let off = off_after(&world, [&hand, &hand], &quarter(step));
            assert!(off < 1e-4, "friction {friction}, by {step} degrees: {off}");
        }
    }
}

/// It ends 10 degrees from the body. The first part of its way tells how far it may come in the second.
#[test]
fn a_door_that_comes_near_carries_no_body_behind_a_fence() {
    let world = door(-119.0, fence(0.088, 4e-3, 6e-3, 41.0));
    let hand = Pose::translation(0.1, 0.01105, 0.0);
    let off = off_after(&world, [&hand, &hand], &[45.0, 115.0]);
    assert!(off < 1e-4, "{off}");
}

/// The slot goes a hundred clearances in each update, and a smooth table, on which the hand presses the body, slides across.
#[test]
fn a_table_that_slides_by_lets_a_body_go_along_with_its_slot() {
    for step in [0.01, -0.01] {
        let mut world = World::clone(&slot());
        let (half, center) = (Vector3::new(0.5, 0.5, 5e-3), Vector3::z() * -0.01502);
        world.obstacles.push(box_obstacle("table", half, center));
        let world = Arc::new(world);
        let [slot, table] = [0, 1].map(|index| world.obstacles[index].pose);
        let settings = Settings::for_size(0.04);
        let mut god_object =
            GodObject::new(world.clone(), settings, Pose::identity()).expect("a free start");
        let pressed = Pose::translation(0.0, 0.0, -1e-3);
        for _ in 0..20 {
            god_object.step(&pressed, None);
        }
        for update in 1..=20 {
            let u = f64::from(update);
            let along = Pose::translation(step * u, 0.0, 0.0);
            god_object.move_obstacle(0, &(along * slot));
            god_object.move_obstacle(1, &(Pose::translation(0.0, 1e-3 * u, 0.0) * table));
            let report = god_object.step(&(along * pressed), None);
            assert_eq!(report.obstacles_blocked, 0, "in update {update}");
            assert!(!overlaps(&world, &god_object));
            let aside = god_object.pose().translation.x - step * u;
            assert!(aside.abs() <= CLEARANCE, "left the slot: {aside}");
        }
    }
}
