//! Files and panels of the stability maps.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use plotters::prelude::*;

use super::{MAPS, METHODS, Map, Point};
use crate::chart::colour;
use crate::plot::{Area, Drawn, PANEL, svg};

/// Of the lines of theory: eigenvalues, the rule, the bound of passivity.
pub(crate) const COLOURS: [(RGBColor, &str); 3] = [
    (RGBColor(0, 0, 0), "eigenvalues of device and spring"),
    (RGBColor(130, 130, 130), "b/(T/2 + t_d)"),
    (RGBColor(200, 60, 60), "min(2b/T, 2f_c/Delta)"),
];
/// N/m.
const STIFFNESS: [f64; 2] = [10.0, 200_000.0];
const COLUMNS: usize = 2;
const HEAD: u32 = 78;
const RADIUS: i32 = 4;

/// `stability-methods.csv`.
fn csv(points: &[Point]) -> String {
    let mut text = String::from(
        "map,at,method,critical_n_per_m,by_eigenvalues_n_per_m,by_rule_n_per_m,passive_n_per_m\n",
    );
    for point in points {
        let passive = if point.passive.is_nan() {
            String::new()
        } else {
            format!("{:.1}", point.passive)
        };
        let _ = writeln!(
            text,
            "{},{},{},{:.1},{:.1},{:.1},{passive}",
            point.map,
            point.at,
            point.method.name(),
            point.critical,
            point.by_eigenvalues,
            point.by_rule
        );
    }
    text
}

/// One panel for each map, as texts that can stand in a page.
pub(crate) fn panels(points: &[Point]) -> Result<Vec<String>, Box<dyn Error>> {
    let panel = |map| svg(PANEL, |area| draw(area, map, points));
    MAPS.iter().map(panel).collect()
}

/// Writes `stability-methods.csv` and `stability-methods.svg`.
pub(crate) fn write(points: &[Point], directory: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(directory)?;
    std::fs::write(directory.join("stability-methods.csv"), csv(points))?;
    let lines = MAPS.len().div_ceil(COLUMNS) as u32;
    let size = (PANEL.0 * COLUMNS as u32, PANEL.1 * lines + HEAD);
    let picture = svg(size, |root| draw_all(root, lines, points))?;
    std::fs::write(directory.join("stability-methods.svg"), picture)?;
    Ok(())
}

fn draw_all(root: &Area<'_>, lines: u32, points: &[Point]) -> Drawn {
    root.fill(&WHITE)?;
    let (head, grid) = root.split_vertically(HEAD);
    let title = "Stiffest contact that is stable: each method (points) beside theory (lines)";
    head.draw(&Text::new(title, (20, 8), ("sans-serif", 17)))?;
    let mut x = 24;
    for method in METHODS {
        head.draw(&Circle::new((x, 42), RADIUS, colour(method).filled()))?;
        head.draw(&Text::new(method.name(), (x + 9, 35), ("sans-serif", 14)))?;
        x += 148;
    }
    let mut x = 24;
    for (ink, text) in COLOURS {
        let line = [(x, 64), (x + 22, 64)];
        head.draw(&PathElement::new(line, ink.stroke_width(2)))?;
        head.draw(&Text::new(text, (x + 28, 57), ("sans-serif", 14)))?;
        x += 270;
    }
    for (area, map) in grid
        .split_evenly((lines as usize, COLUMNS))
        .iter()
        .zip(&MAPS)
    {
        draw(area, map, points)?;
    }
    Ok(())
}

fn draw(area: &Area<'_>, map: &Map, points: &[Point]) -> Drawn {
    let of_map: Vec<&Point> = points
        .iter()
        .filter(|point| point.map == map.name)
        .collect();
    let least = of_map.iter().map(|p| p.at).fold(f64::INFINITY, f64::min);
    let most = of_map.iter().map(|p| p.at).fold(0.0, f64::max);
    let (left, right) = (0.7 * least, 1.4 * most);
    let bounded = |k: f64| k.clamp(STIFFNESS[0] * 1.2, STIFFNESS[1] / 1.2);
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .x_label_area_size(34)
        .y_label_area_size(66)
        .build_cartesian_2d(
            (left..right).log_scale(),
            (STIFFNESS[0]..STIFFNESS[1]).log_scale(),
        )?;
    chart
        .configure_mesh()
        .x_desc(map.axis)
        .y_desc("critical stiffness, N/m")
        .x_labels(5)
        .y_labels(6)
        .y_label_formatter(&|k| format!("{k:.0}"))
        .label_style(("sans-serif", 13))
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(238, 238, 238))
        .draw()?;
    let theory: [fn(&Point) -> f64; 3] = [|p| p.by_eigenvalues, |p| p.by_rule, |p| p.passive];
    for (value, (ink, _)) in theory.iter().zip(COLOURS) {
        let mine = of_map.iter().filter(|p| p.method == METHODS[0]);
        let line = mine.map(|p| (p.at, value(p))).filter(|(_, k)| !k.is_nan());
        let line: Vec<_> = line.map(|(at, k)| (at, bounded(k))).collect();
        chart.draw_series(LineSeries::new(line, ink.stroke_width(2)))?;
    }
    for (index, method) in METHODS.iter().enumerate() {
        // Side by side: most of them lie on each other.
        let beside = 1.0 + 0.03 * (index as f64 - 0.5 * METHODS.len() as f64);
        let its = of_map.iter().filter(|p| p.method == *method);
        let places = its.map(|p| (p.at * beside, bounded(p.critical)));
        let ink = colour(*method);
        chart.draw_series(places.map(|place| Circle::new(place, RADIUS, ink.filled())))?;
    }
    Ok(())
}
