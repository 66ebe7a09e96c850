//! The first questions of a reader: who passes what, were the failures seen that theory predicts, and what was not run.

use std::fmt::Write as _;

use super::{about, class, escaped, line_of, players};
use crate::clock::RATES;
use crate::measure::Measure;
use crate::method::Method;
use crate::report::{brief, felt};
use crate::row::{Row, Verdict};
use crate::run::{OWN_RATE, Results};

/// Recipes by methods, a table for each rate; the rate that counts is open.
pub(super) fn matrices(page: &mut String, results: &Results) -> std::fmt::Result {
    page.push_str(
        "<h2 id=matrix>Who passes what</h2>\n<p>Cases passed of those run, and the largest error felt in them, in just-noticeable differences \
         J. An empty field: not run, for a reason that is <a href=\"#scope\">named below</a>.</p>\n",
    );
    for rate in RATES.iter().rev() {
        let open = if *rate == OWN_RATE { " open" } else { "" };
        write!(page, "<details{open}><summary>{rate} Hz</summary>")?;
        matrix(page, results, *rate)?;
        page.push_str("</details>\n");
    }
    Ok(())
}

fn matrix(page: &mut String, results: &Results, rate: u32) -> std::fmt::Result {
    page.push_str("<table><tr><th>recipe<th>about");
    for method in Method::ALL {
        write!(page, "<th>{}", method.name())?;
    }
    for recipe in results.rows.chunk_by(|a, b| a.recipe == b.recipe) {
        if !recipe.iter().any(|row| row.rate == Some(rate)) {
            continue;
        }
        let name = recipe[0].recipe;
        let about = about(results, name);
        write!(page, "\n<tr><td><a href=\"#{name}\">{name}</a><td>{about}")?;
        for method in Method::ALL {
            let is_its =
                |rows: &&[Row]| rows[0].method == method.name() && rows[0].rate == Some(rate);
            let cells: Vec<&[Row]> = players(recipe).filter(is_its).collect();
            let count = |wanted| cells.iter().filter(|rows| class(rows) == wanted).count();
            let (passed, run) = (count("pass"), cells.len() - count("scope"));
            let outcome = match passed {
                _ if run == 0 => "scope",
                passed if passed == run => "pass",
                0 => "fail",
                _ => "open",
            };
            write!(page, "<td class=\"{outcome} key\">")?;
            if run > 0 {
                write!(page, "{passed}/{run}")?;
            }
            let errors = cells.iter().filter_map(|rows| felt(rows));
            if let Some(most) = errors.filter(|felt| !felt.is_nan()).reduce(f64::max) {
                write!(page, " <small>J {}</small>", brief(most))?;
            }
        }
    }
    page.push_str("</table>\n");
    Ok(())
}

/// A failure that is known of a method before anything is run.
struct Prediction {
    recipe: &'static str,
    case: &'static str,
    method: Method,
    rate: u32,
    measure: &'static str,
    figure: Figure,
    why: &'static str,
}

/// What has to come out.
#[derive(Clone, Copy)]
enum Figure {
    /// The mean over the start phases, within [`WITHIN`].
    Mean(f64),
    /// The worst of them is above.
    Above(f64),
}

/// Of a predicted mean.
const WITHIN: f64 = 0.1;

/// Depths by the delays of the paper's loop at 0.3 m/s, `v (1/k_s - 1/2) / f` and half a tick, since its updates cost microseconds of their
/// period, at the rates at which its default tuning is the best; the others by what the methods are.
const PREDICTIONS: [Prediction; 5] = [
    late(300, 1.65e-3),
    late(1000, 0.60e-3),
    Prediction {
        recipe: "R02",
        case: "ball on a plane",
        method: Method::VirtualCoupling,
        rate: 300,
        measure: "friction",
        figure: Figure::Above(0.02),
        why: "artificial friction: the proxy trails the hand, and its spring pulls back",
    },
    Prediction {
        recipe: "R09",
        case: "plate of 1 mm",
        method: Method::Penalty,
        rate: 300,
        measure: "astray",
        figure: Figure::Above(0.01),
        why: "pop-through: past the middle the nearest way out is the far side",
    },
    Prediction {
        recipe: "R01",
        case: "Lissajous figure",
        method: Method::VirtualCoupling,
        rate: 300,
        measure: "force_at_a_distance",
        figure: Figure::Above(1.0),
        why: "a force in free space: the mass and damping of the proxy are felt",
    },
];

const fn late(rate: u32, depth: f64) -> Prediction {
    Prediction {
        recipe: "R11",
        case: "0.3 m/s",
        method: Method::Paper,
        rate,
        measure: "first_force_depth",
        figure: Figure::Mean(depth),
        why: "late contact: a plane is known when the body has touched it, and the body trails the hand",
    }
}

/// The failures that theory predicts, beside what was measured.
pub(super) fn predicted(page: &mut String, results: &Results) -> std::fmt::Result {
    page.push_str(
        "<h2 id=predicted>Failures that are predicted</h2>\n<p>A laboratory that does not see these would prove nothing by a pass.</p>\n\
         <table><tr><th>recipe<th>case<th>method<th>rate<th>measure<th>predicted<th>measured<th>where<th>why\n",
    );
    for predicted in &PREDICTIONS {
        let Some((value, unit, place)) = measured(results, predicted) else {
            continue;
        };
        let (expected, seen) = match predicted.figure {
            Figure::Mean(mean) => (
                format!("mean {}, within 10 %", readable(mean, &unit)),
                (value - mean).abs() <= WITHIN * mean,
            ),
            Figure::Above(least) => (
                format!("worst above {}", readable(least, &unit)),
                value > least,
            ),
        };
        writeln!(
            page,
            "<tr><td><a href=\"#{0}\">{0}</a><td>{1}<td>{2}<td class=key>{3} Hz<td>{4}<td>{5}<td class=\"{6} key\">{7}<td>{8}<td>{9}",
            predicted.recipe,
            escaped(predicted.case),
            predicted.method.name(),
            predicted.rate,
            predicted.measure,
            escaped(&expected),
            if seen { "pass" } else { "fail" },
            readable(value, &unit),
            place,
            predicted.why
        )?;
    }
    page.push_str("</table>\n");
    Ok(())
}

/// With its unit; lengths in millimetres.
fn readable(value: f64, unit: &str) -> String {
    if unit == "m" {
        format!("{} mm", brief(1e3 * value))
    } else {
        format!("{} {unit}", brief(value)).trim_end().to_owned()
    }
}

/// Value, unit, and where it stands.
fn measured(results: &Results, predicted: &Prediction) -> Option<(f64, String, String)> {
    let row = results.rows.iter().find(|row| {
        (row.recipe, row.case.as_str()) == (predicted.recipe, predicted.case)
            && row.method == predicted.method.name()
            && row.rate == Some(predicted.rate)
            && row.measure == predicted.measure
    })?;
    let unit = row.unit.replace('-', "");
    let Figure::Mean(_) = predicted.figure else {
        let place = format!("rows.csv, line {}", line_of(results, row));
        return Some((row.value, unit, place));
    };
    // A line of measures.csv for each start phase, in the order of the outcomes.
    let mut line = 2;
    for outcome in &results.outcomes {
        let last = line + outcome.measured.phases.len() - 1;
        let is_it = (outcome.recipe, outcome.case.as_str()) == (predicted.recipe, predicted.case)
            && (outcome.method, outcome.rate) == (predicted.method, predicted.rate);
        if is_it {
            let mean = outcome.mean(Measure::FirstForceDepth);
            return Some((mean, unit, format!("measures.csv, lines {line} to {last}")));
        }
        line = last + 1;
    }
    None
}

/// What was not run, and why.
pub(super) fn out_of_scope(page: &mut String, results: &Results) -> std::fmt::Result {
    page.push_str("<h2 id=scope>What is not run, and why</h2>\n");
    let mut skipped: Vec<(&str, &str, Vec<&str>)> = Vec::new();
    for row in &results.rows {
        let Verdict::OutOfScope(reason) = &row.verdict else {
            continue;
        };
        let same = skipped
            .iter_mut()
            .find(|(recipe, of, _)| (*recipe, *of) == (row.recipe, reason.as_str()));
        match same {
            Some((_, _, methods)) if methods.contains(&row.method.as_str()) => {}
            Some((_, _, methods)) => methods.push(&row.method),
            None => skipped.push((row.recipe, reason, vec![&row.method])),
        }
    }
    if skipped.is_empty() {
        page.push_str("<p>Nothing.</p>\n");
        return Ok(());
    }
    page.push_str("<table><tr><th>recipe<th>not run for<th>reason\n");
    for (recipe, reason, methods) in skipped {
        writeln!(
            page,
            "<tr><td><a href=\"#{recipe}\">{recipe}</a><td>{}<td>{}",
            escaped(&methods.join(", ")),
            escaped(reason)
        )?;
    }
    page.push_str("</table>\n");
    Ok(())
}
