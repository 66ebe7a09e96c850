//! All recipes in one picture: what each method passes, and its error felt against the share of one core that it takes.
//!
//! A point is a method at a rate, at the medians over all cases that have a right answer; its arms reach from quartile to quartile. The bars beside
//! are the shares of cases that are passed. Every number is a row of `overview.csv`, made of the rows of `chart.csv` and `rows.csv`.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use plotters::prelude::*;

use crate::chart::{colour, passes};
use crate::clock::RATES;
use crate::cpu_time::quantile;
use crate::measure::Measure;
use crate::method::Method;
use crate::outcome::Outcome;
use crate::plot::{self, Area, Drawn, front};
use crate::row::Row;

/// Pixels: width and least height, and the height of the bars of a method with its name.
const SIZE: (u32, u32) = (960, 500);
const BARS: i32 = 47;
/// The scatter's share of the width.
const SCATTER: u32 = 590;
const HEAD: u32 = 64;
/// Ranges: shares of a core, just-noticeable differences.
const SHARES: [f64; 2] = [1e-4, 3.0];
const ERRORS: [f64; 2] = [4e-3, 300.0];
/// Radii of points by rate, pixels.
const SIZES: [i32; 3] = [8, 6, 4];
const GREY: RGBColor = RGBColor(120, 120, 120);

/// A method at a rate, over all recipes.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Who.
    pub method: Method,
    /// Updates a second, Hz.
    pub rate: u32,
    /// Cases that were run, and those that were passed whole.
    pub cases: usize,
    /// See `cases`.
    pub passed: usize,
    /// Lower quartile, median and upper quartile of J, over the cases that have a right answer.
    pub felt: [f64; 3],
    /// The same of the share of one core, over all cases.
    pub core: [f64; 3],
}

/// Every method at every rate that was run.
pub fn summaries(rows: &[Row], outcomes: &[Outcome]) -> Vec<Summary> {
    let each = Method::ALL
        .iter()
        .flat_map(|method| RATES.map(|rate| (*method, rate)));
    each.filter_map(|(method, rate)| {
        let its: Vec<&Outcome> = outcomes
            .iter()
            .filter(|outcome| (outcome.method, outcome.rate) == (method, rate))
            .collect();
        let quartiles = |values: &[f64]| [0.25, 0.5, 0.75].map(|share| quantile(values, share));
        let felt: Vec<f64> = its
            .iter()
            .map(|outcome| outcome.worst(Measure::JndP95))
            .filter(|felt| !felt.is_nan())
            .collect();
        let shares: Vec<f64> = its
            .iter()
            .map(|outcome| outcome.measured.load.core)
            .collect();
        (!its.is_empty()).then(|| Summary {
            method,
            rate,
            cases: its.len(),
            passed: its.iter().filter(|outcome| passes(outcome, rows)).count(),
            felt: quartiles(&felt),
            core: quartiles(&shares),
        })
    })
    .collect()
}

/// As CSV; the last columns are times.
pub fn csv(summaries: &[Summary]) -> String {
    let mut text = String::from(
        "method,rate_hz,cases,passed,j_quarter,j_median,j_three_quarters,\
         core_share_quarter,core_share_median,core_share_three_quarters,on_front\n",
    );
    let front = front(&summaries.iter().map(place).collect::<Vec<_>>());
    for summary in summaries {
        let [j25, j50, j75] = summary.felt;
        let [t25, t50, t75] = summary.core;
        let _ = writeln!(
            text,
            "{},{},{},{},{j25:.6e},{j50:.6e},{j75:.6e},{t25:.4e},{t50:.4e},{t75:.4e},{}",
            summary.method.name(),
            summary.rate,
            summary.cases,
            summary.passed,
            front.contains(&place(summary))
        );
    }
    text
}

fn place(summary: &Summary) -> (f64, f64) {
    (summary.core[1], summary.felt[1])
}

/// Writes `overview.svg` and `overview.csv`.
pub fn write(rows: &[Row], outcomes: &[Outcome], directory: &Path) -> Result<(), Box<dyn Error>> {
    let summaries = summaries(rows, outcomes);
    std::fs::write(directory.join("overview.csv"), csv(&summaries))?;
    std::fs::write(directory.join("overview.svg"), svg(&summaries)?)?;
    Ok(())
}

/// The picture as a text that can stand in a page.
pub(crate) fn svg(summaries: &[Summary]) -> Result<String, Box<dyn Error>> {
    let methods = summaries.chunk_by(|a, b| a.method == b.method).count() as u32;
    let height = SIZE.1.max(HEAD + 50 + methods * BARS as u32);
    plot::svg((SIZE.0, height), |root| {
        root.fill(&WHITE)?;
        let (top, body) = root.split_vertically(HEAD);
        head(&top, summaries)?;
        let (left, right) = body.split_horizontally(SCATTER);
        scatter(&left, summaries)?;
        bars(&right, summaries)
    })
}

fn head(head: &Area<'_>, summaries: &[Summary]) -> Drawn {
    let cases = summaries.iter().map(|summary| summary.cases).max();
    let title = format!(
        "Haptic methods in {} cases of recipes in which they are known to fail",
        cases.unwrap_or(0)
    );
    head.draw(&Text::new(title, (16, 10), ("sans-serif", 19)))?;
    let note =
        "points: medians, arms: quartiles; black: Pareto front; grey: J = 1 and a whole core";
    head.draw(&Text::new(note, (16, 38), ("sans-serif", 14)))?;
    let mut x = 600;
    for (rate, size) in RATES.iter().zip(SIZES) {
        head.draw(&Circle::new((x, 46), size, BLACK))?;
        head.draw(&Text::new(
            format!("{rate} Hz"),
            (x + 14, 39),
            ("sans-serif", 14),
        ))?;
        x += 100;
    }
    Ok(())
}

fn scatter(area: &Area<'_>, summaries: &[Summary]) -> Drawn {
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .x_label_area_size(38)
        .y_label_area_size(56)
        .build_cartesian_2d(
            (SHARES[0]..SHARES[1]).log_scale(),
            (ERRORS[0]..ERRORS[1]).log_scale(),
        )?;
    chart
        .configure_mesh()
        .x_desc("share of one core")
        .y_desc("error felt, J at p95")
        .x_labels(5)
        .y_labels(6)
        .label_style(("sans-serif", 15))
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(236, 236, 236))
        .draw()?;
    let grey = GREY.stroke_width(1);
    chart.draw_series(LineSeries::new([(SHARES[0], 1.0), (SHARES[1], 1.0)], grey))?;
    chart.draw_series(LineSeries::new([(1.0, ERRORS[0]), (1.0, ERRORS[1])], grey))?;
    let shown = |(time, felt): (f64, f64)| {
        (
            time.clamp(SHARES[0], SHARES[1]),
            felt.clamp(ERRORS[0], ERRORS[1]),
        )
    };
    let places: Vec<_> = summaries.iter().map(place).collect();
    let line = front(&places).into_iter().map(shown);
    chart.draw_series(LineSeries::new(line, BLACK.stroke_width(1)))?;
    for summary in summaries.iter().filter(|summary| !summary.felt[1].is_nan()) {
        let ink = colour(summary.method);
        let (time, felt) = place(summary);
        let arms = [
            [(summary.core[0], felt), (summary.core[2], felt)],
            [(time, summary.felt[0]), (time, summary.felt[2])],
        ];
        for arm in arms {
            let faint = ink.mix(0.45).stroke_width(1);
            chart.draw_series(LineSeries::new(arm.map(shown), faint))?;
        }
        let size = RATES.iter().position(|rate| *rate == summary.rate);
        let size = SIZES[size.unwrap_or(0)];
        chart.draw_series([Circle::new(shown((time, felt)), size, ink.filled())])?;
    }
    Ok(())
}

/// A line for each method, a bar for each rate: the share of cases passed. They are the legend, too.
fn bars(area: &Area<'_>, summaries: &[Summary]) -> Drawn {
    let (width, _) = area.dim_in_pixel();
    let of_method = |method| summaries.iter().filter(move |s| s.method == method);
    let methods: Vec<Method> = Method::ALL
        .into_iter()
        .filter(|method| of_method(*method).next().is_some())
        .collect();
    area.draw(&Text::new(
        "cases passed, by rate",
        (10, 4),
        ("sans-serif", 15),
    ))?;
    let (begin, end) = (10, width as i32 - 60);
    for (index, method) in methods.iter().enumerate() {
        let top = 28 + index as i32 * BARS;
        let ink = colour(*method);
        area.draw(&Text::new(method.name(), (begin, top), ("sans-serif", 15)))?;
        for (place, summary) in of_method(*method).enumerate() {
            let share = summary.passed as f64 / summary.cases as f64;
            let (y, thick) = (top + 18 + place as i32 * 9, 6);
            let whole = [(begin, y), (end, y + thick)];
            let passed = [
                (begin, y),
                (begin + (share * f64::from(end - begin)) as i32, y + thick),
            ];
            area.draw(&Rectangle::new(whole, RGBColor(240, 240, 240).filled()))?;
            area.draw(&Rectangle::new(passed, ink.filled()))?;
            let text = format!("{}/{}", summary.passed, summary.cases);
            area.draw(&Text::new(text, (end + 6, y - 3), ("sans-serif", 11)))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipes::{Extent, all};

    #[test]
    fn shares_and_medians_are_those_of_the_cases() {
        let recipes: Vec<_> = all(Extent::Quick)
            .into_iter()
            .filter(|recipe| recipe.name == "R09")
            .collect();
        let outcomes: Vec<Outcome> = recipes
            .iter()
            .flat_map(|recipe| [Method::Ours, Method::Penalty].map(|m| Outcome::of(recipe, m, 70)))
            .collect();
        let rows: Vec<Row> = outcomes
            .iter()
            .zip(recipes.iter().flat_map(|recipe| [recipe, recipe]))
            .flat_map(|(outcome, recipe)| outcome.rows(recipe))
            .collect();
        let found = summaries(&rows, &outcomes);
        assert_eq!(found.len(), 2);
        assert_eq!(
            (found[0].cases, found[0].passed),
            (recipes.len(), recipes.len())
        );
        assert!(found[1].passed < found[1].cases, "penalty pops through");
        assert_eq!(csv(&found).lines().count(), 3);
        assert!(svg(&found).expect("a picture").contains("cases passed"));
    }
}
