//! Times 10,000 projections of 1 to 60 rows, cold and warm: `cargo run --release --example projection_timing`.
//!
//! Prints the best of a few repeats per problem, then percentiles over problems: wall-clock tails of a shared machine are its scheduler's.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a measurement needs a clock; the method itself has none"
)]

#[path = "../tests/projection_support/mod.rs"]
mod projection_support;

use god_object::quasi_statics::{HalfSpace, Metric, Projection, Projector, SolverKind};
use god_object::spatial::Vector6;
use projection_support::{FAMILIES, Random, hand_motion, hand_sized_metric, rows_of};
use std::time::Instant;

const PROBLEMS: usize = 10_000;
const REPEATS: usize = 7;

fn main() {
    let metric = hand_sized_metric();
    let random = &mut Random(1);
    let problems: Vec<(Vec<HalfSpace>, Vector6)> = (0..PROBLEMS)
        .map(|k| {
            let rows = rows_of(k % FAMILIES.len(), 1 + random.below(60), k % 2 == 0, random);
            (rows, hand_motion(random))
        })
        .collect();
    let mut projector = Projector::new(SolverKind::ActiveSet, 5000);

    let mut cold = Vec::with_capacity(PROBLEMS);
    let mut warm = Vec::with_capacity(PROBLEMS);
    let (mut worst_residual, mut restarts, mut most_iterations) = (0.0_f64, 0, 0);
    for (rows, a_u) in &problems {
        let (time, answer) = best_time(&mut projector, &metric, a_u, rows, &[]);
        cold.push(time);
        worst_residual = worst_residual.max(answer.kkt_residual);
        restarts += answer.restarts;
        most_iterations = most_iterations.max(answer.iterations);
        // The next tick: the hand has moved by a hundredth, the rows of the last answer are known.
        let own: Vec<u32> = answer.active.iter().map(|row| row.row).collect();
        let next = a_u + hand_motion(random) * 0.01;
        warm.push(best_time(&mut projector, &metric, &next, rows, &own).0);
    }
    println!("{PROBLEMS} problems, 1 to 60 rows, best of {REPEATS} each");
    report("cold", &mut cold);
    report("warm", &mut warm);
    println!(
        "worst KKT residual {worst_residual:.1e}, restarts {restarts}, most iterations {most_iterations}"
    );

    for count in [100, 1000, 5000] {
        let mut times = Vec::new();
        for k in 0..100 {
            let rows = rows_of(k % 2, count, true, random);
            times.push(best_time(&mut projector, &metric, &hand_motion(random), &rows, &[]).0);
        }
        report(&format!("{count} rows, cold"), &mut times);
    }
}

fn best_time(
    projector: &mut Projector,
    metric: &Metric,
    a_u: &Vector6,
    rows: &[HalfSpace],
    warm_start: &[u32],
) -> (f64, Projection) {
    let mut best = f64::INFINITY;
    let mut answer = projector.project(metric, a_u, rows, warm_start);
    for _ in 0..REPEATS {
        let start = Instant::now();
        answer = std::hint::black_box(projector.project(
            metric,
            a_u,
            rows,
            std::hint::black_box(warm_start),
        ));
        best = best.min(start.elapsed().as_secs_f64() * 1e6);
    }
    (best, answer)
}

fn report(name: &str, times: &mut [f64]) {
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    println!(
        "{name:>16}: p50 {:.2} us, p99 {:.2} us, max {:.2} us",
        at(0.5),
        at(0.99),
        at(1.0)
    );
}
