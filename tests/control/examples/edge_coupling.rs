//! Coupling at the edge against shipping forces, over delay and loss: a table, a CSV and a picture:
//! `cargo run --release -p taut-control-tests --example edge_coupling [DIRECTORY]`, `docs/pictures` when none is named.
//!
//! Virtual clock, fixed seed: the same numbers every time. The picture shows what one run per point gave; the table and the CSV all of them.
#![allow(
    clippy::disallowed_methods,
    reason = "an example reads its arguments and writes a picture"
)]

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use plotters::coord::Shift;
use plotters::prelude::*;
use taut_control_tests::edge::{Mode, Outcome, run};
use taut_control_tests::edge_network::Impairment;
use taut_control_tests::edge_scenes::Task;

/// One way, ms.
const DELAYS_MS: [f64; 7] = [0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
/// Of datagrams, each way, %.
const LOSSES_PERCENT: [f64; 4] = [0.0, 1.0, 5.0, 10.0];
/// Losses that the picture shows.
const SHOWN_LOSSES: [f64; 2] = [0.0, 5.0];
const SEED: u64 = 1;
/// Errors that a logarithmic axis can show, in just-noticeable differences.
const SHOWN: std::ops::Range<f64> = 1e-3..1e3;

struct Row {
    task: &'static str,
    mode: Mode,
    delay_ms: f64,
    loss_percent: f64,
    outcome: Outcome,
}

fn main() -> Result<(), Box<dyn Error>> {
    let directory = std::env::args_os().nth(1).map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/pictures"),
        PathBuf::from,
    );
    let rows = rows();
    print_table(&rows);
    std::fs::write(directory.join("edge-coupling.csv"), csv(&rows)?)?;
    draw(&directory.join("edge-coupling.svg"), &rows)
}

fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for task in Task::all() {
        for mode in [Mode::Edge, Mode::Shipped] {
            for loss_percent in LOSSES_PERCENT {
                for delay_ms in DELAYS_MS {
                    let network = Impairment::new(delay_ms, loss_percent);
                    rows.push(Row {
                        task: task.name,
                        mode,
                        delay_ms,
                        loss_percent,
                        outcome: run(&task, mode, network, SEED),
                    });
                }
            }
        }
    }
    rows
}

fn print_table(rows: &[Row]) {
    println!(
        "J: force error against the ideal without delay, in just-noticeable differences; ripple: swing of the force at rest; E: energy given beyond what was taken"
    );
    println!(
        "{:7} {:8} {:>6} {:>6} {:>9} {:>10} {:>9} {:>9} {:>9} {:>8} {:>10} {:>8} {:>7}",
        "task",
        "coupling",
        "delay",
        "loss",
        "",
        "ripple",
        "J p50",
        "J p99",
        "J max",
        "J > 1",
        "E",
        "F max",
        "sent"
    );
    for row in rows {
        let o = &row.outcome;
        println!(
            "{:7} {:8} {:>3} ms {:>4} % {:>9} {:>8.4} N {:>9.4} {:>9.4} {:>9.3} {:>6.2} % {:>7.3} mJ {:>6.2} N {:>4.0}/s",
            row.task,
            row.mode.name(),
            row.delay_ms,
            row.loss_percent,
            if o.stable { "stable" } else { "UNSTABLE" },
            o.ripple,
            o.error.p50,
            o.error.p99,
            o.error.max,
            100.0 * o.noticed,
            1e3 * o.injected,
            o.largest,
            o.datagrams_hz,
        );
    }
}

fn csv(rows: &[Row]) -> Result<String, std::fmt::Error> {
    let mut csv = String::from(
        "task,coupling,delay_ms,loss_percent,stable,ripple_n,jnd_p50,jnd_p95,jnd_p99,jnd_max,share_noticed,energy_injected_j,largest_force_n,datagrams_hz,bytes_hz\n",
    );
    for row in rows {
        let o = &row.outcome;
        writeln!(
            csv,
            "{},{},{},{},{},{:.4e},{:.4e},{:.4e},{:.4e},{:.4e},{:.4e},{:.4e},{:.3},{:.0},{:.0}",
            row.task,
            row.mode.name(),
            row.delay_ms,
            row.loss_percent,
            o.stable,
            o.ripple,
            o.error.p50,
            o.error.p95,
            o.error.p99,
            o.error.max,
            o.noticed,
            o.injected,
            o.largest,
            o.datagrams_hz,
            o.bytes_hz
        )?;
    }
    Ok(csv)
}

/// A panel per task: largest error over delay, one line per coupling and loss; what is unstable has crosses.
fn draw(path: &Path, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, (1480, 440)).into_drawing_area();
    root.fill(&WHITE)?;
    let root = root.titled(
        "Force error against the ideal without delay, in just-noticeable differences, at 1000 N/m. Crosses: unstable. Less than 0.001 is shown as 0.001",
        ("sans-serif", 20),
    )?;
    let panels = root.split_evenly((1, 4));
    let tasks = ["wall", "corner", "dome", "peg"];
    for (k, (panel, task)) in panels.iter().zip(tasks).enumerate() {
        draw_panel(panel, task, k == 0, rows)?;
    }
    root.present()?;
    Ok(())
}

/// The `first` one has the description of its axis and the names of the lines.
fn draw_panel(
    panel: &DrawingArea<SVGBackend<'_>, Shift>,
    task: &str,
    first: bool,
    rows: &[Row],
) -> Result<(), Box<dyn Error>> {
    let end = (DELAYS_MS.len() - 1) as f64;
    let mut chart = ChartBuilder::on(panel)
        .caption(task, ("sans-serif", 18))
        .margin(10)
        .x_label_area_size(38)
        .y_label_area_size(if first { 62 } else { 48 })
        .build_cartesian_2d(0.0..end, SHOWN.log_scale())?;
    chart
        .configure_mesh()
        .x_desc("one-way delay, ms")
        .y_desc(if first { "largest in the run, JND" } else { "" })
        .x_labels(DELAYS_MS.len())
        .x_label_formatter(&|place| {
            let delay = DELAYS_MS.get(place.round() as usize);
            delay.map_or(String::new(), |delay| format!("{delay:.0}"))
        })
        .y_label_formatter(&|jnd| format!("{jnd}"))
        .light_line_style(WHITE)
        .label_style(("sans-serif", 13))
        .draw()?;
    let legend = |style: ShapeStyle| {
        move |(x, y): (i32, i32)| PathElement::new([(x, y), (x + 18, y)], style)
    };
    let black = BLACK.stroke_width(1);
    chart
        .draw_series(LineSeries::new([(0.0, 1.0), (end, 1.0)], black))?
        .label("one just-noticeable difference")
        .legend(legend(black));
    for mode in [Mode::Edge, Mode::Shipped] {
        for loss in SHOWN_LOSSES {
            let (what, colour) = line_of(mode, loss);
            let thick = colour.stroke_width(2);
            let points = errors_by_delay(rows, task, mode, loss);
            let line = points.iter().map(|(x, y, _)| (*x, *y));
            chart
                .draw_series(LineSeries::new(line, thick))?
                .label(format!("{what}, {loss} % lost"))
                .legend(legend(thick));
            let stable = points.iter().filter(|(_, _, stable)| *stable);
            chart.draw_series(stable.map(|(x, y, _)| Circle::new((*x, *y), 4, colour.filled())))?;
            let unstable = points.iter().filter(|(_, _, stable)| !stable);
            chart.draw_series(unstable.map(|(x, y, _)| Cross::new((*x, *y), 5, thick)))?;
        }
    }
    if first {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::Coordinate(8, 215))
            .label_font(("sans-serif", 13))
            .background_style(WHITE.mix(0.8))
            .draw()?;
    }
    Ok(())
}

fn line_of(mode: Mode, loss: f64) -> (&'static str, RGBColor) {
    match (mode, loss > 0.0) {
        (Mode::Edge, false) => ("coupling at the edge", RGBColor(0x1f, 0x77, 0xb4)),
        (Mode::Edge, true) => ("coupling at the edge", RGBColor(0x17, 0xa0, 0xb0)),
        (Mode::Shipped, false) => ("forces shipped", RGBColor(0xd6, 0x27, 0x28)),
        (Mode::Shipped, true) => ("forces shipped", RGBColor(0xff, 0x9a, 0x2e)),
    }
}

/// Place of each delay on the axis, largest error there, and whether the run was stable.
fn errors_by_delay(rows: &[Row], task: &str, mode: Mode, loss: f64) -> Vec<(f64, f64, bool)> {
    let of_delay = |(place, delay): (usize, &f64)| {
        let row = rows.iter().find(|row| {
            row.task == task
                && row.mode == mode
                && row.loss_percent == loss
                && row.delay_ms == *delay
        })?;
        let error = row.outcome.error.max.clamp(SHOWN.start, SHOWN.end);
        Some((place as f64, error, row.outcome.stable))
    };
    DELAYS_MS.iter().enumerate().filter_map(of_delay).collect()
}
