//! Rows of the soak: what held for hours, and what grew.

use std::time::Duration;

use super::processes::missing;
use super::row::Row;
use super::sections::Extent;
use crate::bench::soak_log::SoakLog;
use crate::bench::{BenchError, soak, soak_program};

const SEED: u64 = 21;

fn not_asked_for(what: &str) -> Vec<Row> {
    vec![Row::unknown(
        what,
        "no promise broken",
        "--soak SECONDS runs it",
    )]
}

pub(super) fn of_links(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let Some(seconds) = extent.soak_seconds else {
        return Ok(not_asked_for("soak"));
    };
    let duration = Duration::from_secs_f64(seconds);
    let mut log = SoakLog::open(extent.soak_log.as_deref())?;
    let run = soak::run(duration, SEED, &mut log)?;
    let server = &run.server;
    let forged_counted =
        server.garbage + server.wrong_version + server.forged + server.replayed + server.flooded;
    let mut rows = vec![
        Row::invariant(
            format!(
                "soak of {} s: states wrong or out of order",
                duration.as_secs_f64()
            ),
            "0",
            format!(
                "{} of {} taken; {} joined, {} left, {} vanished, {} refused for their key, {} joins lost to the network",
                run.wrong,
                run.received,
                run.joined,
                run.left,
                run.vanished,
                run.refused,
                run.failed_joins
            ),
            run.wrong == 0 && run.received > 0 && run.joined > 0,
        ),
        Row::invariant(
            "soak: events missing or doubled",
            "0",
            format!("{} of {}", run.wrong_events, run.events),
            run.wrong_events == 0 && run.events > 0,
        ),
        Row::invariant(
            "soak: times that all had left and the server had let all go",
            "all",
            run.quiet,
            run.quiet > 0,
        ),
        Row::invariant(
            "soak: forgeries at the server's own port that are counted, and change nothing",
            "all",
            format!(
                "{forged_counted} counted for {} forged and what the relay damaged; {} inputs",
                run.forged, server.inputs
            ),
            forged_counted >= run.forged && server.inputs == 0 && server.inputs_refused == 0,
        ),
    ];
    rows.push(growth("soak", &log));
    Ok(rows)
}

pub(super) fn of_program(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    const WHAT: &str = "soak of the whole program";
    if let Some(why) = missing(extent) {
        return Ok(vec![Row::unknown(WHAT, "no promise broken", why)]);
    }
    let Some(seconds) = extent.soak_seconds else {
        return Ok(not_asked_for(WHAT));
    };
    let duration = Duration::from_secs_f64(seconds);
    let mut log = SoakLog::open(extent.soak_log.as_deref())?;
    let run = soak_program::run(&extent.program, duration, SEED, &mut log)?;
    let broken = log.broken();
    let first = broken
        .first()
        .map_or(String::new(), |what| format!(", the first: {what}"));
    Ok(vec![
        Row::invariant(
            format!(
                "{WHAT}: promises broken (penetration, age and slew of the force, order, events, coming back)"
            ),
            "0",
            format!(
                "{}{first}; {} states, largest force {:.1} N; {} nodes, {} observers, {} bridges, {} servers went and came",
                broken.len(),
                run.states,
                run.largest_force_n,
                run.nodes,
                run.observers,
                run.bridges,
                run.servers
            ),
            broken.is_empty() && run.states > 0,
        ),
        growth(WHAT, &log),
    ])
}

/// One row for all resources of all processes; the one that comes nearest to its limit is named.
fn growth(what: &str, log: &SoakLog) -> Row {
    let all = log.growth();
    let grown: Vec<String> = all
        .iter()
        .filter(|growth| growth.is_growth())
        .map(|growth| {
            let [from, to] = growth.medians;
            format!("{}: {} {from} to {to}", growth.process, growth.what)
        })
        .collect();
    let memory = all.iter().filter(|growth| growth.what == "resident memory");
    let most = memory.map(|growth| (growth.medians[1] - growth.medians[0]) / f64::from(1 << 20));
    let most = most.fold(f64::NAN, f64::max);
    Row::invariant(
        format!(
            "{what}: growth of memory, descriptors or threads from the second to the last quarter"
        ),
        "none beyond the allocator's",
        if grown.is_empty() {
            format!(
                "none in {} processes; resident memory {most:+.1} MiB at most",
                all.len() / 3
            )
        } else {
            grown.join("; ")
        },
        grown.is_empty() && !all.is_empty(),
    )
}
