//! Rows of frames that go together: skew, age, equality, and their going on without the server.

use std::time::Duration;

use taut_proto::barrier::Swap;

use super::row::{Row, brief};
use super::sections::Extent;
use crate::bench::skew::{self, Plan};
use crate::bench::{BenchError, Quantiles, failover};

/// Swap-call skew of a quiet machine: p50 and p99, us.
const SKEW_US: (f64, f64) = (20.0, 100.0);
/// Age of the state at the swap, p99 in ms, by frames per second.
const AGE_MS: [(u64, f64); 2] = [(60, 23.0), (120, 14.0)];

/// Longest that nodes may stand still when whoever leads them dies, ms: 150 of silence, and 100 for a frame, the way, and a machine that is not idle.
const FAILOVER_MS: f64 = 250.0;

fn quantiles(of: &Quantiles) -> String {
    format!(
        "p50/p99/p99.9 {}/{}/{}",
        brief(of.p50),
        brief(of.p99),
        brief(of.p999)
    )
}

fn class(fifo: bool) -> &'static str {
    if fifo { "FIFO" } else { "default class" }
}

/// Two and four nodes at 60 and 120 Hz, immediate and scheduled.
pub(super) fn skew_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let (mut rows, mut ages) = (Vec::new(), Vec::new());
    let (mut compared, mut different, mut frames) = (0, 0, 0);
    for &nodes in extent.screens {
        for (rate, age_ms) in AGE_MS {
            let mut worst: Option<(f64, String)> = None;
            for swap in [Swap::Immediate, Swap::Scheduled] {
                let run = skew::measure(Plan {
                    nodes,
                    rate,
                    swap,
                    duration: Duration::from_secs_f64(extent.seconds / 2.0),
                })?;
                let name = format!("{swap:?}").to_lowercase();
                let beside = format!(
                    "{} frames, {}; {} us; control of bare datagrams {} us; overhead p50/p99 {}/{} us; {} lapses",
                    run.skew_us.count,
                    class(run.fifo),
                    quantiles(&run.skew_us),
                    quantiles(&run.control_us),
                    brief(run.overhead_us.0),
                    brief(run.overhead_us.1),
                    run.lapses
                );
                let measure = format!("swap-call skew, {nodes} nodes, {rate} Hz, {name}");
                let (p50, p99) = SKEW_US;
                rows.push(Row::at_most(
                    format!("{measure}: p50"),
                    run.skew_us.p50,
                    p50,
                    "us",
                    beside,
                ));
                let control = format!("control {} us", brief(run.control_us.p99));
                rows.push(Row::at_most(
                    format!("{measure}: p99"),
                    run.skew_us.p99,
                    p99,
                    "us",
                    control,
                ));
                let text = format!("{name}: {} ms", quantiles(&run.age_ms));
                // NaN is larger than any.
                let larger = |(before, _): &(f64, String)| run.age_ms.p99.total_cmp(before).is_gt();
                if worst.as_ref().is_none_or(larger) {
                    worst = Some((run.age_ms.p99, text));
                }
                frames += run.skew_us.count as u64;
                compared += run.compared;
                different += run.different;
            }
            let (p99, text) = worst.unwrap_or((f64::NAN, String::new()));
            let measure =
                format!("pose age at swap, {nodes} nodes, {rate} Hz: p99, larger of both swaps");
            ages.push(Row::at_most(measure, p99, age_ms, "ms", text));
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

/// The server dies, then the node that leads, then there is a server again.
pub(super) fn failover_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let mut runs = Vec::new();
    for _ in 0..extent.deaths.min(3) {
        runs.push(failover::measure(&extent.this, extent.node_timeout)?);
    }
    let worst = |of: fn(&failover::Failover) -> f64| {
        let values = runs.iter().map(of);
        values.max_by(f64::total_cmp).unwrap_or(f64::NAN)
    };
    let fifo = runs.iter().all(|run| run.fifo);
    let setting = format!(
        "largest of {}, {} nodes at {} Hz, {}",
        runs.len(),
        failover::NODES,
        failover::RATE,
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
            worst(|run| run.gap_ms),
            FAILOVER_MS,
            "ms",
        ),
        row(
            "death of the node that leads then: longest time between two swaps",
            worst(|run| run.second_gap_ms),
            FAILOVER_MS,
            "ms",
        ),
        Row::at_most(
            "fail-over: swap-call skew while a node leads: p99",
            worst(|run| run.skew_us.p99),
            SKEW_US.1,
            "us",
            format!(
                "p50 {} us; while the server led {}/{} us; {setting}",
                brief(worst(|run| run.skew_us.p50)),
                brief(worst(|run| run.server_skew_us.p50)),
                brief(worst(|run| run.server_skew_us.p99)),
            ),
        ),
        row(
            "nodes back, from the start of the next server's process",
            worst(|run| run.back_s),
            2.0,
            "s",
        ),
        row(
            "longest time between two swaps around that return",
            worst(|run| run.return_gap_ms),
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
