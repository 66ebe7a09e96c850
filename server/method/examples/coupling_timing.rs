//! Times whole steps of the coupling on sets of 10 to 150 rows: `cargo run --release --example coupling_timing`.
//!
//! A set arrives every millisecond; most of its rows are those of the set before, moved a little; its publisher has made them ready, or not. The same steps are run several times, the best
//! time of each counts: wall-clock tails of a shared machine are its scheduler's, as one run alone shows.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a measurement needs a clock; the method itself has none"
)]

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/projection_support/mod.rs"]
mod projection_support;
#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/support/mod.rs"]
mod support;

use god_object::constraint::{Feature, FeaturePair, Separation};
use god_object::nalgebra::{Point3, Vector3};
use god_object::{
    ConstraintSet, Coupling, NonPenetrationConstraint, Pose, ProjectionStatus, Settings,
};
use projection_support::Random;
use std::time::Instant;

const SETS: usize = 2000;
const REPEATS: usize = 9;
/// Most rows of a set.
const MAX_ROWS: usize = 150;

fn main() {
    for samples_per_set in [1, 4] {
        println!("{SETS} sets, {samples_per_set} device samples each, best of {REPEATS}");
        for (name, row) in [
            ("peg", peg_row as fn(u32) -> NonPenetrationConstraint),
            ("bunny", bunny_row),
        ] {
            time_scene(name, row, samples_per_set, false);
            time_scene(name, row, samples_per_set, true);
        }
    }
}

/// `ready`: the rows are made ready by who publishes the set, as the god-object does.
fn time_scene(
    name: &str,
    row: fn(u32) -> NonPenetrationConstraint,
    samples_per_set: usize,
    ready: bool,
) {
    let world = support::box_on_table();
    let settings = Settings::for_size(0.1);
    let mut sets = sets_of(row);
    if ready {
        for (index, set) in sets.iter_mut().enumerate() {
            // The publisher knows where the device was when its update began.
            let device = device_at((index as f64 - 1.0) * 1e-3);
            set.prepare(&world.body, &settings, Some(&device));
        }
    }
    let (mut arriving, mut between) = (vec![f64::INFINITY; SETS], Vec::new());
    let mut once = vec![0.0; SETS];
    between.resize(SETS * (samples_per_set - 1), f64::INFINITY);
    let (mut worst, mut failed, mut active) = (0.0_f64, 0, 0);
    for _ in 0..REPEATS {
        let mut coupling = Coupling::new(&world, &settings);
        let mut published = ConstraintSet::with_capacity(MAX_ROWS);
        for (index, set) in sets.iter().enumerate() {
            // Into the one buffer that a loop reads from: the history of sets is not part of the step.
            published.clone_from(set);
            for sample in 0..samples_per_set {
                let time = (index as f64 + sample as f64 / samples_per_set as f64) * 1e-3;
                let device = device_at(time);
                let start = Instant::now();
                let output = std::hint::black_box(coupling.step(time, &device, &published));
                let elapsed = start.elapsed().as_secs_f64() * 1e6;
                let best = if sample == 0 {
                    once[index] = elapsed;
                    &mut arriving[index]
                } else {
                    &mut between[index * (samples_per_set - 1) + sample - 1]
                };
                *best = best.min(elapsed);
                worst = worst.max(output.kkt);
                failed += usize::from(output.status != ProjectionStatus::Solved);
                active += output.active;
            }
        }
    }
    let state = if ready { "ready set" } else { "set" };
    report(&format!("{name}, {state} arrives"), &mut arriving);
    report("the last run alone", &mut once);
    report(&format!("{name}, between sets"), &mut between);
    let steps = (SETS * samples_per_set * REPEATS) as f64;
    println!(
        "{:>26}  worst KKT residual {worst:.1e}, failed {failed}, active rows {:.1}",
        "",
        active as f64 / steps
    );
}

/// Where the hand is: it presses, turns and lets go.
fn device_at(time: f64) -> Pose {
    let wave = |rate: f64| (rate * time).sin();
    Pose::new(
        Vector3::new(
            2e-3 * wave(9.0),
            2e-3 * wave(13.0),
            -2e-3 + 3e-3 * wave(7.0),
        ),
        Vector3::new(
            0.02 * wave(11.0),
            0.02 * wave(5.0),
            0.3 * time + 0.02 * wave(17.0),
        ),
    )
}

/// Sets of a slow motion: each keeps most rows of the one before.
fn sets_of(row: fn(u32) -> NonPenetrationConstraint) -> Vec<ConstraintSet> {
    let random = &mut Random(7);
    let mut names: Vec<u32> = (0..40).collect();
    let mut next = names.len() as u32;
    (0..SETS)
        .map(|index| {
            // Between 10 and 150 rows, some of them new in every set.
            let wanted = 80.0 + 70.0 * (index as f64 * 0.01).sin();
            for _ in 0..1 + names.len() / 20 {
                let place = random.below(names.len());
                names.remove(place);
            }
            while names.len() < (wanted as usize).clamp(10, MAX_ROWS) {
                names.push(next);
                next += 1;
            }
            let mut set = ConstraintSet::with_capacity(MAX_ROWS);
            set.sequence = index as u64;
            set.god_object_pose = Pose::new(
                Vector3::new(1e-4, 0.0, 0.0) * (index as f64 * 1e-2).sin(),
                Vector3::new(0.0, 0.0, 3e-4 * index as f64),
            );
            set.constraints = names.iter().map(|name| row(*name)).collect();
            for constraint in &mut set.constraints {
                constraint.gap = (constraint.gap + 2e-5 * random.signed()).max(1e-5);
            }
            set.constraints.sort_unstable_by_key(|row| row.features);
            set
        })
        .collect()
}

/// A contact of a peg of radius 10 mm in its hole, along the z axis, and one in five of its end face.
fn peg_row(name: u32) -> NonPenetrationConstraint {
    let random = &mut Random(u64::from(name));
    let angle = 7.0 * random.signed();
    let outward = Vector3::new(angle.cos(), angle.sin(), 0.0);
    let height = 0.03 * random.signed();
    if name.is_multiple_of(5) {
        row(
            name,
            outward * 8e-3 - Vector3::z() * 0.03,
            Vector3::z(),
            1e-5,
        )
    } else {
        let point = outward * 0.01 + Vector3::z() * height;
        row(name, point, -outward, 2e-5 + 3e-5 * random.unit())
    }
}

/// A contact of two bumpy bodies: normals about the z axis.
fn bunny_row(name: u32) -> NonPenetrationConstraint {
    let random = &mut Random(u64::from(name));
    let normal = (Vector3::z() + random.vector3() * 0.6).normalize();
    let arm = random.vector3() * 0.03 - Vector3::z() * 0.03;
    row(name, arm, normal, 3e-4 * random.unit())
}

fn row(name: u32, arm: Vector3<f64>, normal: Vector3<f64>, gap: f64) -> NonPenetrationConstraint {
    // Names in no order of place or time, vertices and edges.
    let scattered = name.wrapping_mul(2_654_435_761) >> 8;
    let (on_body, on_obstacle) = if name.is_multiple_of(2) {
        (Feature::Vertex(scattered), Feature::Face(name))
    } else {
        (Feature::Edge(scattered), Feature::Edge(name))
    };
    NonPenetrationConstraint {
        features: FeaturePair {
            obstacle: 0,
            on_body,
            on_obstacle,
        },
        point: Point3::from(arm),
        normal,
        gap,
        obstacle_displacement: Vector3::zeros(),
        separation: Separation::OfObstacle,
        shading_normal: None,
    }
}

fn report(name: &str, times: &mut [f64]) {
    if times.is_empty() {
        return;
    }
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    println!(
        "{name:>26}: p50 {:.2} us, p99 {:.2} us, p99.9 {:.2} us, max {:.2} us",
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0)
    );
}
