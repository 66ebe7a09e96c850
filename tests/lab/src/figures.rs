//! The tables of `docs/laboratory-figures.md`: what each method came to in the common cases, and where another one than taut is the better choice.
//!
//! Nothing here is measured: costs are those of the committed table, so the page is the same in every run of the same code.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use crate::clock::RATES;
use crate::costs;
use crate::cpu_time::quantile;
use crate::measure::Measure;
use crate::method::Method;
use crate::outcome::Outcome;
use crate::port;
use crate::provenance;
use crate::recipe::{JND_BUDGET, JND_SHARE, Recipe};
use crate::score::{Case, Score};

/// Above this J of ours, a method that errs less is named: half of what is just felt.
const NAMED_FROM: f64 = 0.5;

/// A case, and what the port takes from its right answer: 95th percentile of J, and the share of the time above 1.
pub(crate) type PortError = (Case, [f64; 2]);

/// What the port takes from the right answer of each of these recipes.
pub(crate) fn port_errors(recipes: &[&Recipe]) -> Vec<PortError> {
    let error = |recipe: &&Recipe| {
        let case = (recipe.name.to_owned(), recipe.case.clone());
        (case, port::own_error(recipe))
    };
    recipes.iter().map(error).collect()
}

/// Writes `figures.md`; nothing where no case is common.
pub(crate) fn write(
    scores: &[Score],
    outcomes: &[Outcome],
    port: &[PortError],
    directory: &Path,
) -> io::Result<()> {
    if scores.is_empty() {
        return Ok(());
    }
    let page = page(scores, outcomes, port);
    fs::write(directory.join("figures.md"), page)
}

/// The whole page.
fn page(scores: &[Score], outcomes: &[Outcome], port: &[PortError]) -> String {
    let most = scores.iter().map(|score| score.cases.len()).max();
    let mut text = format!(
        "# Figures of the laboratory\n\n\
         Written by `scripts/laboratory` from the build {}; costs of updates: {}, from `tests/lab/data/costs.csv`. What the columns mean, and what is \
         not in them, is said in [laboratory.md](laboratory.md). A common case is one in which every method with a turning body has a part: there are {}.\n",
        provenance::commit(),
        costs::machine(),
        most.unwrap_or(0)
    );
    let sections: [(&str, String); 6] = [
        ("Cases within the budget", within(scores)),
        ("Lines missed, and in how many cases", reasons(scores)),
        ("Cases outside the budget at 1000 Hz", outside(scores)),
        ("Where another method errs less", better(outcomes)),
        (
            "What taut costs beside a method that is good enough",
            costs_beside(scores, outcomes),
        ),
        ("What the port takes from a right answer", port_table(port)),
    ];
    for (title, table) in sections {
        let _ = write!(text, "\n## {title}\n\n{table}");
    }
    text
}

/// Highest rate first, as the pages have it.
fn rates() -> impl Iterator<Item = u32> {
    RATES.into_iter().rev()
}

fn score_of(scores: &[Score], method: Method, rate: u32) -> Option<&Score> {
    scores.iter().find(|s| (s.method, s.rate) == (method, rate))
}

fn run_methods(scores: &[Score]) -> impl Iterator<Item = Method> {
    let was_run = |method: &Method| scores.iter().any(|score| score.method == *method);
    Method::ALL.into_iter().filter(was_run)
}

/// One cell for each rate, in the order of [`rates`].
fn cells(scores: &[Score], method: Method, cell: impl Fn(&Score) -> String) -> String {
    let of_rate = |rate| score_of(scores, method, rate).map_or(String::new(), &cell);
    rates().map(of_rate).collect::<Vec<_>>().join(" | ")
}

fn within(scores: &[Score]) -> String {
    let mut text = String::from(
        "Of all lines; in brackets the lowest rate that was held in one of them, where that is below the one asked for. `of`: how many of the common \
         cases a method has a part in. By J alone: without the recipes' own lines. Where bodies may meet: without the lines of penetration. Columns are \
         1000, 300 and 70 Hz.\n\n\
         | method | of | within: 1000 Hz | 300 Hz | 70 Hz | by J alone: 1000 Hz | 300 Hz | 70 Hz | where bodies may meet: 1000 Hz | 300 Hz | 70 Hz |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for method in run_methods(scores) {
        let of = scores.iter().find(|score| score.method == method);
        let held = |score: &Score| {
            let slower = score.held < 0.995 * f64::from(score.rate); // false for NaN
            let held = if slower {
                format!(" ({:.0} Hz)", score.held)
            } else {
                String::new()
            };
            format!("{}{held}", score.within())
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            method.name(),
            of.map_or(0, |score| score.cases.len()),
            cells(scores, method, held),
            cells(scores, method, |score| score.felt().to_string()),
            cells(scores, method, |s| s
                .within_where_bodies_may_meet()
                .to_string()),
        );
    }
    text
}

fn reasons(scores: &[Score]) -> String {
    let mut text =
        String::from("| method | 1000 Hz | 300 Hz | 70 Hz |\n| --- | --- | --- | --- |\n");
    let listed = |score: &Score| {
        let reasons = score.reasons().into_iter();
        let reasons: Vec<_> = reasons.map(|(line, n)| format!("`{line}` {n}")).collect();
        or_none(reasons.join(", "))
    };
    for method in run_methods(scores) {
        let _ = writeln!(
            text,
            "| {} | {} |",
            method.name(),
            cells(scores, method, listed)
        );
    }
    text
}

fn or_none(listed: String) -> String {
    match listed.is_empty() {
        true => "none".to_owned(),
        false => listed,
    }
}

fn outside(scores: &[Score]) -> String {
    let mut text = String::new();
    for method in run_methods(scores) {
        let Some(score) = score_of(scores, method, RATES[RATES.len() - 1]) else {
            continue;
        };
        let names = or_none(score.outside().join("; "));
        let _ = writeln!(text, "- **{}**: {names}.", method.name());
    }
    text
}

fn felt(outcome: &Outcome) -> f64 {
    outcome.worst(Measure::JndP95)
}

fn is_ours(method: Method) -> bool {
    matches!(method, Method::Ours | Method::OursByDefault)
}

/// Cases of `ours` that may be felt and in which another method errs less.
fn better(outcomes: &[Outcome]) -> String {
    let mut text = format!(
        "Every case, common or not, in which J of `ours` is above {NAMED_FROM} at the 95th percentile and another method's is less.\n\n\
         | case | rate, Hz | ours | errs less |\n| --- | --- | --- | --- |\n"
    );
    for ours in outcomes
        .iter()
        .filter(|o| o.method == Method::Ours && felt(o) > NAMED_FROM)
    {
        let same =
            |o: &&Outcome| (o.recipe, &o.case, o.rate) == (ours.recipe, &ours.case, ours.rate);
        let others = outcomes.iter().filter(same).filter(|o| !is_ours(o.method));
        let less: Vec<_> = others
            .filter(|other| felt(other) < felt(ours))
            .map(|other| format!("{}: {:.2}", other.method.name(), felt(other)))
            .collect();
        if !less.is_empty() {
            let (case, rate, j) = (&ours.case, ours.rate, felt(ours));
            let less = less.join(", ");
            let _ = writeln!(
                text,
                "| {} {case} | {rate} | {j:.2} | {less} |",
                ours.recipe
            );
        }
    }
    text
}

fn port_table(port: &[PortError]) -> String {
    let mut text = String::from(
        "No force jumps at the hand: the device port lets it change by half a newton a millisecond, and by what the motion of the device explains. Methods \
         are judged by the right answer that has come through it. In these cases the port alone takes more than the budget, whatever the method:\n\n\
         | case | J at the 95th percentile | share of the time above 1 |\n| --- | --- | --- |\n",
    );
    let over = |[p95, share]: &[f64; 2]| *p95 > JND_BUDGET || *share > JND_SHARE; // false for NaN
    for ((name, case), [p95, share]) in port.iter().filter(|(_, error)| over(error)) {
        let _ = writeln!(
            text,
            "| {name} {case} | {p95:.2} | {:.1} % |",
            100.0 * share
        );
    }
    text
}

fn case_of(outcome: &Outcome) -> Case {
    (outcome.recipe.to_owned(), outcome.case.clone())
}

/// Where a method is within the budget, the share of a core of taut by default over its own.
fn costs_beside(scores: &[Score], outcomes: &[Outcome]) -> String {
    let mut text = String::from(
        "Share of one core that taut takes by default over the method's, in the common cases in which both are within the budget: median, and the largest.\n\n\
         | method | 1000 Hz | 300 Hz | 70 Hz |\n| --- | --- | --- | --- |\n",
    );
    let keeps = |method, rate, case: &Case| {
        let lines = score_of(scores, method, rate).and_then(|score| score.cases.get(case));
        lines.is_some_and(|lines| lines.is_empty())
    };
    for method in run_methods(scores).filter(|method| !is_ours(*method)) {
        let cell = |rate: u32| {
            let good = |outcome: &&Outcome| {
                let case = case_of(outcome);
                (outcome.method, outcome.rate) == (method, rate)
                    && keeps(method, rate, &case)
                    && keeps(Method::OursByDefault, rate, &case)
            };
            let ratio = |other: &Outcome| {
                let ours = outcomes.iter().find(|o| {
                    (o.method, o.rate) == (Method::OursByDefault, rate)
                        && case_of(o) == case_of(other)
                });
                ours.map(|ours| ours.measured.load.core / other.measured.load.core)
            };
            let ratios: Vec<f64> = outcomes.iter().filter(good).filter_map(ratio).collect();
            if ratios.is_empty() {
                return "no such case".to_owned();
            }
            let [median, most] = [0.5, 1.0].map(|share| quantile(&ratios, share));
            format!("{} cases: {median:.2}, {most:.1}", ratios.len())
        };
        let row = rates().map(cell).collect::<Vec<_>>().join(" | ");
        let _ = writeln!(text, "| {} | {row} |", method.name());
    }
    text
}
