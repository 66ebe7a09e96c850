//! How far apart nodes call their swaps, also under load: the run of the report's section `skew`, with nodes, rates and load of one's choice.
//!
//! `cargo run --release -p taut-network-tests --example swap_skew -- [--seconds S] [--nodes 2,4] [--rates 60,120] [--loads 0,2]`
//!
//! A load of N is N threads of the default class that spin.
#![allow(clippy::print_stdout, reason = "a program that measures and prints")]

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use taut_network_tests::bench::skew::{Plan, measure};
use taut_proto::barrier::Swap;

struct Wanted {
    seconds: u64,
    nodes: Vec<u64>,
    rates: Vec<u64>,
    loads: Vec<u64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let wanted = wanted()?;
    println!("times in us, age in ms; control: wake-ups by bare datagrams");
    println!(
        "{:>5} {:>4} {:>9} {:>5} {:>4} | {:>6} | {:>20} | {:>17} | {:>13} | {:>11} | {:>5} {:>5}",
        "nodes",
        "Hz",
        "swap",
        "load",
        "fifo",
        "frames",
        "skew p50 p99 p999",
        "control p50 p99",
        "overhd p50 p99",
        "age p50 p99",
        "laps",
        "diff"
    );
    for &busy in &wanted.loads {
        // Before the run, whose threads get the real-time class.
        let stop = Arc::new(AtomicBool::new(false));
        let mut load = Vec::new();
        for _ in 0..busy {
            let stop = stop.clone();
            let spin = move || {
                while !stop.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            };
            load.push(
                std::thread::Builder::new()
                    .name("load".to_owned())
                    .spawn(spin)?,
            );
        }
        for &nodes in &wanted.nodes {
            for &rate in &wanted.rates {
                for swap in [Swap::Immediate, Swap::Scheduled] {
                    let duration = Duration::from_secs(wanted.seconds);
                    tell(
                        &Plan {
                            nodes,
                            rate,
                            swap,
                            duration,
                        },
                        busy,
                    )?;
                }
            }
        }
        stop.store(true, Ordering::Relaxed);
        for thread in load {
            thread.join().map_err(|_| "the load panicked")?;
        }
    }
    Ok(())
}

fn tell(plan: &Plan, busy: u64) -> Result<(), Box<dyn Error>> {
    let run = measure(*plan)?;
    println!(
        "{:>5} {:>4} {:>9} {busy:>5} {:>4} | {:>6} | {:>6.0} {:>6.0} {:>6.0} | {:>8.0} {:>8.0} | {:>6.0} {:>6.0} | {:>5.1} {:>5.1} | {:>5} {:>5}",
        plan.nodes,
        plan.rate,
        format!("{:?}", plan.swap).to_lowercase(),
        if run.fifo { "yes" } else { "no" },
        run.skew_us.count,
        run.skew_us.p50,
        run.skew_us.p99,
        run.skew_us.p999,
        run.control_us.p50,
        run.control_us.p99,
        run.overhead_us.0,
        run.overhead_us.1,
        run.age_ms.p50,
        run.age_ms.p99,
        run.lapses,
        run.different
    );
    Ok(())
}

fn wanted() -> Result<Wanted, Box<dyn Error>> {
    let mut wanted = Wanted {
        seconds: 10,
        nodes: vec![2, 4],
        rates: vec![60, 120],
        loads: vec![0],
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(option) = arguments.next() {
        let value = arguments.next().ok_or("an option without a value")?;
        let list = || {
            value
                .split(',')
                .map(str::parse)
                .collect::<Result<Vec<u64>, _>>()
        };
        match option.as_str() {
            "--seconds" => wanted.seconds = value.parse()?,
            "--nodes" => wanted.nodes = list()?,
            "--rates" => wanted.rates = list()?,
            "--loads" => wanted.loads = list()?,
            other => return Err(format!("{other} is no option").into()),
        }
    }
    Ok(wanted)
}
