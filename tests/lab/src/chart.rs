//! Error against time: J over the 99th percentile of an update, a panel for each recipe, with the Pareto front.
//!
//! J below 0.001 is drawn there: nobody feels the difference. Every point is a row of `chart.csv`.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::clock::RATES;
use crate::measure::Measure;
use crate::method::Method;
use crate::outcome::Outcome;
use crate::report::{KEYS, keys};
use crate::row::{Row, Verdict};

/// Least J of the axis.
const FLOOR: f64 = 1e-3;
/// Range of the axes: us and just-noticeable differences.
const TIMES: [f64; 2] = [0.5, 3000.0];
const ERRORS: [f64; 2] = [0.7e-3, 500.0];
const PANEL: (u32, u32) = (460, 340);
const COLUMNS: usize = 3;
/// Sizes of points, by rate.
const SIZES: [i32; 3] = [7, 5, 3];

fn colour(method: Method) -> RGBColor {
    match method {
        Method::Ours => RGBColor(0, 90, 170),
        Method::OursByDefault => RGBColor(110, 170, 225),
        Method::Paper => RGBColor(200, 90, 0),
        Method::PaperAdapted => RGBColor(230, 170, 60),
        Method::VirtualCoupling => RGBColor(0, 130, 80),
        Method::Penalty => RGBColor(110, 110, 60),
        Method::Discrete => RGBColor(140, 60, 150),
        Method::Point => RGBColor(190, 40, 70),
    }
}

/// A point: time of an update, us, and J.
fn point(outcome: &Outcome) -> (f64, f64) {
    (outcome.times.update[1], outcome.worst(Measure::Felt))
}

/// Whether every row of an outcome is passed.
fn passes(outcome: &Outcome, rows: &[Row]) -> bool {
    let of_it = |row: &&Row| {
        row.recipe == outcome.recipe
            && row.case == outcome.case
            && row.method == outcome.method.name()
            && row.rate == Some(outcome.rate)
    };
    let missed = |row: &Row| matches!(row.verdict, Verdict::Fail | Verdict::Open(_));
    !rows.iter().filter(of_it).any(missed)
}

/// Those that no other one beats in time and J, by time.
fn front(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    sorted.retain(|(_, error)| {
        let better = *error < least; // false for NaN
        if better {
            least = *error;
        }
        better
    });
    sorted
}

/// Writes `speed-accuracy.svg` and `chart.csv`.
pub fn write(rows: &[Row], outcomes: &[Outcome], directory: &Path) -> Result<(), Box<dyn Error>> {
    let mut panels: Vec<(&str, &str)> = Vec::new();
    for outcome in outcomes {
        let panel = (outcome.recipe, outcome.case.as_str());
        let has_answer = !point(outcome).1.is_nan(); // else there is no error to draw
        if has_answer && !panels.contains(&panel) {
            panels.push(panel);
        }
    }
    let lines = panels.len().div_ceil(COLUMNS).max(1);
    let svg = directory.join("speed-accuracy.svg");
    let size = (PANEL.0 * COLUMNS as u32, PANEL.1 * lines as u32 + 90);
    let root = SVGBackend::new(&svg, size).into_drawing_area();
    root.fill(&WHITE)?;
    let root = root.titled(
        "Error felt against time of an update (CPU, 99th percentile)",
        ("sans-serif", 22),
    )?;
    let (legend, grid) = root.split_vertically(50);
    draw_legend(&legend)?;
    let mut csv = format!("panel,{KEYS},update_p99_us,j,on_front\n");
    for (index, (area, panel)) in grid
        .split_evenly((lines, COLUMNS))
        .iter()
        .zip(&panels)
        .enumerate()
    {
        let of_panel: Vec<&Outcome> = outcomes
            .iter()
            .filter(|o| (o.recipe, o.case.as_str()) == *panel)
            .filter(|o| !point(o).1.is_nan())
            .collect();
        let points: Vec<_> = of_panel.iter().map(|o| point(o)).collect();
        let front = front(&points);
        draw_panel(area, panel, &of_panel, &front, rows)?;
        for outcome in of_panel {
            let (time, felt) = point(outcome);
            let on_front = front.contains(&(time, felt));
            let keys = keys(outcome);
            writeln!(csv, "{index},{keys},{time:.2},{felt:.6e},{on_front}")?;
        }
    }
    root.present()?;
    drop(grid);
    std::fs::write(directory.join("chart.csv"), csv)?;
    Ok(())
}

fn shown((time, error): (f64, f64)) -> (f64, f64) {
    (
        time.clamp(TIMES[0], TIMES[1]),
        error.clamp(FLOOR, ERRORS[1]),
    )
}

fn draw_legend(area: &DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), Box<dyn Error>> {
    let mut x = 30;
    for method in Method::ALL {
        area.draw(&Circle::new((x, 16), 6, colour(method).filled()))?;
        area.draw(&Text::new(method.name(), (x + 12, 9), ("sans-serif", 16)))?;
        x += 145;
    }
    for (rate, size) in RATES.iter().zip(SIZES) {
        area.draw(&Circle::new((x, 16), size, BLACK))?;
        let label = format!("{rate} Hz");
        area.draw(&Text::new(label, (x + 12, 9), ("sans-serif", 16)))?;
        x += 80;
    }
    let note = "grey: J = 1 and 1 ms; black: Pareto front; cross: a pass line is missed; J below 0.001 is drawn at 0.001";
    area.draw(&Text::new(note, (24, 32), ("sans-serif", 14)))?;
    Ok(())
}

fn draw_panel(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    (recipe, case): &(&str, &str),
    outcomes: &[&Outcome],
    front: &[(f64, f64)],
    rows: &[Row],
) -> Result<(), Box<dyn Error>> {
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .caption(format!("{recipe}: {case}"), ("sans-serif", 17))
        .x_label_area_size(34)
        .y_label_area_size(54)
        .build_cartesian_2d(
            (TIMES[0]..TIMES[1]).log_scale(),
            (ERRORS[0]..ERRORS[1]).log_scale(),
        )?;
    chart
        .configure_mesh()
        .x_desc("us")
        .y_desc("J")
        .x_labels(5)
        .y_labels(6)
        .label_style(("sans-serif", 13))
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(238, 238, 238))
        .draw()?;
    let grey = RGBColor(120, 120, 120).stroke_width(1);
    for line in [
        [(TIMES[0], 1.0), (TIMES[1], 1.0)],
        [(1000.0, ERRORS[0]), (1000.0, ERRORS[1])],
    ] {
        chart.draw_series(LineSeries::new(line, grey))?;
    }
    let front: Vec<_> = front.iter().map(|place| shown(*place)).collect();
    chart.draw_series(LineSeries::new(front, BLACK.stroke_width(1)))?;
    for outcome in outcomes {
        let size = RATES.iter().position(|rate| *rate == outcome.rate);
        let size = SIZES[size.unwrap_or(0)];
        let place = shown(point(outcome));
        let ink = colour(outcome.method);
        if passes(outcome, rows) {
            chart.draw_series([Circle::new(place, size, ink.filled())])?;
        } else {
            chart.draw_series([Cross::new(place, size, ink.stroke_width(2))])?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::front;

    #[test]
    fn the_front_has_what_nothing_beats() {
        let points = [
            (1.0, 5.0),
            (2.0, 6.0),
            (3.0, 1.0),
            (3.0, 2.0),
            (4.0, f64::NAN),
        ];
        assert_eq!(front(&points), [(1.0, 5.0), (3.0, 1.0)]);
    }
}
