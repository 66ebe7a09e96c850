//! Rows of whole processes of `taut` that die: the server with a hand at its device, and a node that draws.

use super::row::Row;
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
    let worst = |of: fn(&server_kill::ServerKill) -> f64| {
        let values = runs.iter().map(of);
        values.max_by(f64::total_cmp).unwrap_or(f64::NAN)
    };
    let times = format!("largest of {}", runs.len());
    let sessions = runs
        .iter()
        .map(|run| run.bridge_sessions)
        .fold(2.0, f64::min);
    Ok(vec![
        Row::at_most(
            format!("{measure}: nodes joined again, from its next start"),
            worst(|run| run.back_s),
            2.0,
            "s",
            &times,
        ),
        Row::at_most(
            format!("{measure}: oldest force at the device"),
            worst(|run| run.oldest_force_ms),
            120.0,
            "ms",
            format!(
                "{times}; forces up to {:.1} N, longest period of the bridge's loop {:.1} ms",
                worst(|run| run.largest_force_n),
                worst(|run| run.longest_period_ms)
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
        let worst = |of: fn(&screen_death::ScreenDeath) -> f64| {
            let values = runs.iter().map(of);
            values.max_by(f64::total_cmp).unwrap_or(f64::NAN)
        };
        let times = format!("largest of {}", runs.len());
        rows.push(Row::at_most(
            format!("{signal} {measure}: others' longest time between two swaps"),
            worst(|run| run.longest_gap_frames),
            3.0,
            "frames",
            format!(
                "{times}, {} Hz, without a graphics card; {:.2} before the death",
                screen_death::RATE,
                worst(|run| run.control_gap_frames)
            ),
        ));
        rows.push(Row::at_most(
            format!("{signal} {measure}: let go by the server"),
            worst(|run| run.let_go_s * 1e3),
            600.0,
            "ms",
            &times,
        ));
        let since = match death {
            Death::Killed => "from the start of its process",
            Death::Stopped => "from its going on",
        };
        rows.push(Row::at_most(
            format!("{signal} {measure}: joined again, {since}"),
            worst(|run| run.back_s),
            1.0,
            "s",
            &times,
        ));
    }
    Ok(rows)
}
