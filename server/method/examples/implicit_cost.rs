//! What rounds of implicit constraints cost and bring: `cargo run --release -p god-object --example implicit_cost`.
//!
//! A box is turned about its corner on a table and about an edge of a prism; times are the best of a few repeats.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a measurement needs a clock; the method itself has none"
)]

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/support/mod.rs"]
mod support;

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use god_object::nalgebra::Vector3;
use god_object::spatial::{angular, linear};
use god_object::{Coupling, GodObject, Pose, Settings, Vector6, World};
use support::{box_body, box_obstacle};

const REPEATS: u32 = 2_000;

fn main() {
    let half = Vector3::new(0.02, 0.02, 0.01);
    let table = box_obstacle("table", Vector3::new(0.5, 0.5, 0.05), -0.05 * Vector3::z());
    let wall = box_obstacle("wall", Vector3::new(0.5, 0.05, 0.5), 0.08 * Vector3::y());
    let world = Arc::new(World {
        body: box_body(half),
        obstacles: vec![table, wall],
    });
    println!("turn of the device | rounds | rows | coupling us | force N | error to 3 rounds");
    for turn in [0.0, 0.1, 0.5, 1.0] {
        let reference = case(&world, turn, 3).2;
        for rounds in 0..=3 {
            let (rows, time, wrench) = case(&world, turn, rounds);
            let size = |w: &Vector6| linear(w).norm() + angular(w).norm() / half.x;
            println!(
                "{turn:>5} rad | {rounds} | {rows} | {time:.2} | {:.2} | {:.4}",
                linear(&wrench).norm(),
                size(&(wrench - reference)) / size(&reference)
            );
        }
    }
    println!("a turning, pressing hand | rounds | sub-steps | us per update | advancement steps");
    for rounds in 0..=3 {
        let (substeps, time, advancement) = updates(&world, rounds);
        println!("2,000 updates | {rounds} | {substeps} | {time:.1} | {advancement}");
    }
}

fn settings(rounds: u32) -> Settings {
    Settings {
        implicit_rounds: rounds,
        ..Settings::for_size(0.04)
    }
}

fn case(world: &Arc<World>, turn: f64, rounds: u32) -> (usize, f64, Vector6) {
    let settings = settings(rounds);
    let start = Pose::new(Vector3::new(0.0, 0.0, 0.0335), Vector3::new(0.4, 0.5, 0.1));
    let mut god_object = GodObject::new(world.clone(), settings, start).expect("a free start");
    let press = Pose::from_parts(Vector3::new(0.0, 0.008, 0.012).into(), start.rotation);
    for _ in 0..100 {
        god_object.step(&press, None);
    }
    let device = Pose::new(
        Vector3::new(0.0, 0.008, 0.012),
        Vector3::new(0.4, 0.5, 0.1) + Vector3::new(0.5, -0.2, 0.8) * turn,
    );
    let mut coupling = Coupling::new(world, &settings);
    let mut best = f64::INFINITY;
    let mut wrench = Vector6::zeros();
    for _ in 0..REPEATS {
        let before = Instant::now();
        wrench =
            black_box(coupling.step(0.0, black_box(&device), god_object.constraint_set())).wrench;
        best = best.min(before.elapsed().as_secs_f64() * 1e6);
    }
    (god_object.constraint_set().constraints.len(), best, wrench)
}

fn updates(world: &Arc<World>, rounds: u32) -> (u32, f64, u64) {
    let start = Pose::translation(0.0, 0.0, 0.03);
    let (mut substeps, mut advancement, mut best) = (0, 0, f64::INFINITY);
    for _ in 0..5 {
        let mut god_object =
            GodObject::new(world.clone(), settings(rounds), start).expect("a free start");
        (substeps, advancement) = (0, 0);
        let before = Instant::now();
        for i in 0..2_000 {
            let t = f64::from(i) * 1e-3;
            let device = Pose::new(
                Vector3::new(0.05 * (2.0 * t).sin(), 0.02 * (3.0 * t).sin(), 0.012),
                Vector3::new(1.5 * (5.0 * t).sin(), 1.2 * (3.0 * t).cos(), t),
            );
            let report = god_object.step(&device, None);
            substeps += report.substeps;
            advancement += report.work.advancement_steps;
        }
        best = best.min(before.elapsed().as_secs_f64() * 1e6 / 2_000.0);
    }
    (substeps, best, advancement)
}
