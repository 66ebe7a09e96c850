//! Obstacles that move beside the body: what does not push or hold it leaves it in the hand, also in a late update.

use std::sync::Arc;

use crate::moving_obstacles::overlaps;
use crate::support::{box_body, box_obstacle};
use god_object::nalgebra::{UnitQuaternion, Vector3};
use god_object::{GodObject, Obstacle, Pose, Settings, World};

/// A fence along a radius about the z axis, `degrees` from the x axis, that ends inside the arc on which the body would ride round.
fn fence(half_height: f64, height: f64, degrees: f64) -> Obstacle {
    let half = Vector3::new(0.039, 1e-3, half_height);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
    let middle = turn * Vector3::new(0.039, 0.0, height);
    Obstacle {
        pose: Pose::from_parts(middle.into(), turn),
        ..box_obstacle("fence", half, Vector3::zeros())
    }
}

/// How far a body is from a hand that stands, m, after the first obstacle has turned about the z axis by 90 degrees, so many in each update.
fn off_after_a_turn(world: &Arc<World>, [start, hand]: [&Pose; 2], degrees: f64) -> f64 {
    let settings = Settings::for_size(0.02);
    let mut god_object = GodObject::new(world.clone(), settings, *start).expect("a free start");
    for _ in 0..20 {
        god_object.step(hand, None);
    }
    let before = world.obstacles[0].pose;
    let mut turned: f64 = 0.0;
    while turned.abs() < 90.0 {
        turned += degrees;
        let turn = Pose::rotation(Vector3::z() * turned.to_radians());
        god_object.move_obstacle(0, &(turn * before));
        let report = god_object.step(hand, None);
        assert_eq!(report.obstacles_blocked, 0, "{degrees} at {turned}");
        assert!(!overlaps(world, &god_object));
    }
    for _ in 0..50 {
        god_object.step(hand, None);
    }
    let place = god_object.pose().translation.vector;
    (place - hand.translation.vector).xy().norm()
}

/// Pressed by 1 mm on a smooth table, and held just above a rough one.
#[test]
fn a_turntable_that_does_not_hold_carries_no_body_behind_a_fence() {
    for (friction, start, hand) in [(0.0, 0.011, 9e-3), (0.5, 0.01005, 0.01005)] {
        let mut table = box_obstacle(
            "table",
            Vector3::new(0.3, 0.3, 5e-3),
            Vector3::new(0.0, 0.0, -5e-3),
        );
        table.surface.friction = friction;
        let world = Arc::new(World {
            body: box_body(Vector3::repeat(0.01)),
            obstacles: vec![table, fence(0.02, 0.021, 45.0)],
        });
        let [start, hand] = [start, hand].map(|z| Pose::translation(0.1, 0.0, z));
        for degrees in [1.0, 10.0, 45.0, 90.0] {
            let off = off_after_a_turn(&world, [&start, &hand], degrees);
            assert!(
                off < 1e-4,
                "friction {friction}, by {degrees} degrees: {off}"
            );
        }
    }
}

/// The lower half of the body is beside a door, the upper half is over it, where the fence is.
#[test]
fn a_door_that_swings_away_carries_no_body_behind_a_fence() {
    let door = box_obstacle(
        "door",
        Vector3::new(0.15, 1e-3, 4e-3),
        Vector3::new(0.0, 0.0, -6e-3),
    );
    let world = Arc::new(World {
        body: box_body(Vector3::repeat(0.01)),
        obstacles: vec![door, fence(4e-3, 6e-3, -45.0)],
    });
    let hand = Pose::translation(0.1, 0.01105, 0.0);
    for degrees in [-1.0, -10.0, -45.0, -90.0] {
        let off = off_after_a_turn(&world, [&hand, &hand], degrees);
        assert!(off < 1e-4, "by {degrees} degrees: {off}");
    }
}
