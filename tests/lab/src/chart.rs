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
use crate::plot::{Frame, Mark, PANEL, front};
use crate::report::{KEYS, keys};
use crate::row::{Row, Verdict};

/// Range of the axes: us and just-noticeable differences.
const TIMES: [f64; 2] = [0.5, 3000.0];
const ERRORS: [f64; 2] = [0.7e-3, 500.0];
const COLUMNS: usize = 3;
/// Sizes of points, by rate.
const SIZES: [i32; 3] = [7, 5, 3];

pub(crate) fn colour(method: Method) -> RGBColor {
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

/// The panels that have errors to draw: recipe and case, in their order.
pub(crate) fn panels(outcomes: &[Outcome]) -> Vec<(&str, &str)> {
    let mut panels: Vec<(&str, &str)> = Vec::new();
    for outcome in outcomes {
        let panel = (outcome.recipe, outcome.case.as_str());
        let has_answer = !point(outcome).1.is_nan(); // else there is no error to draw
        if has_answer && !panels.contains(&panel) {
            panels.push(panel);
        }
    }
    panels
}

/// Axes and points of a panel.
pub(crate) fn panel(
    (recipe, case): (&str, &str),
    outcomes: &[Outcome],
    rows: &[Row],
) -> (Frame, Vec<Mark>) {
    let frame = Frame {
        title: format!("{recipe}: {case}"),
        costs: TIMES,
        cost: "p99 of an update, us",
        cost_line: Some(1000.0),
        errors: ERRORS,
        unit: "error felt, J",
        error_line: Some(1.0),
    };
    let of_panel = |o: &&Outcome| (o.recipe, o.case.as_str()) == (recipe, case);
    let drawn = outcomes.iter().filter(of_panel);
    let marks = drawn.filter(|o| !point(o).1.is_nan()).map(|outcome| {
        let size = RATES.iter().position(|rate| *rate == outcome.rate);
        Mark {
            place: point(outcome),
            colour: colour(outcome.method),
            size: SIZES[size.unwrap_or(0)],
            passes: passes(outcome, rows),
            label: String::new(),
        }
    });
    (frame, marks.collect())
}

/// Writes `speed-accuracy.svg` and `chart.csv`.
pub fn write(rows: &[Row], outcomes: &[Outcome], directory: &Path) -> Result<(), Box<dyn Error>> {
    let panels = panels(outcomes);
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
    let mut csv = format!("panel,{KEYS},j,update_p99_us,on_front\n");
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
        let (frame, marks) = self::panel(*panel, outcomes, rows);
        frame.draw(area, &marks)?;
        for outcome in of_panel {
            let (time, felt) = point(outcome);
            let on_front = front.contains(&(time, felt));
            let keys = keys(outcome);
            writeln!(csv, "{index},{keys},{felt:.6e},{time:.2},{on_front}")?;
        }
    }
    root.present()?;
    drop(grid);
    std::fs::write(directory.join("chart.csv"), csv)?;
    Ok(())
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
