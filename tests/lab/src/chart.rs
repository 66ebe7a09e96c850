//! Error against cost: J over the share of one core that updates and forces take, a panel for each recipe, with the Pareto front.
//!
//! J below 0.001 is drawn there: nobody feels the difference. Every point is a row of `chart.csv`.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use plotters::prelude::*;

use crate::clock::RATES;
use crate::measure::Measure;
use crate::method::Method;
use crate::outcome::Outcome;
use crate::plot::{Area, Drawn, Frame, Mark, PANEL, front, svg};
use crate::report::{KEYS, keys};
use crate::row::Row;

/// Range of the axes: shares of a core and just-noticeable differences.
const SHARES: [f64; 2] = [1e-4, 3.0];
const ERRORS: [f64; 2] = [0.7e-3, 500.0];
const COLUMNS: usize = 3;
/// The scenes of `tradeoff.svg`: every method that turns its body has a part in them.
const CANONICAL: [(&str, &str); 10] = [
    ("R02", "ball on a plane"),
    ("R04", "box on a plane, tilted"),
    ("R06", "ball in a groove of 45 degrees"),
    ("R08", "edge of 90 degrees"),
    ("R09", "plate of 0.1 mm"),
    ("R11", "0.3 m/s"),
    ("R12", "radius 20 mm, 0.2 m/s"),
    ("R13", "end of a plate"),
    ("R18", "in the hole, clearance 0.1 mm"),
    ("R25", "combs, clearance 0.05 mm"),
];
const CANONICAL_COLUMNS: usize = 2;
/// Height of title and legend, pixels.
const CANONICAL_HEAD: u32 = 134;
/// Methods in a line of the legend of `speed-accuracy.svg`.
const LEGEND_COLUMNS: usize = 6;
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
        Method::StaticCoupling => RGBColor(0, 160, 180),
        Method::LinearisedPenalty => RGBColor(125, 75, 40),
        Method::TwoRateLcp => RGBColor(235, 105, 165),
        Method::Point => RGBColor(190, 40, 70),
        Method::DoesNothing | Method::RandomForce => BLACK,
    }
}

/// A point: share of one core that the method takes, and J.
fn point(outcome: &Outcome) -> (f64, f64) {
    (outcome.measured.load.core, outcome.worst(Measure::JndP95))
}

/// Least and largest J over the start phases.
fn band(outcome: &Outcome) -> [f64; 2] {
    let felt = || {
        outcome
            .measured
            .phases
            .iter()
            .map(|phase| phase.get(Measure::JndP95))
    };
    [
        felt().fold(f64::INFINITY, f64::min),
        felt().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// Whether every row of an outcome is passed.
pub(crate) fn passes(outcome: &Outcome, rows: &[Row]) -> bool {
    let of_it = |row: &&Row| {
        row.recipe == outcome.recipe
            && row.case == outcome.case
            && row.method == outcome.method.name()
            && row.rate == Some(outcome.rate)
    };
    !rows.iter().filter(of_it).any(Row::is_missed)
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

/// The outcomes of a panel that have an error to draw.
fn of_panel<'a>(panel: (&str, &str), outcomes: &'a [Outcome]) -> Vec<&'a Outcome> {
    let of_it = |o: &&Outcome| (o.recipe, o.case.as_str()) == panel && !point(o).1.is_nan();
    outcomes.iter().filter(of_it).collect()
}

/// Axes and points of a panel.
pub(crate) fn panel(
    (recipe, case): (&str, &str),
    outcomes: &[Outcome],
    rows: &[Row],
) -> (Frame, Vec<Mark>) {
    let frame = Frame {
        title: format!("{recipe}: {case}"),
        costs: SHARES,
        cost: "share of one core",
        cost_line: Some(1.0),
        errors: ERRORS,
        unit: "error felt, J at p95",
        error_line: Some(1.0),
    };
    let drawn = of_panel((recipe, case), outcomes).into_iter();
    let marks = drawn.map(|outcome| {
        let size = RATES.iter().position(|rate| *rate == outcome.rate);
        Mark {
            place: point(outcome),
            band: band(outcome),
            colour: colour(outcome.method),
            size: SIZES[size.unwrap_or(0)],
            passes: passes(outcome, rows),
            label: String::new(),
        }
    });
    (frame, marks.collect())
}

/// `tradeoff.svg`: the panels of ten canonical scenes, as far as they were run; `None` where none was.
fn canonical(rows: &[Row], outcomes: &[Outcome]) -> Result<Option<String>, Box<dyn Error>> {
    let drawn: Vec<_> = (CANONICAL.iter())
        .filter(|panel| panels(outcomes).contains(panel))
        .collect();
    if drawn.is_empty() {
        return Ok(None);
    }
    let lines = drawn.len().div_ceil(CANONICAL_COLUMNS);
    let width = PANEL.0 * CANONICAL_COLUMNS as u32;
    let size = (width, PANEL.1 * lines as u32 + CANONICAL_HEAD);
    svg(size, |root| {
        root.fill(&WHITE)?;
        let (head, grid) = root.split_vertically(CANONICAL_HEAD);
        draw_canonical_head(&head)?;
        let areas = grid.split_evenly((lines, CANONICAL_COLUMNS));
        for (area, name) in areas.iter().zip(drawn) {
            let (frame, marks) = panel(*name, outcomes, rows);
            frame.draw(area, &marks)?;
        }
        Ok(())
    })
    .map(Some)
}

fn draw_canonical_head(head: &Area<'_>) -> Drawn {
    let lines_of_head = [
        "Error felt against the share of one core that a method takes, all its loops",
        "down is better, left is cheaper; dot: every pass line is kept, cross: one is missed; bar: from the luckiest start phase to the worst; black line: Pareto front",
    ];
    for (index, text) in lines_of_head.iter().enumerate() {
        let size = [19, 14][index];
        let place = (16, 8 + 28 * index as i32);
        head.draw(&Text::new(*text, place, ("sans-serif", size)))?;
    }
    for (index, method) in Method::ALL.into_iter().enumerate() {
        let (column, line) = ((index % 4) as i32, (index / 4) as i32);
        let (x, y) = (24 + 170 * column, 68 + 22 * line);
        head.draw(&Circle::new((x, y), 6, colour(method).filled()))?;
        head.draw(&Text::new(
            method.name(),
            (x + 12, y - 8),
            ("sans-serif", 15),
        ))?;
    }
    for (index, (rate, size)) in RATES.iter().zip(SIZES).enumerate() {
        let y = 62 + 20 * index as i32;
        head.draw(&Circle::new((720, y), size, BLACK))?;
        let label = format!("at most {rate} Hz");
        head.draw(&Text::new(label, (734, y - 8), ("sans-serif", 15)))?;
    }
    Ok(())
}

/// Writes `speed-accuracy.svg`, `tradeoff.svg` and `chart.csv`.
pub(crate) fn write(
    rows: &[Row],
    outcomes: &[Outcome],
    directory: &Path,
) -> Result<(), Box<dyn Error>> {
    if let Some(picture) = canonical(rows, outcomes)? {
        std::fs::write(directory.join("tradeoff.svg"), picture)?;
    }
    let panels = panels(outcomes);
    let lines = panels.len().div_ceil(COLUMNS).max(1);
    let size = (PANEL.0 * COLUMNS as u32, PANEL.1 * lines as u32 + 112);
    let picture = svg(size, |root| {
        root.fill(&WHITE)?;
        let root = root.titled(
            "Error felt against the share of one core that a method takes",
            ("sans-serif", 22),
        )?;
        let (legend, grid) = root.split_vertically(72);
        draw_legend(&legend)?;
        for (area, name) in grid.split_evenly((lines, COLUMNS)).iter().zip(&panels) {
            let (frame, marks) = panel(*name, outcomes, rows);
            frame.draw(area, &marks)?;
        }
        Ok(())
    })?;
    std::fs::write(directory.join("speed-accuracy.svg"), picture)?;
    std::fs::write(directory.join("chart.csv"), csv(&panels, outcomes)?)?;
    Ok(())
}

fn csv(panels: &[(&str, &str)], outcomes: &[Outcome]) -> Result<String, std::fmt::Error> {
    let mut csv = format!("panel,{KEYS},held_hz,j_p95,core_share,on_front,j_p95_luckiest_phase\n");
    for (index, panel) in panels.iter().enumerate() {
        let drawn = of_panel(*panel, outcomes);
        let points: Vec<_> = drawn.iter().map(|o| point(o)).collect();
        let front = front(&points);
        for outcome in drawn {
            let (share, felt) = point(outcome);
            let on_front = front.contains(&(share, felt));
            let held = outcome.measured.load.held;
            let keys = keys(outcome);
            writeln!(
                csv,
                "{index},{keys},{held:.1},{felt:.6e},{share:.4e},{on_front},{:.6e}",
                band(outcome)[0]
            )?;
        }
    }
    Ok(csv)
}

fn draw_legend(area: &Area<'_>) -> Drawn {
    for (index, method) in Method::ALL.into_iter().enumerate() {
        let (column, line) = (index % LEGEND_COLUMNS, index / LEGEND_COLUMNS);
        let (x, y) = (30 + 160 * column as i32, 16 + 20 * line as i32);
        let name = Text::new(method.name(), (x + 12, y - 7), ("sans-serif", 16));
        area.draw(&Circle::new((x, y), 6, colour(method).filled()))?;
        area.draw(&name)?;
    }
    let mut x = 30 + 160 * LEGEND_COLUMNS as i32;
    for (rate, size) in RATES.iter().zip(SIZES) {
        area.draw(&Circle::new((x, 16), size, BLACK))?;
        let label = format!("{rate} Hz");
        area.draw(&Text::new(label, (x + 12, 9), ("sans-serif", 16)))?;
        x += 80;
    }
    let note = "grey: J = 1 and a whole core; black: Pareto front; cross: a pass line is missed; J below 0.001 is drawn at 0.001";
    area.draw(&Text::new(note, (24, 52), ("sans-serif", 14)))?;
    Ok(())
}
