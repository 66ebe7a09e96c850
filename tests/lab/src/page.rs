//! The report: one HTML file that needs nothing else and no network. Every figure says in which row of which CSV file it stands.

mod glance;
pub mod league;
mod reading;
pub mod traces;

use std::error::Error;
use std::fmt::Write as _;

use plotters::style::RGBColor;

use crate::clock::RATES;
use crate::method::Method;
use crate::report::{brief, felt, verdict};
use crate::row::{Row, Verdict};
use crate::run::{Results, is_own};
use crate::sweeps::{self, Point, Sweep};
use crate::{chart, maps, overview, provenance};

const STYLE: &str = "
body{font:14px/1.45 system-ui,sans-serif;color:#222;max-width:1500px;margin:24px auto;padding:0 20px}
h1{font-size:26px;margin:0 0 12px}h2{font-size:19px;margin:34px 0 6px;border-top:1px solid #ddd;padding-top:14px}
h3{font-size:15px;margin:16px 0 4px}table{border-collapse:collapse;margin:6px 0}
td,th{border:1px solid #ddd;padding:3px 8px;text-align:left;vertical-align:top}th{background:#f5f5f5;font-weight:600}
.pass{background:#e3f4e5}.fail{background:#fbdfdc}.open{background:#fdf0cf}.shown,.scope{background:#f6f6f6;color:#777}
.row{display:flex;flex-wrap:wrap;gap:16px;align-items:flex-start}.row svg{flex:none;max-width:100%;height:auto}
.trace{width:460px}.case{flex-wrap:nowrap}.case table{flex:0 1 auto;min-width:0}.key{white-space:nowrap}
small{color:#777}.dot{display:inline-block;border-radius:50%;margin:0 5px 0 14px}
nav a{display:inline-block;margin-right:10px}p{margin:6px 0;max-width:1200px}summary{cursor:pointer}
";

/// Sizes of the legend's dots for the rates, pixels across, as in the charts.
const DOTS: [u32; 3] = [14, 10, 6];

/// The page.
pub fn html(results: &Results) -> Result<String, Box<dyn Error>> {
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Laboratory of taut</title><style>{STYLE}</style></head><body>\n\
         <h1>Laboratory: speed against accuracy of haptic methods</h1>\n"
    );
    provenance_table(&mut page)?;
    reading::section(&mut page)?;
    if !results.rows.is_empty() {
        overview_section(&mut page, results)?;
        summary(&mut page, results)?;
        glance::matrices(&mut page, results)?;
        glance::predicted(&mut page, results)?;
        traces::section(&mut page, &results.traces)?;
        not_kept(&mut page, results)?;
        glance::out_of_scope(&mut page, results)?;
        for recipe in results.rows.chunk_by(|a, b| a.recipe == b.recipe) {
            section(&mut page, results, recipe)?;
        }
    }
    sweep_sections(&mut page, results)?;
    maps_section(&mut page, results)?;
    page.push_str("</body></html>\n");
    Ok(page)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

fn provenance_table(page: &mut String) -> std::fmt::Result {
    page.push_str("<table>\n");
    for (name, value) in provenance::all() {
        writeln!(page, "<tr><th>{name}<td>{}", escaped(&value))?;
    }
    page.push_str("</table>\n");
    writeln!(
        page,
        "<p>Figures are rows of files beside this page: <a href=\"rows.csv\">rows.csv</a> (measures and pass lines), \
         <a href=\"measures.csv\">measures.csv</a> (every start phase), <a href=\"trials.csv\">trials.csv</a> (tunings that were tried), \
         <a href=\"times.csv\">times.csv</a> (CPU times), <a href=\"chart.csv\">chart.csv</a> (points of the charts), which \
         <a href=\"speed-accuracy.svg\">speed-accuracy.svg</a> shows on one sheet. \
         Lines are counted from 1, the head included. Answers are the same in every run on this type of machine; only times differ.</p>"
    )
}

/// Where the first row stands in `rows.csv`, counted from 1 behind the head.
fn line_of(results: &Results, row: &Row) -> usize {
    let place = results
        .rows
        .iter()
        .position(|other| std::ptr::eq(other, row));
    place.map_or(0, |index| index + 2)
}

/// What a recipe or study is about.
fn about(results: &Results, name: &str) -> String {
    let about = results.about.iter().rfind(|(of, _)| *of == name); // a recipe comes after its study
    escaped(about.map_or("", |(_, about)| about))
}

/// Class of a cell, by the verdict on its rows.
fn class(rows: &[Row]) -> &'static str {
    let text = verdict(rows);
    match text.split([':', ' ']).next() {
        Some("pass") => "pass",
        Some("FAIL") => "fail",
        Some("OPEN") => "open",
        Some("out") => "scope",
        _ => "shown",
    }
}

/// Rows of one player at one rate.
fn players(rows: &[Row]) -> impl Iterator<Item = &[Row]> {
    rows.chunk_by(|a, b| {
        (&a.case, &a.method, &a.settings, a.rate) == (&b.case, &b.method, &b.settings, b.rate)
            && a.recipe == b.recipe
    })
}

/// All recipes in one picture.
fn overview_section(page: &mut String, results: &Results) -> Result<(), Box<dyn Error>> {
    let summaries = overview::summaries(&results.rows, &results.outcomes);
    if !summaries.is_empty() {
        page.push_str("<h2>All recipes</h2>\n<div class=row>");
        page.push_str(&overview::svg(&summaries)?);
        page.push_str(
            "</div>\n<p>Numbers are rows of <a href=\"overview.csv\">overview.csv</a>.</p>\n",
        );
    }
    Ok(())
}

/// How many cases each method passes at each rate.
fn summary(page: &mut String, results: &Results) -> std::fmt::Result {
    page.push_str("<h2>Cases by method and rate</h2>\n<table><tr><th>method");
    for rate in RATES {
        write!(page, "<th>{rate} Hz: pass<th>open<th>fail")?;
    }
    page.push('\n');
    for method in Method::ALL {
        write!(page, "<tr><td>{}", method.name())?;
        for rate in RATES {
            let of_it =
                |rows: &&[Row]| rows[0].method == method.name() && rows[0].rate == Some(rate);
            let classes: Vec<_> = players(&results.rows).filter(of_it).map(class).collect();
            for wanted in ["pass", "open", "fail"] {
                let count = classes.iter().filter(|class| **class == wanted).count();
                let class = if count > 0 { wanted } else { "shown" };
                write!(page, "<td class={class}>{count}")?;
            }
        }
        page.push('\n');
    }
    page.push_str("</table>\n<nav>");
    for recipe in results.rows.chunk_by(|a, b| a.recipe == b.recipe) {
        write!(page, "<a href=\"#{0}\">{0}</a>", recipe[0].recipe)?;
    }
    for (sweep, _) in &results.sweeps {
        write!(page, "<a href=\"#sweep-{0}\">sweep of {0}</a>", sweep.name)?;
    }
    if !results.maps.is_empty() {
        page.push_str("<a href=\"#maps\">stability maps</a>");
    }
    page.push_str("</nav>\n");
    Ok(())
}

/// What this project's method does not keep at any rate, and what else of its own fails.
fn not_kept(page: &mut String, results: &Results) -> std::fmt::Result {
    page.push_str("<h2>Open and failed rows of this project's own</h2>\n");
    let ours = |row: &&Row| row.is_missed() && (is_own(row) || row.method == Method::Ours.name());
    let missed: Vec<&Row> = results.rows.iter().filter(ours).collect();
    if missed.is_empty() {
        page.push_str("<p>None.</p>\n");
        return Ok(());
    }
    page.push_str(
        "<table><tr><th>recipe<th>case<th>method<th>rate<th>measure<th>value<th>limit<th>verdict<th>rows.csv, line\n",
    );
    for row in missed {
        let (class, reason) = match &row.verdict {
            Verdict::Open(reason) => ("open", format!(": {}", escaped(reason))),
            _ => ("fail", String::new()),
        };
        writeln!(
            page,
            "<tr><td><a href=\"#{0}\">{0}</a><td>{1}<td>{2}<td>{3}<td>{4}<td>{5} {6}<td>{7}<td class={class}>{8}{reason}<td>{9}",
            row.recipe,
            escaped(&row.case),
            escaped(&row.method),
            row.rate
                .map_or_else(String::new, |rate| format!("{rate} Hz")),
            escaped(&row.measure),
            brief(row.value),
            escaped(&row.unit),
            row.limit.map_or_else(String::new, brief),
            row.verdict,
            line_of(results, row),
        )?;
    }
    page.push_str("</table>\n");
    Ok(())
}

/// One recipe: case by case its table, and its chart where there is an error to draw.
fn section(page: &mut String, results: &Results, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let name = rows[0].recipe;
    let about = about(results, name);
    writeln!(page, "<h2 id={name}>{name}: {about}</h2>")?;
    let panels = chart::panels(&results.outcomes);
    if panels.iter().any(|(recipe, _)| *recipe == name) {
        legend(page);
    }
    // Runs along a path have a table for each case, whatever else a recipe has one for all.
    let is_run = |row: &Row| {
        let runs = results.outcomes.iter();
        let mut same = runs.filter(|run| (run.recipe, &run.case) == (row.recipe, &row.case));
        same.next().is_some()
    };
    for case in rows.chunk_by(|a, b| a.case == b.case || !(is_run(a) || is_run(b))) {
        if !is_run(&case[0]) {
            study_table(page, results, case)?;
            continue;
        }
        writeln!(
            page,
            "<h3>{}</h3><div class=\"row case\">",
            escaped(&case[0].case)
        )?;
        case_table(page, results, case)?;
        let panel = (name, case[0].case.as_str());
        if panels.contains(&panel) {
            let (frame, marks) = chart::panel(panel, &results.outcomes, &results.rows);
            page.push_str(&frame.svg(&marks)?);
        }
        page.push_str("</div>\n");
    }
    Ok(())
}

/// A dot and what it stands for.
fn key(colour: RGBColor, across: u32, text: &str) -> String {
    let RGBColor(red, green, blue) = colour;
    format!(
        "<span class=key><span class=dot style=\"background:rgb({red},{green},{blue});width:{across}px;height:{across}px\"></span>{}</span> ",
        escaped(text)
    )
}

fn legend(page: &mut String) {
    page.push_str("<p>");
    for method in Method::ALL {
        page.push_str(&key(chart::colour(method), 10, method.name()));
    }
    for (rate, across) in RATES.iter().zip(DOTS) {
        page.push_str(&key(RGBColor(0, 0, 0), across, &format!("{rate} Hz")));
    }
    page.push_str(
        "<br><small>Error felt, in just-noticeable differences J, against the share of one core. Grey: J = 1 and a whole core. Black: \
         Pareto front. Cross: a pass line is missed. What is beyond an axis is drawn at its end.</small></p>\n",
    );
}

/// A line for each case and player.
fn study_table(page: &mut String, results: &Results, rows: &[Row]) -> std::fmt::Result {
    page.push_str("<table><tr><th>case<th>method<th>outcome\n");
    for cell in players(rows) {
        let (case, method) = (escaped(&cell[0].case), escaped(&cell[0].method));
        let rate = cell[0].rate.map(|rate| format!(", {rate} Hz"));
        let rate = rate.unwrap_or_default();
        write!(page, "<tr><td>{case}<td>{method}{rate}")?;
        cell_of(page, results, cell, 1)?;
        page.push('\n');
    }
    page.push_str("</table>\n");
    Ok(())
}

/// A line for each player, a column for each rate.
fn case_table(page: &mut String, results: &Results, case: &[Row]) -> std::fmt::Result {
    let with_rates = case.iter().any(|row| row.rate.is_some());
    page.push_str("<table><tr><th>method");
    if with_rates {
        for rate in RATES {
            write!(page, "<th>{rate} Hz")?;
        }
    } else {
        page.push_str("<th>outcome");
    }
    page.push('\n');
    for method in case.chunk_by(|a, b| a.method == b.method && a.rate.is_some() == b.rate.is_some())
    {
        write!(page, "<tr><td>{}", escaped(&method[0].method))?;
        for cell in players(method) {
            let wide = if with_rates && cell[0].rate.is_none() {
                RATES.len()
            } else {
                1
            };
            cell_of(page, results, cell, wide)?;
        }
        page.push('\n');
    }
    page.push_str("</table>\n");
    Ok(())
}

fn cell_of(page: &mut String, results: &Results, cell: &[Row], wide: usize) -> std::fmt::Result {
    let text = verdict(cell);
    let (short, long) = text.split_once(": ").unwrap_or((&text, ""));
    let outcome = short.to_lowercase();
    write!(page, "<td class={} colspan={wide}>{outcome}", class(cell))?;
    if short.starts_with("out") {
        return write!(page, ": {}", escaped(long));
    }
    if let Some(felt) = felt(cell).filter(|felt| !felt.is_nan()) {
        write!(page, ", J {}", brief(felt))?;
    }
    if cell[0].p99_us.is_finite() {
        write!(page, ", {} us", brief(cell[0].p99_us))?;
    }
    if !cell[0].settings.is_empty() && cell[0].settings != "default" {
        write!(page, "<br><small>{}</small>", escaped(&cell[0].settings))?;
    }
    let first = line_of(results, &cell[0]);
    let last = first + cell.len() - 1;
    let lines = if first == last {
        format!("line {first}")
    } else {
        format!("lines {first} to {last}")
    };
    write!(page, "<br><small>{lines}</small>")?;
    if !long.is_empty() {
        let missed = long.split("; ").count();
        write!(page, "<details><summary>{missed} missed</summary><small>")?;
        for (index, line) in long.split("; ").enumerate() {
            let gap = if index == 0 { "" } else { "<br>" };
            write!(page, "{gap}{}", escaped(line))?;
        }
        page.push_str("</small></details>");
    }
    Ok(())
}

/// Every sweep, then those that are not there.
fn sweep_sections(page: &mut String, results: &Results) -> Result<(), Box<dyn Error>> {
    for (sweep, points) in &results.sweeps {
        sweep_section(page, sweep, points)?;
    }
    let not_run: Vec<&Sweep> = sweeps::SWEEPS
        .iter()
        .filter(|sweep| !results.sweeps.iter().any(|(run, _)| run.name == sweep.name))
        .collect();
    if !not_run.is_empty() {
        page.push_str("<h2 id=missing>Sweeps that are not in this report</h2>\n<ul>\n");
        for sweep in not_run {
            let (about, name) = (escaped(sweep.about), sweep.name);
            writeln!(
                page,
                "<li>{about}: not run by this command; --sweep {name}."
            )?;
        }
        page.push_str("</ul>\n");
    }
    Ok(())
}

/// The stability maps, where they were run.
fn maps_section(page: &mut String, results: &Results) -> Result<(), Box<dyn Error>> {
    if results.maps.is_empty() {
        return Ok(());
    }
    page.push_str(
        "<h2 id=maps>Stiffest contact that is stable, method by method</h2>\n<p>A device of 0.2 kg and 1 N s/m that nobody holds, 1 kHz, a tick of delay, where \
         the axis does not say otherwise. Points are lines of <a href=\"stability-methods.csv\">stability-methods.csv</a>; those of one place are \
         drawn side by side. In a hollow the stiffness is that along the surface, the force over the distance from the axis. The search ends at 20 and at 100,000 N/m: a point there says no more than that.",
    );
    for method in maps::METHODS {
        page.push_str(&key(chart::colour(method), 10, method.name()));
    }
    for (colour, text) in maps::COLOURS {
        page.push_str(&key(colour, 7, text));
    }
    page.push_str("</p>\n<div class=row>");
    for panel in maps::panels(&results.maps)? {
        page.push_str(&panel);
    }
    page.push_str("</div>\n");
    Ok(())
}

fn sweep_section(page: &mut String, sweep: &Sweep, points: &[Point]) -> Result<(), Box<dyn Error>> {
    let name = sweep.name;
    writeln!(
        page,
        "<h2 id=\"sweep-{name}\">Sweep of {name}: {}</h2>\n<p>Points are lines of <a href=\"sweep-{name}.csv\">sweep-{name}.csv</a>.",
        escaped(sweep.about)
    )?;
    let legend = sweeps::legend(points);
    for (name, colour) in &legend {
        page.push_str(&key(*colour, 10, name));
    }
    if points
        .iter()
        .any(|p| !legend.iter().any(|(name, _)| *name == p.setting))
    {
        page.push_str("<small>The number beside a point is its setting.</small>");
    }
    page.push_str("</p>\n<div class=row>");
    for (frame, marks) in sweeps::panels(sweep, points) {
        page.push_str(&frame.svg(&marks)?);
    }
    page.push_str(
        "</div>\n<details><summary>Table</summary><table><tr><th>recipe<th>case<th>setting",
    );
    let cost = sweep.cost.label();
    write!(page, "<th>{cost}<th>{}<th>line", escaped(sweep.error))?;
    for (index, point) in points.iter().enumerate() {
        write!(
            page,
            "\n<tr><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}",
            point.recipe,
            escaped(&point.case),
            escaped(&point.setting),
            brief(point.cost),
            brief(point.error),
            index + 2
        )?;
    }
    page.push_str("</table></details>\n");
    Ok(())
}
