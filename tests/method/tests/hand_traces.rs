//! Recorded and synthetic hands lead bodies through scenes: the bodies never intersect.

use std::sync::Arc;

use god_object::{Mesh, Obstacle, Pose, Settings, World};
use nalgebra::Vector3;
use taut_method_tests::assembly::ASSEMBLIES;
use taut_method_tests::checker::PenetrationChecker;
use taut_method_tests::motion::{Led, traced};
use taut_method_tests::solids::{body, mesh, obstacle, world};
use taut_scene::{DeviceTrace, data_file, read_mesh};

fn trace(name: &str) -> Option<DeviceTrace> {
    let Some(path) = data_file(format!("traces/{name}.csv")) else {
        taut_test_kit::left_out(format_args!(
            "traces/{name}.csv is not in the data directory"
        ));
        return None;
    };
    Some(DeviceTrace::load(&path).unwrap_or_else(|error| panic!("{error}")))
}

fn bunny(triangles: &str) -> Option<Mesh> {
    let Some(path) = data_file(format!("bunny_{triangles}.ply")) else {
        taut_test_kit::left_out(format_args!(
            "bunny_{triangles}.ply is not in the data directory"
        ));
        return None;
    };
    let raw = read_mesh(&path).unwrap_or_else(|error| panic!("{error}"));
    Some(mesh(raw))
}

/// Follows the rows and checks every pose; returns the share of updates in contact and the last sample.
fn follow(world: Arc<World>, settings: &Settings, rows: &[(f64, Pose)]) -> (f64, Pose) {
    let checker = PenetrationChecker::new(&world);
    let mut led = Led::in_world(world, settings, rows[0].1);
    let mut touching = 0;
    for (time, pose) in rows {
        let sample = led.step(*time, pose);
        assert!(
            sample.gap_min >= settings.minimum_gap,
            "a gap of {:e} m at {time} s",
            sample.gap_min
        );
        assert_eq!(
            checker.penetrated(&sample.god_object),
            None,
            "at {time} s: {}",
            sample.god_object
        );
        touching += usize::from(sample.active > 0);
    }
    (touching as f64 / rows.len() as f64, *led.pose())
}

/// A hand that moves freely for a minute swings a bunny through others in its way.
fn swing_a_bunny(every: usize) {
    let (Some(trace), Some(small), Some(large)) =
        (trace("hand_mocap_100hz"), bunny("1k"), bunny("5k"))
    else {
        return;
    };
    let rows: Vec<(f64, Pose)> = traced(&trace).step_by(every).collect();
    // In the way of the hand, where it is after a quarter, a half and three quarters of the minute; apart from the start.
    let obstacles = [1, 2, 3].map(|quarter| {
        let there = rows[quarter * rows.len() / 4].1;
        let pose = Pose::new(there.translation.vector, Vector3::y() * quarter as f64);
        obstacle(&format!("bunny {quarter}"), large.clone(), pose)
    });
    let apart =
        |o: &Obstacle| (o.pose.translation.vector - rows[0].1.translation.vector).norm() > 0.25;
    let obstacles: Vec<Obstacle> = obstacles.into_iter().filter(apart).collect();
    assert!(!obstacles.is_empty(), "the hand never leaves its start");
    let mut held = body(small);
    held.mass = 0.5;
    held.inertia *= held.mass;
    let world = world(held, obstacles);
    let (touching, _) = follow(world, &Settings::for_size(0.15), &rows);
    println!("in contact for {touching} of the time");
    assert!(touching > 0.05, "in contact for {touching} of the time");
}

/// The synthetic hand was made for the loose round peg.
fn insert_a_peg(every: usize) {
    let (Some(trace), Some(loaded)) = (trace("synth_peg_1khz"), ASSEMBLIES[0].load()) else {
        return;
    };
    let (scene, _) = loaded.unwrap_or_else(|error| panic!("{error}"));
    let rows: Vec<(f64, Pose)> = traced(&trace).step_by(every).collect();
    let (touching, last) = follow(Arc::new(scene.world), &scene.settings, &rows);
    println!("in contact for {touching} of the time, ends at {last}");
    assert!(touching > 0.05, "in contact for {touching} of the time");
}

#[test]
fn a_recorded_hand_swings_a_bunny_among_bunnies() {
    swing_a_bunny(6);
}

#[test]
#[ignore = "minutes: every row of the trace"]
fn a_recorded_hand_swings_a_bunny_among_bunnies_at_its_full_rate() {
    swing_a_bunny(1);
}

#[test]
fn a_synthetic_hand_inserts_a_peg() {
    insert_a_peg(20);
}

#[test]
#[ignore = "minutes: every row of the trace"]
fn a_synthetic_hand_inserts_a_peg_at_its_full_rate() {
    insert_a_peg(1);
}
