//! Force over time where methods part: what the numbers of the tables are like in the hand.
//!
//! The start phase is the one from which a named method errs most; every method runs with the tuning that its table shows. Each line is
//! rows of `traces.csv`.

use std::error::Error;
use std::fmt::Write as _;

use god_object::Vector6;
use plotters::prelude::*;

use super::{escaped, key};
use crate::chart::colour;
use crate::clock::{self, Charge};
use crate::costs;
use crate::measure::Measure;
use crate::measured::judged;
use crate::method::Method;
use crate::outcome::Outcome;
use crate::plot::{self, PANEL};
use crate::port;
use crate::recipe::Recipe;
use crate::report::quoted;

/// A part of a run, and what of the force is drawn.
struct Window {
    recipe: &'static str,
    case: &'static str,
    rate: u32,
    /// s.
    from: f64,
    to: f64,
    /// Whose worst start phase, by what.
    worst: (Method, Measure),
    /// Index in a wrench, and its name.
    component: (usize, &'static str),
    about: &'static str,
}

const WINDOWS: [Window; 4] = [
    Window {
        recipe: "R02",
        case: "ball on a plane",
        rate: 300,
        from: 0.25,
        to: 1.55,
        worst: (Method::VirtualCoupling, Measure::Friction),
        component: (0, "force along the plane, N"),
        about: "slides on a plane without friction, then lifts",
    },
    Window {
        recipe: "R09",
        case: "plate of 0.1 mm",
        rate: 70,
        from: 0.45,
        to: 0.85,
        worst: (Method::Penalty, Measure::Astray),
        component: (2, "force across the plate, N"),
        about: "is pushed through a thin plate; the force ends at its limit",
    },
    Window {
        recipe: "R11",
        case: "0.3 m/s",
        rate: 70,
        from: 0.15,
        to: 0.29,
        worst: (Method::Paper, Measure::Step),
        component: (2, "force across the plane, N"),
        about: "goes into a plane at a constant speed and out again",
    },
    Window {
        recipe: "R13",
        case: "end of a plate",
        rate: 300,
        from: 0.44,
        to: 0.54,
        worst: (Method::Ours, Measure::FalseForce),
        component: (2, "force across the plate, N"),
        about: "slides off the end of a plate: what is left is a ghost of it",
    },
];

/// The force of a method over time, or the right one.
#[derive(Clone, Debug)]
pub struct Trace {
    window: usize,
    /// `None`: the right answer.
    method: Option<Method>,
    settings: String,
    /// Which start phase.
    phase: usize,
    /// s, N.
    samples: Vec<(f64, f64)>,
}

/// Runs what is drawn, of the recipes that were run.
pub(crate) fn run(recipes: &[Recipe], outcomes: &[Outcome]) -> Vec<Trace> {
    let mut traces = Vec::new();
    for (index, window) in WINDOWS.iter().enumerate() {
        let is_of = |name: &str, case: &str| (name, case) == (window.recipe, window.case);
        let Some(recipe) = recipes.iter().find(|r| is_of(r.name, &r.case)) else {
            continue;
        };
        let of_window = |outcome: &&Outcome| {
            is_of(outcome.recipe, &outcome.case) && outcome.rate == window.rate
        };
        let its: Vec<&Outcome> = outcomes.iter().filter(of_window).collect();
        let Some(phase) = worst_phase(&its, window) else {
            continue;
        };
        let samples = |wrenches: &mut dyn Iterator<Item = Vector6>| {
            let all = wrenches.enumerate().map(|(tick, wrench)| {
                (
                    f64::from(tick as u32) * clock::TICK,
                    wrench[window.component.0],
                )
            });
            all.filter(|(time, _)| (window.from..=window.to).contains(time))
                .collect()
        };
        traces.push(Trace {
            window: index,
            method: None,
            settings: String::new(),
            phase,
            samples: samples(&mut port::right_answer(recipe).into_iter()),
        });
        for outcome in its {
            let period = 1.0 / f64::from(window.rate);
            let mut method = outcome.method.start(&recipe.scene, period, outcome.tuning);
            let begin = judged(recipe.phases)[phase];
            let (by, with, rate) = (outcome.method, outcome.tuning, window.rate);
            let cost = costs::of(recipe, by, with, rate);
            let seed = costs::seed(recipe, by, with, rate, begin);
            let mut charge = cost.map_or(Charge::WholePeriod, |cost| Charge::Drawn(cost, seed));
            let mut run = clock::run(method.as_mut(), recipe, rate, begin, &mut charge);
            port::limit(&recipe.scene, &mut run.ticks);
            traces.push(Trace {
                window: index,
                method: Some(outcome.method),
                settings: outcome.tuning.to_string(),
                phase,
                samples: samples(&mut run.ticks.iter().map(|tick| tick.wrench)),
            });
        }
    }
    traces
}

/// The start phase from which the window's method errs most.
fn worst_phase(outcomes: &[&Outcome], window: &Window) -> Option<usize> {
    let (method, measure) = window.worst;
    let outcome = outcomes.iter().find(|outcome| outcome.method == method)?;
    let values = outcome
        .measured
        .phases
        .iter()
        .map(|phase| phase.get(measure));
    let worst = values.enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b));
    worst.map(|(phase, _)| phase)
}

/// `traces.csv`.
pub(crate) fn csv(traces: &[Trace]) -> String {
    let mut text =
        String::from("recipe,case,rate_hz,phase,component,method,settings,time_s,value_n\n");
    for trace in traces {
        let window = &WINDOWS[trace.window];
        let head = format!(
            "{},{},{},{},{},{},{}",
            window.recipe,
            quoted(window.case),
            window.rate,
            trace.phase,
            quoted(window.component.1),
            name(trace),
            quoted(&trace.settings)
        );
        for (time, value) in &trace.samples {
            let _ = writeln!(text, "{head},{time:.3},{value:.6e}");
        }
    }
    text
}

fn name(trace: &Trace) -> &'static str {
    trace.method.map_or("right answer", Method::name)
}

/// The section of the page; nothing where nothing was traced.
pub(super) fn section(page: &mut String, traces: &[Trace]) -> Result<(), Box<dyn Error>> {
    if traces.is_empty() {
        return Ok(());
    }
    page.push_str(
        "<h2 id=traces>Force over time</h2>\n<p>What errors are like in the hand: rows of <a href=\"traces.csv\">traces.csv</a>. Each picture is of the \
         start phase from which the method named above it errs most; every method has the tuning of its table.</p>\n<p>",
    );
    for method in Method::ALL {
        page.push_str(&key(colour(method), 10, method.name()));
    }
    page.push_str(&key(BLACK, 4, "right answer, drawn over the others"));
    page.push_str("</p>\n<div class=row>");
    for (index, window) in WINDOWS.iter().enumerate() {
        let its: Vec<&Trace> = traces.iter().filter(|t| t.window == index).collect();
        if !its.is_empty() {
            write!(
                page,
                "<div class=trace><small><a href=\"#{0}\">{0}</a>, {1}, {2} Hz: the hand {3} (start phase {4}: {5})</small><br>",
                window.recipe,
                escaped(window.case),
                window.rate,
                escaped(window.about),
                its[0].phase,
                window.worst.0.name()
            )?;
            page.push_str(&svg(window, &its)?);
            page.push_str("</div>");
        }
    }
    page.push_str("</div>\n");
    Ok(())
}

fn svg(window: &Window, traces: &[&Trace]) -> Result<String, Box<dyn Error>> {
    let values = || traces.iter().flat_map(|t| t.samples.iter().map(|s| s.1));
    let least = values().fold(0.0, f64::min);
    let most = values().fold(0.0, f64::max);
    let room = 0.06 * (most - least).max(1e-3);
    plot::svg(PANEL, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .x_label_area_size(34)
            .y_label_area_size(58)
            .build_cartesian_2d(window.from..window.to, least - room..most + room)?;
        chart
            .configure_mesh()
            .x_desc("time, s")
            .y_desc(window.component.1)
            .x_labels(6)
            .y_labels(6)
            .label_style(("sans-serif", 13))
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(238, 238, 238))
            .draw()?;
        // The project's own and the right answer come last, and so on top.
        let (first, others): (Vec<&Trace>, Vec<&Trace>) = traces
            .iter()
            .partition(|trace| matches!(trace.method, None | Some(Method::Ours)));
        for trace in others.into_iter().chain(first.into_iter().rev()) {
            let ink = trace.method.map_or(BLACK, colour);
            let width = if trace.method.is_some() { 2 } else { 1 };
            let line = trace.samples.iter().copied().filter(|s| s.1.is_finite());
            chart.draw_series(LineSeries::new(line, ink.stroke_width(width)))?;
        }
        Ok(())
    })
}
