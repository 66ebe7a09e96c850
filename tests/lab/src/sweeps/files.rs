//! Files and panels of a sweep.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use plotters::prelude::*;

use super::{Point, SHOWN, Sweep};
use crate::plot::{Frame, Mark, PANEL, front};
use crate::report::quoted;

/// Colours of settings, in their order; more begin again.
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 90, 170),
    RGBColor(200, 90, 0),
    RGBColor(0, 130, 80),
    RGBColor(140, 60, 150),
    RGBColor(190, 40, 70),
    RGBColor(110, 110, 60),
];
const RADIUS: i32 = 5;
/// Errors below these are drawn there: nobody feels them, or they are rounding.
const LEAST_FELT: f64 = 1e-3;
const LEAST_RELATIVE: f64 = 1e-17;
const COLUMNS: usize = 2;

impl Sweep {
    fn is_felt(&self) -> bool {
        self.error == "J"
    }
}

/// Settings and their colours.
pub(crate) fn legend(points: &[Point]) -> Vec<(&str, RGBColor)> {
    let mut settings: Vec<&str> = Vec::new();
    for point in points {
        if !settings.contains(&point.setting.as_str()) {
            settings.push(&point.setting);
        }
    }
    settings
        .into_iter()
        .zip(COLOURS.into_iter().cycle())
        .collect()
}

/// One panel for each recipe and case.
pub(crate) fn panels(sweep: &Sweep, points: &[Point]) -> Vec<(Frame, Vec<Mark>)> {
    let legend = legend(points);
    let of_same = |a: &Point, b: &Point| (a.recipe, &a.case) == (b.recipe, &b.case);
    let mut sorted: Vec<&Point> = points.iter().collect();
    let place = |point: &Point| points.iter().position(|p| of_same(p, point));
    sorted.sort_by_key(|point| place(point));
    let least = if sweep.is_felt() {
        LEAST_FELT
    } else {
        LEAST_RELATIVE
    };
    let largest = |values: &dyn Fn(&Point) -> f64| points.iter().map(values).fold(0.0, f64::max);
    let times = [0.5, largest(&|p| p.p99_us).max(1100.0) * 1.5];
    let errors = [0.5 * least, largest(&|p| p.error).max(2.0 * least) * 3.0];
    sorted
        .chunk_by(|a, b| of_same(a, b))
        .map(|panel| {
            let frame = Frame {
                title: format!("{}: {}", panel[0].recipe, panel[0].case),
                times,
                errors,
                unit: sweep.error,
                error_line: sweep.is_felt().then_some(1.0),
            };
            let drawn = panel.iter().filter(|point| !point.error.is_nan());
            let marks = drawn.map(|point| Mark {
                place: (point.p99_us, point.error),
                colour: legend
                    .iter()
                    .find(|(setting, _)| *setting == point.setting)
                    .map_or(BLACK, |(_, colour)| *colour),
                size: RADIUS,
                passes: true,
            });
            (frame, marks.collect())
        })
        .collect()
}

/// Points as CSV.
#[must_use]
pub fn csv(sweep: &Sweep, points: &[Point]) -> String {
    let mut text = String::from("sweep,recipe,case,setting,rate_hz,update_p99_us,error,unit");
    for measure in SHOWN {
        let _ = write!(
            text,
            ",{}_{}",
            measure.key(),
            measure.unit().replace([' ', '/'], "_")
        );
    }
    text.push_str(",on_front\n");
    for point in points {
        let of_panel = points
            .iter()
            .filter(|p| (p.recipe, &p.case) == (point.recipe, &point.case));
        let places: Vec<_> = of_panel.map(|p| (p.p99_us, p.error)).collect();
        let on_front = front(&places).contains(&(point.p99_us, point.error));
        let rate = point.rate.map_or_else(String::new, |rate| rate.to_string());
        let _ = write!(
            text,
            "{},{},{},{},{rate},{:.2},{:.6e},{}",
            sweep.name,
            point.recipe,
            quoted(&point.case),
            quoted(&point.setting),
            point.p99_us,
            point.error,
            sweep.error
        );
        for index in 0..SHOWN.len() {
            match point.measures.get(index) {
                Some(value) => drop(write!(text, ",{value:.6e}")),
                None => text.push(','),
            }
        }
        let _ = writeln!(text, ",{on_front}");
    }
    text
}

/// Writes `sweep-NAME.csv` and `sweep-NAME.svg`.
pub fn write(sweep: &Sweep, points: &[Point], directory: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(directory)?;
    let name = format!("sweep-{}", sweep.name);
    std::fs::write(
        directory.join(&name).with_extension("csv"),
        csv(sweep, points),
    )?;
    let panels = panels(sweep, points);
    let lines = panels.len().div_ceil(COLUMNS).max(1);
    let size = (PANEL.0 * COLUMNS as u32, PANEL.1 * lines as u32 + 70);
    let file = directory.join(&name).with_extension("svg");
    let root = SVGBackend::new(&file, size).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, grid) = root.split_vertically(70);
    head.draw(&Text::new(sweep.about, (20, 10), ("sans-serif", 16)))?;
    let legend = legend(points);
    let step = (size.0 as i32 - 40) / legend.len().max(1) as i32;
    for (index, (setting, colour)) in legend.iter().enumerate() {
        let x = 30 + index as i32 * step;
        head.draw(&Circle::new((x, 48), RADIUS, colour.filled()))?;
        head.draw(&Text::new(*setting, (x + 12, 41), ("sans-serif", 14)))?;
    }
    for (area, (frame, marks)) in grid.split_evenly((lines, COLUMNS)).iter().zip(&panels) {
        frame.draw(area, marks)?;
    }
    root.present()?;
    Ok(())
}
