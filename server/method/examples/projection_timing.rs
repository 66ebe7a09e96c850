//! Times 10,000 projections of 1 to 60 rows, cold and warm: `cargo run --release --example projection_timing`.
//!
//! Prints the best of a few repeats per problem, then percentiles over problems: wall-clock tails of a shared machine are its scheduler's.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a measurement needs a clock; the method itself has none"
)]

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/projection_support/mod.rs"]
mod projection_support;

use god_object::quasi_statics::{
    HalfSpace, Metric, Projection, Projector, SolverKind, kkt_residual,
};
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
    let mut kept = Vec::with_capacity(PROBLEMS);
    let mut worst = Worst::default();
    for (rows, a_u) in &problems {
        // The next tick: the hand has moved by a hundredth, the rows of the last answer are known.
        let next = a_u + hand_motion(random) * 0.01;
        let ticks = best_times(&mut projector, &metric, [a_u, &next], rows);
        cold.push(ticks.0);
        warm.push(ticks.1);
        kept.push(best_time_prepared(
            &mut projector,
            &metric,
            [a_u, &next],
            rows,
        ));
        worst.take(&metric, a_u, rows, &ticks.2);
        worst.take(&metric, &next, rows, &ticks.3);
    }
    println!("{PROBLEMS} problems, 1 to 60 rows, best of {REPEATS} each");
    report("cold", &mut cold);
    report("warm", &mut warm);
    report("warm, rows kept", &mut kept);
    println!("{worst:?}");

    for count in [100, 1000, 5000] {
        let (mut cold, mut warm, mut kept) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..100 {
            let rows = rows_of(k % 2, count, true, random);
            let a_u = hand_motion(random);
            let next = a_u + hand_motion(random) * 0.01;
            let ticks = best_times(&mut projector, &metric, [&a_u, &next], &rows);
            cold.push(ticks.0);
            warm.push(ticks.1);
            kept.push(best_time_prepared(
                &mut projector,
                &metric,
                [&a_u, &next],
                &rows,
            ));
        }
        report(&format!("{count} rows, cold"), &mut cold);
        report(&format!("{count} rows, warm"), &mut warm);
        report(&format!("{count} rows, kept"), &mut kept);
    }
}

/// What the answers were at their worst, by the residuals that share nothing with the solver.
#[derive(Debug, Default)]
struct Worst {
    kkt_residual: f64,
    restarts: u32,
    iterations: u32,
}

impl Worst {
    fn take(&mut self, metric: &Metric, a_u: &Vector6, rows: &[HalfSpace], answer: &Projection) {
        let residual = kkt_residual(metric, a_u, rows, &answer.acceleration, &answer.active);
        self.kkt_residual = self.kkt_residual.max(residual.largest());
        self.restarts = self.restarts.max(answer.restarts);
        self.iterations = self.iterations.max(answer.iterations);
    }
}

/// Microseconds of two ticks, the first without any history and the second after it, and their answers.
fn best_times(
    projector: &mut Projector,
    metric: &Metric,
    ticks: [&Vector6; 2],
    rows: &[HalfSpace],
) -> (f64, f64, Projection, Projection) {
    let mut best = [f64::INFINITY; 2];
    let mut timed = |tick: usize, warm_start: &[u32]| {
        let start = Instant::now();
        let answer = std::hint::black_box(projector.project(
            metric,
            ticks[tick],
            rows,
            std::hint::black_box(warm_start),
        ));
        best[tick] = best[tick].min(start.elapsed().as_secs_f64() * 1e6);
        answer
    };
    let mut answers = (timed(0, &[]), timed(1, &[]));
    for _ in 0..REPEATS {
        // Both in turn: whatever a projector keeps is that of the tick before.
        answers.0 = timed(0, &[]);
        let own: Vec<u32> = answers.0.active.iter().map(|row| row.row).collect();
        answers.1 = timed(1, &own);
    }
    (best[0], best[1], answers.0, answers.1)
}

/// Microseconds of the second tick where the rows were prepared before the first.
fn best_time_prepared(
    projector: &mut Projector,
    metric: &Metric,
    ticks: [&Vector6; 2],
    rows: &[HalfSpace],
) -> f64 {
    let mut best = f64::INFINITY;
    projector.prepare(metric, rows);
    for _ in 0..REPEATS {
        let first = projector.project_prepared(ticks[0], &[]);
        let own: Vec<u32> = first.active.iter().map(|row| row.row).collect();
        let start = Instant::now();
        let own = std::hint::black_box(&own);
        let answer = std::hint::black_box(projector.project_prepared(ticks[1], own));
        best = best.min(start.elapsed().as_secs_f64() * 1e6);
        assert!(answer.kkt_residual <= 1e-12);
    }
    best
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
