//! The five assemblies, led by exact and by erring hands on every row of their traces, or on each of so many:
//! `cargo run --release -p taut-method-tests --example assembly_scenes [HANDS] [SCENE] [ROWS]`.
//!
//! Prints a table: a line for each scene and hand; times are CPU time of the thread for an update, its force and the hand. Every pose is checked for penetration by code that shares nothing with the method.

use indicatif::{ProgressBar, ProgressStyle};
use taut_method_tests::assembly::{ASSEMBLIES, Assembly, Outcome};
use taut_method_tests::hand::HandError;
use taut_test_kit::thread_cpu_us;

/// Length of the progress bar.
const PARTS: u64 = 1000;

fn main() {
    let hands: u64 = std::env::args()
        .nth(1)
        .and_then(|text| text.parse().ok())
        .unwrap_or(1);
    let only = std::env::args().nth(2).unwrap_or_default();
    let rows = std::env::args()
        .nth(3)
        .and_then(|text| text.parse().ok())
        .unwrap_or(1);
    println!(
        "scene                 hand  updates  unfinished  tries  intersections  least gap  from the goal      turned  update p50    p99    max"
    );
    println!(
        "                                                                              um             um        mrad          us     us     us"
    );
    for assembly in ASSEMBLIES.iter().filter(|a| a.name.contains(&only)) {
        let Some(loaded) = assembly.load() else {
            println!("{:21} skipped: not in the data directory", assembly.name);
            continue;
        };
        let (scene, trace) = match loaded {
            Ok(loaded) => loaded,
            Err(error) => {
                println!("{:21} {error}", assembly.name);
                continue;
            }
        };
        for seed in 0..=hands {
            let hand = (seed > 0).then(|| HandError::of_a_hand(seed));
            let bar = ProgressBar::new(PARTS);
            if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent}% {eta}") {
                bar.set_style(style);
            }
            bar.set_message(format!("{} hand {seed}", assembly.name));
            let mut times = Vec::new();
            // The first update comes after the trees of the independent check are built: it has no time of its own.
            let mut last = None;
            let outcome = Assembly::run(&scene, &trace, hand.as_ref(), rows, 1, |share| {
                times.extend(last.map(|before: f64| thread_cpu_us() - before));
                bar.set_position((share * PARTS as f64) as u64);
                last = Some(thread_cpu_us());
            });
            bar.finish_and_clear();
            print(assembly, seed, &outcome, &mut times);
        }
    }
}

fn print(assembly: &Assembly, hand: u64, outcome: &Outcome, times: &mut [f64]) {
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    let unfinished = outcome.samples.iter().filter(|s| s.report.unfinished);
    println!(
        "{:21} {:>5} {:>8} {:>11} {:>6} {:>14} {:>10.2} {:>14.2} {:>11.3} {:>11.0} {:>6.0} {:>6.0}",
        assembly.name,
        if hand == 0 {
            "exact".into()
        } else {
            hand.to_string()
        },
        outcome.samples.len(),
        unfinished.count(),
        outcome.attempts,
        outcome.penetrations.len(),
        outcome.gap_min * 1e6,
        outcome.distance_to_goal * 1e6,
        outcome.turn_to_goal * 1e3,
        at(0.5),
        at(0.99),
        at(1.0)
    );
}
