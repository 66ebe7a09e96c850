//! Rows of frames that go together: skew, age, equality, and their going on without the server.

use std::time::Duration;

use taut_proto::barrier::Swap;

use super::row::{Row, brief, worst};
use super::sections::Extent;
use crate::bench::failover::{self, Failover};
use crate::bench::skew::{self, OverTurns, Plan, Skew, Turns};
use crate::bench::{BenchError, Quantiles, leader_process};

/// Swap-call skew of a quiet machine: p50 and p99, us.
const SKEW_US: (f64, f64) = (20.0, 100.0);
/// A turn lasts this part of a latency run.
const SKEW_SHARE: f64 = 5.0;
/// Age of the state at the swap, p99 in ms, by frames per second.
const AGE_MS: [(u64, f64); 2] = [(60, 23.0), (120, 14.0)];

/// Longest that nodes may stand still when whoever leads them dies, ms: 150 of silence, and 100 for a frame, the way, and a machine that is not idle.
const FAILOVER_MS: f64 = 250.0;

fn class(fifo: bool) -> &'static str {
    if fifo { "FIFO" } else { "default class" }
}

/// The turns' figures in order.
fn each(of: &OverTurns) -> String {
    let texts: Vec<_> = of.each.iter().map(|value| brief(*value)).collect();
    texts.join(" ")
}

/// p50 and p99 of a plan: a row's figure is the median of its turns' figures, and all of them stand beside it, with those of the control.
fn skew_of(plan: Plan, run: &Turns) -> [Row; 2] {
    let measure = format!(
        "swap-call skew, {} nodes, {} Hz, {}",
        plan.nodes,
        plan.rate,
        name_of(plan.swap)
    );
    let row = |name: &str, limit, of: fn(&Quantiles) -> f64, more: &str| {
        let own = run.over(|turn| of(&turn.skew_us));
        let control = run.over(|turn| of(&turn.control_us));
        Row::at_most_beside(
            format!("{measure}: {name}, median of {} turns", own.each.len()),
            own.median,
            limit,
            "us",
            (name, control.median),
            format!(
                "turns {}, worst {}; control of bare datagrams {}, median {}{more}",
                each(&own),
                brief(own.worst),
                each(&control),
                brief(control.median)
            ),
        )
    };
    let all = |of: fn(&Skew) -> bool| run.0.iter().all(of);
    let awake = if all(|turn| turn.awake) { "" } else { "not " };
    let more = format!(
        "; {} frames in all, {}, processors {awake}kept awake; overhead {} us; {} lapses",
        run.sum(|turn| turn.skew_us.count as u64),
        class(all(|turn| turn.fifo)),
        brief(run.over(|turn| turn.overhead_us.0).median),
        run.sum(|turn| turn.lapses)
    );
    let (p50, p99) = SKEW_US;
    [
        row("p50", p50, |of| of.p50, &more),
        row("p99", p99, |of| of.p99, ""),
    ]
}

fn name_of(swap: Swap) -> &'static str {
    match swap {
        Swap::Immediate => "immediate",
        Swap::Scheduled => "scheduled",
    }
}

/// Skew, age and equality of frames.
pub(super) fn skew_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let (mut rows, mut ages) = (Vec::new(), Vec::new());
    let (mut compared, mut different, mut frames) = (0, 0, 0);
    for &nodes in extent.screens {
        for (rate, age_ms) in AGE_MS {
            let (mut largest, mut texts) = (f64::MIN, Vec::new());
            for swap in [Swap::Immediate, Swap::Scheduled] {
                let plan = Plan {
                    nodes,
                    rate,
                    swap,
                    duration: Duration::from_secs_f64(extent.seconds / SKEW_SHARE),
                };
                let run = skew::measure_turns(plan, extent.skew_turns)?;
                rows.extend(skew_of(plan, &run));
                let age = run.over(|turn| turn.age_ms.p99);
                // NaN is larger than any.
                if age.median.total_cmp(&largest).is_gt() {
                    largest = age.median;
                }
                texts.push(format!("{}: turns {}", name_of(swap), each(&age)));
                frames += run.sum(|turn| turn.skew_us.count as u64);
                compared += run.sum(|turn| turn.compared);
                different += run.sum(|turn| turn.different);
            }
            let measure = format!(
                "pose age at swap, {nodes} nodes, {rate} Hz: p99, median of {} turns, larger of both swaps",
                extent.skew_turns
            );
            ages.push(Row::at_most(
                measure,
                largest,
                age_ms,
                "ms",
                texts.join("; "),
            ));
        }
    }
    rows.extend(ages);
    rows.push(Row::invariant(
        "released frames of which two nodes drew different states",
        "0",
        format!("{different} of {frames} that all showed; {compared} fingerprints compared by the servers"),
        different == 0 && frames > 0 && compared > 0,
    ));
    Ok(rows)
}

/// While a node leads, beside that while the server did.
fn skew_of_leader(runs: &[Failover], setting: &str) -> Row {
    let over = |of: fn(&Failover) -> f64| OverTurns::of(runs.iter().map(of).collect());
    let led = over(|run| run.skew_us.p99);
    let by_server = over(|run| run.server_skew_us.p99);
    Row::at_most_beside(
        format!(
            "fail-over: swap-call skew while a node leads: p99, median of {} runs",
            led.each.len()
        ),
        led.median,
        SKEW_US.1,
        "us",
        ("p99 while the server leads", by_server.median),
        format!(
            "runs {}; p50 {} us; while the server led {}, median {}; {setting}",
            each(&led),
            brief(over(|run| run.skew_us.p50).median),
            each(&by_server),
            brief(by_server.median),
        ),
    )
}

/// The server dies, then the node that leads, then there is a server again.
pub(super) fn failover_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let mut runs = Vec::new();
    for _ in 0..extent.deaths.min(3) {
        runs.push(failover::measure(&extent.this, extent.node_timeout)?);
    }
    let fifo = runs.iter().all(|run| run.fifo);
    let setting = format!(
        "largest of {}, {} nodes at {} Hz, {}",
        runs.len(),
        failover::NODES,
        leader_process::RATE,
        class(fifo)
    );
    let row = |what: &str, value, limit, unit| {
        Row::at_most(format!("fail-over: {what}"), value, limit, unit, &setting)
    };
    let skewed = runs.iter().map(|run| run.skew_us.count).min().unwrap_or(0);
    let different: u64 = runs.iter().map(|run| run.different).sum();
    Ok(vec![
        row(
            "SIGKILL of the server: longest time between two swaps",
            worst(&runs, |run| run.gap_ms),
            FAILOVER_MS,
            "ms",
        ),
        row(
            "death of the node that leads then: longest time between two swaps",
            worst(&runs, |run| run.second_gap_ms),
            FAILOVER_MS,
            "ms",
        ),
        skew_of_leader(&runs, &setting),
        row(
            "nodes back, from the start of the next server's process",
            worst(&runs, |run| run.back_s),
            2.0,
            "s",
        ),
        row(
            "longest time between two swaps around that return",
            worst(&runs, |run| run.return_gap_ms),
            FAILOVER_MS,
            "ms",
        ),
        Row::invariant(
            "fail-over: frames without a server of which two nodes drew different states",
            "0",
            format!("{different}; {skewed} frames shown by all, in the run with fewest"),
            different == 0 && skewed > 0,
        ),
    ])
}
