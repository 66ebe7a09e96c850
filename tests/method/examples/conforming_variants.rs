//! Conforming contact in many variants, and bunnies: times, rows, force errors, and the worst row of each column.
//! `cargo run --release -p taut-method-tests --example conforming_variants -- [--quick] [--case NAME] [--repeats N] [--seed N | --seeds N] [--hands N]
//! [--rounds N]`.
//!
//! Variants `v0`, `v1`, ... cover every two levels of two factors; others have names (`peg`, `peg-floor`, ...). `bunnies` and `motions` need
//! the test data. Times are CPU time of the thread, us; of `--repeats` runs the median of each percentile is printed. `work` is what the counted work
//! would take on a nominal machine, us: it is the same in every run. `--case` runs the cases whose
//! name begins so; `--quick` runs coarser meshes, 2,000 triangles each, for a hundred updates. `--seeds N` runs the designs of the seeds 1 to N, without
//! the named cases and the bunnies, and prints those rows alone whose force is off by more than 1 %.
//! `--hands N` (default 4): of how many hands the bunnies' forces are judged. `--rounds N` (default 0): how often rows are linearised anew.

#[path = "conforming_variants/bunnies.rs"]
mod bunnies;

use taut_method_tests::variants::measure::{Course, Outcome, quantile, run};
use taut_method_tests::variants::oracle::Oracle;
use taut_method_tests::variants::{Variant, covering, named};
use taut_test_kit::thread_cpu_us;

/// A column: its heading, and the value of a case.
type Column = (&'static str, fn(&Outcome) -> f64);

/// Of many designs, rows that are off by less are not printed.
const SHOWN_ERROR: f64 = 0.01;

const COLUMNS: [Column; 13] = [
    ("p50", |o| quantile(&o.update, 0.5)),
    ("p99", |o| quantile(&o.update, 0.99)),
    ("max", |o| quantile(&o.update, 1.0)),
    ("work p99", |o| quantile(&o.work, 0.99)),
    ("work max", |o| quantile(&o.work, 1.0)),
    ("force p99", |o| quantile(&o.force, 0.99)),
    ("error %", |o| 100.0 * quantile(&o.errors, 1.0)),
    ("rows p50", |o| quantile(&o.rows, 0.5)),
    ("rows max", |o| quantile(&o.rows, 1.0)),
    ("pairs", |o| o.pairs as f64),
    ("truncated", |o| f64::from(o.truncated)),
    ("failures", |o| f64::from(o.failures)),
    ("penetrate", |o| f64::from(o.penetrations)),
];

struct Arguments {
    quick: bool,
    case: String,
    repeats: usize,
    seed: u64,
    /// Designs of this many seeds, from 1 on; 0 is that of `seed` alone.
    seeds: u64,
    /// That slide a bunny, where its force is judged.
    hands: u64,
    /// How often rows are linearised anew.
    rounds: u32,
}

impl Arguments {
    fn read() -> Result<Self, String> {
        let mut read = Self {
            quick: false,
            case: String::new(),
            repeats: 3,
            seed: 1,
            seeds: 0,
            hands: 4,
            rounds: 0,
        };
        let mut given = std::env::args().skip(1);
        while let Some(key) = given.next() {
            if key == "--quick" {
                read.quick = true;
                continue;
            }
            let value = given.next().ok_or_else(|| format!("{key} needs a value"))?;
            let number = || {
                value
                    .parse()
                    .map_err(|_| format!("{key} {value}: not a number"))
            };
            match key.as_str() {
                "--case" => read.case.clone_from(&value),
                "--repeats" => read.repeats = usize::try_from(number()?).unwrap_or(1).max(1),
                "--seed" => read.seed = number()?,
                "--seeds" => read.seeds = number()?,
                "--hands" => read.hands = number()?.max(1),
                "--rounds" => read.rounds = u32::try_from(number()?).unwrap_or(u32::MAX),
                _ => {
                    let keys = "--quick, --case, --repeats, --seed, --seeds, --hands or --rounds";
                    return Err(format!("{key}: give {keys}"));
                }
            }
        }
        Ok(read)
    }

    fn wants(&self, name: &str) -> bool {
        name.starts_with(&self.case)
    }

    fn command(&self, seed: u64, case: &str) -> String {
        let quick = if self.quick { "--quick " } else { "" };
        format!("{quick}--seed {seed} --case {case}")
    }

    /// Whether a row is printed: of many designs those alone that are wrong.
    fn shows(&self, outcome: &Outcome) -> bool {
        self.seeds == 0 || quantile(&outcome.errors, 1.0) > SHOWN_ERROR
    }
}

fn main() -> Result<(), String> {
    let arguments = Arguments::read()?;
    let triangles = if arguments.quick { 2_000 } else { 26_000 };
    let seeds = match arguments.seeds {
        0 => arguments.seed..=arguments.seed,
        all => 1..=all,
    };
    print!("{:20} {:>13}", "case", "triangles");
    COLUMNS.iter().for_each(|(name, _)| print!(" {name:>9}"));
    println!("  what");
    let mut table: Vec<(String, [f64; COLUMNS.len()])> = Vec::new();
    let mut oracle = Oracle::default();
    for seed in seeds {
        let mut variants = covering(triangles, seed);
        if !arguments.quick && arguments.seeds == 0 {
            variants.extend(named());
        }
        for variant in variants.iter().filter(|v| arguments.wants(&v.name)) {
            let values = measured(variant, seed, &arguments, &mut oracle);
            table.push((arguments.command(seed, &variant.name), values));
        }
    }
    println!("worst of each column, of {} cases:", table.len());
    for (k, (heading, _)) in COLUMNS.iter().enumerate() {
        let worst = table.iter().max_by(|a, b| a.1[k].total_cmp(&b.1[k]));
        if let Some((command, values)) = worst {
            println!("{heading:>10}: {:10.3}  {command}", values[k]);
        }
    }
    if arguments.seeds == 0 {
        bunnies::run(&arguments.case, arguments.repeats, arguments.hands);
    }
    Ok(())
}

/// Runs and prints one variant: the median over the repeats of each column.
fn measured(
    variant: &Variant,
    seed: u64,
    arguments: &Arguments,
    oracle: &mut Oracle,
) -> [f64; COLUMNS.len()] {
    let steps = if arguments.quick { 100 } else { 400 };
    let stride = steps / 20;
    let mut outcomes = Vec::new();
    for repeat in 0..arguments.repeats {
        // Runs are the same but for their times: the oracle is asked once.
        let stride = if repeat == 0 { stride } else { 0 };
        let course = Course {
            steps,
            stride,
            implicit_rounds: arguments.rounds,
        };
        outcomes.push(run(variant, &course, oracle, thread_cpu_us));
    }
    let first = outcomes[0].clone();
    let values = COLUMNS.map(|(name, value)| {
        let timed = ["p50", "p99", "max", "force p99"].contains(&name);
        if timed {
            let all: Vec<f64> = outcomes.iter().map(value).collect();
            quantile(&all, 0.5)
        } else {
            value(&first)
        }
    });
    if !arguments.shows(&first) {
        return values;
    }
    let [mine, others] = first.triangles;
    let name = match arguments.seeds {
        0 => variant.name.clone(),
        _ => format!("{} of seed {seed}", variant.name),
    };
    print!("{name:20} {:>13}", format!("{mine}/{others}"));
    values.iter().for_each(|value| print!(" {value:9.2}"));
    println!(
        "  {:?} {:?} {:?} {:?} {:.0} um, {}x{} in {}x{}, turned {:.2}, rough {:.0} um, crown {:.0} um{}",
        variant.fit,
        variant.motion,
        variant.feel,
        variant.moving,
        variant.clearance * 1e6,
        variant.body.facets,
        variant.body.bands,
        variant.obstacle.facets,
        variant.obstacle.bands,
        variant.turned,
        variant.roughness * 1e6,
        variant.crown * 1e6,
        if variant.floor { ", floor" } else { "" },
    );
    values
}
