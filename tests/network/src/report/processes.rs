//! Rows of whole processes of `taut` that die: the server with a hand at its device, and a node that draws.

use super::row::{Row, worst};
use super::sections::Extent;
use crate::bench::death::Death;
use crate::bench::{BenchError, screen_death, server_kill};

/// Why there is no program; `None` where there is one.
pub(super) fn missing(extent: &Extent) -> Option<String> {
    (!extent.program.is_file()).then(|| {
        format!(
            "{} is not there; cargo build --release -p taut --no-default-features --features render, or --taut PROGRAM",
            extent.program.display()
        )
    })
}

/// `taut serve` is killed while a hand behind `taut bridge` feels a force.
pub(super) fn server_kill_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let measure = "SIGKILL of the server";
    if let Some(why) = missing(extent) {
        let target = "clients back <= 2 s, zero force <= 120 ms";
        return Ok(vec![Row::unknown(measure, target, why)]);
    }
    let mut runs = Vec::new();
    for _ in 0..extent.deaths.min(3) {
        runs.push(server_kill::measure(&extent.program)?);
    }
    let times = format!("largest of {}", runs.len());
    let sessions = runs
        .iter()
        .map(|run| run.bridge_sessions)
        .fold(2.0, f64::min);
    Ok(vec![
        Row::at_most(
            format!("{measure}: nodes joined again, from its next start"),
            worst(&runs, |run| run.back_s),
            2.0,
            "s",
            &times,
        ),
        Row::at_most(
            format!("{measure}: oldest force at the device"),
            worst(&runs, |run| run.oldest_force_ms),
            120.0,
            "ms",
            format!(
                "{times}; forces up to {:.1} N, longest period of the bridge's loop {:.1} ms",
                worst(&runs, |run| run.largest_force_n),
                worst(&runs, |run| run.longest_period_ms)
            ),
        ),
        Row::invariant(
            format!("{measure}: sessions of the bridge"),
            "2",
            sessions,
            sessions >= 2.0,
        ),
    ])
}

/// `taut render --headless` is killed, and stopped, while others draw in step with it.
pub(super) fn screen_death_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let measure = "of a node that draws";
    if let Some(why) = missing(extent) {
        let target = "gap <= 3 frames, let go <= 600 ms, back <= 1 s";
        return Ok(vec![Row::unknown(measure, target, why)]);
    }
    let mut rows = Vec::new();
    for (death, signal) in [(Death::Killed, "SIGKILL"), (Death::Stopped, "SIGSTOP")] {
        let mut runs = Vec::new();
        for _ in 0..extent.deaths.min(3) {
            runs.push(screen_death::measure(&extent.program, death)?);
        }
        let times = format!("largest of {}", runs.len());
        rows.push(Row::at_most(
            format!("{signal} {measure}: others' longest time between two swaps"),
            worst(&runs, |run| run.longest_gap_frames),
            3.0,
            "frames",
            format!(
                "{times}, {} Hz, without a graphics card; {:.2} before the death",
                screen_death::RATE,
                worst(&runs, |run| run.control_gap_frames)
            ),
        ));
        let since = match death {
            Death::Killed => "from the start of its process",
            Death::Stopped => "from its going on",
        };
        let let_go_s = worst(&runs, |run| run.let_go_s);
        let back_s = worst(&runs, |run| run.back_s);
        let subject = format!("{signal} {measure}");
        rows.extend(let_go_and_back(&subject, let_go_s, (since, back_s), &times));
    }
    Ok(rows)
}

/// How soon a node that died was let go, and how soon it was back.
pub(super) fn let_go_and_back(
    subject: &str,
    let_go_s: f64,
    (since, back_s): (&str, f64),
    times: &str,
) -> [Row; 2] {
    let let_go = format!("{subject}: let go by the server");
    let back = format!("{subject}: joined again, {since}");
    [
        Row::at_most(let_go, let_go_s * 1e3, 600.0, "ms", times),
        Row::at_most(back, back_s, 1.0, "s", times),
    ]
}
