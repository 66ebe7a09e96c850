//! Files and panels of a sweep.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use plotters::prelude::*;

use super::{Cost, Point, SHOWN, Sweep};
use crate::plot::{Frame, Mark, PANEL, front, svg};
use crate::report::quoted;

/// Colours of settings, or of kinds of settings, in their order.
const COLOURS: [RGBColor; 12] = [
    RGBColor(0, 90, 170),
    RGBColor(200, 90, 0),
    RGBColor(0, 130, 80),
    RGBColor(140, 60, 150),
    RGBColor(190, 40, 70),
    RGBColor(110, 110, 60),
    RGBColor(90, 170, 220),
    RGBColor(230, 160, 60),
    RGBColor(100, 190, 140),
    RGBColor(190, 130, 210),
    RGBColor(120, 120, 120),
    RGBColor(0, 0, 0),
];
const RADIUS: i32 = 5;
/// Errors below these are drawn there: nobody feels them, or they are rounding.
const LEAST_FELT: f64 = 1e-3;
const LEAST_RELATIVE: f64 = 1e-17;
const COLUMNS: usize = 2;
/// Settings in a line of the legend, and its height, pixels.
const LEGEND_COLUMNS: usize = 5;
const LEGEND_LINE: u32 = 22;

impl Sweep {
    fn is_felt(&self) -> bool {
        self.error == "J"
    }
}

/// A colour each, and names: of settings, or of their kinds where there are more settings than colours.
pub(crate) fn legend(points: &[Point]) -> Vec<(&str, RGBColor)> {
    let all = |name: fn(&str) -> &str| {
        let mut names: Vec<&str> = Vec::new();
        for point in points {
            let name = name(&point.setting);
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    };
    let settings = all(|setting| setting);
    let names = if settings.len() <= COLOURS.len() {
        settings
    } else {
        all(|setting| kind(setting).0)
    };
    names.into_iter().zip(COLOURS.into_iter().cycle()).collect()
}

/// A setting's kind and value: its last word is the value.
fn kind(setting: &str) -> (&str, &str) {
    setting.rsplit_once(' ').unwrap_or((setting, ""))
}

/// Of the points of a setting: its colour, and what is written beside them where the colour is that of its kind.
fn look(legend: &[(&str, RGBColor)], setting: &str) -> (RGBColor, String) {
    let named = |name: &str| legend.iter().find(|(of, _)| *of == name).map(|(_, c)| *c);
    let (of_kind, value) = kind(setting);
    named(setting).map_or_else(
        || (named(of_kind).unwrap_or(BLACK), value.to_owned()),
        |colour| (colour, String::new()),
    )
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
    let most = largest(&|p| p.cost);
    let (costs, cost_line) = match sweep.cost {
        Cost::Time => ([0.5, most.max(1100.0) * 1.5], Some(1000.0)),
        Cost::Bandwidth => {
            let least = points.iter().map(|p| p.cost).fold(most, f64::min);
            ([0.7 * least, 1.4 * most], None)
        }
    };
    let errors = [0.5 * least, largest(&|p| p.error).max(2.0 * least) * 3.0];
    sorted
        .chunk_by(|a, b| of_same(a, b))
        .map(|panel| {
            let frame = Frame {
                title: format!("{}: {}", panel[0].recipe, panel[0].case),
                costs,
                cost: sweep.cost.label(),
                cost_line,
                errors,
                unit: if sweep.is_felt() {
                    "error felt, J"
                } else {
                    sweep.error
                },
                error_line: sweep.is_felt().then_some(1.0),
            };
            let drawn = panel.iter().filter(|point| !point.error.is_nan());
            let marks = drawn.map(|point| {
                let (colour, label) = look(&legend, &point.setting);
                Mark {
                    place: (point.cost, point.error),
                    band: [point.error; 2],
                    colour,
                    size: RADIUS,
                    passes: true,
                    label,
                }
            });
            (frame, marks.collect())
        })
        .collect()
}

/// Points as CSV. What may differ between runs stands in the last two columns: the cost where it is a time, and the front that follows from it.
pub fn csv(sweep: &Sweep, points: &[Point]) -> String {
    let mut text = String::from("sweep,recipe,case,setting,rate_hz,error,unit");
    for measure in SHOWN {
        let unit = measure.unit().replace([' ', '/'], "_");
        let _ = write!(text, ",{}_{unit}", measure.key());
    }
    let _ = writeln!(text, ",{},on_front", sweep.cost.key());
    for point in points {
        let of_panel = points
            .iter()
            .filter(|p| (p.recipe, &p.case) == (point.recipe, &point.case));
        let places: Vec<_> = of_panel.map(|p| (p.cost, p.error)).collect();
        let on_front = front(&places).contains(&(point.cost, point.error));
        let rate = point.rate.map_or_else(String::new, |rate| rate.to_string());
        let _ = write!(
            text,
            "{},{},{},{},{rate},{:.6e},{}",
            sweep.name,
            point.recipe,
            quoted(&point.case),
            quoted(&point.setting),
            point.error,
            sweep.error
        );
        for index in 0..SHOWN.len() {
            match point.measures.get(index) {
                Some(value) => drop(write!(text, ",{value:.6e}")),
                None => text.push(','),
            }
        }
        let _ = writeln!(text, ",{:.2},{on_front}", point.cost);
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
    let legend = legend(points);
    let head_height = 46 + LEGEND_LINE * legend.len().div_ceil(LEGEND_COLUMNS).max(1) as u32;
    let size = (
        PANEL.0 * COLUMNS as u32,
        PANEL.1 * lines as u32 + head_height,
    );
    let picture = svg(size, |root| {
        root.fill(&WHITE)?;
        let (head, grid) = root.split_vertically(head_height);
        head.draw(&Text::new(sweep.about, (20, 10), ("sans-serif", 16)))?;
        let step = (size.0 as i32 - 40) / LEGEND_COLUMNS as i32;
        for (index, (setting, colour)) in legend.iter().enumerate() {
            let (x, y) = (
                30 + (index % LEGEND_COLUMNS) as i32 * step,
                46 + (index / LEGEND_COLUMNS) as i32 * LEGEND_LINE as i32,
            );
            head.draw(&Circle::new((x, y), RADIUS, colour.filled()))?;
            head.draw(&Text::new(*setting, (x + 12, y - 7), ("sans-serif", 14)))?;
        }
        for (area, (frame, marks)) in grid.split_evenly((lines, COLUMNS)).iter().zip(&panels) {
            frame.draw(area, marks)?;
        }
        Ok(())
    })?;
    std::fs::write(directory.join(&name).with_extension("svg"), picture)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(setting: &str) -> Point {
        Point {
            recipe: "R38",
            case: String::new(),
            setting: setting.to_owned(),
            rate: None,
            error: 1.0,
            cost: 1.0,
            measures: Vec::new(),
        }
    }

    #[test]
    fn no_two_names_of_a_legend_have_one_colour() {
        let few: Vec<Point> = ["off", "10 ms"].map(point).into();
        assert_eq!(look(&legend(&few), "10 ms"), (COLOURS[1], String::new()));
        let many: Vec<Point> = ["one way", "other way"]
            .iter()
            .flat_map(|kind| (0..8).map(move |value| point(&format!("{kind} {value}"))))
            .collect();
        let of_kinds = legend(&many);
        assert_eq!(
            of_kinds,
            [("one way", COLOURS[0]), ("other way", COLOURS[1])]
        );
        assert_eq!(look(&of_kinds, "other way 3"), (COLOURS[1], "3".to_owned()));
    }
}
