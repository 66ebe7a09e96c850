//! Which methods are within the budget in the held-out scenes, and which of those is the cheapest, beside what was foretold.
//!
//! Within the budget is: J at most 0.5 at the 95th percentile and above 1 for at most a hundredth of the time. Nobody's costs are known in these scenes, so
//! every update takes its whole period, and cheapest is the least share of a core by the medians of the run's own CPU times.

use std::fmt::Write as _;
use std::path::Path;

use taut_scene::SceneError;

use super::super::scenes::FidelityScene;
use super::super::sweep::{ideal, recipe, without_choice};
use crate::clock::{RATES, TICK};
use crate::crew;
use crate::measure::Measure;
use crate::method::Method;
use crate::outcome::Outcome;
use crate::recipe::Recipe;

/// What was foretold of each method, as it was committed: with the reason.
pub const PREDICTIONS: &str = include_str!("../../../data/held-out-methods.csv");
/// Which method is foretold to be the cheapest within the budget.
pub const CHEAPEST: &str = include_str!("../../../data/held-out-front.csv");
/// Of whom something is foretold.
pub const METHODS: [Method; 6] = [
    Method::OursByDefault,
    Method::Paper,
    Method::Discrete,
    Method::VirtualCoupling,
    Method::Penalty,
    Method::Point,
];
/// Start phases that are judged.
const PHASES: u32 = 4;

/// One method in one scene at one rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The scene.
    pub scene: &'static str,
    /// Who.
    pub method: Method,
    /// Hz.
    pub rate: u32,
    /// J at the 95th percentile, and the share of the time above 1.
    pub felt: [f64; 2],
    /// Share of a core.
    pub core: f64,
    /// Within the budget.
    pub within: bool,
}

/// Why a method has no part in a scene.
fn out_of_scope(scene: &FidelityScene, method: Method) -> bool {
    let ours = method == Method::OursByDefault;
    // Others have neither friction nor obstacles that move; a point has no torque, and is the body where that is a ball, or a cube that only moves.
    let alone = scene.text.contains("friction") || scene.text.contains("motion");
    let point_too = scene.text.contains("shape = { sphere") || scene.name == "cube over a kerb";
    (alone && !ours) || (method == Method::Point && !point_too)
}

/// The scene as a recipe for all methods.
fn for_methods(scene: &FidelityScene, directory: &Path) -> Result<Recipe, SceneError> {
    let built = without_choice(&scene.file("", directory)?)?;
    let mut made = recipe(scene, &built, ideal(scene));
    made.phases = PHASES;
    Ok(made)
}

/// Every method in every scene at every rate.
pub fn run(scenes: &[FidelityScene], directory: &Path) -> Result<Vec<Found>, SceneError> {
    let mut found = Vec::new();
    for scene in scenes {
        let recipe = for_methods(scene, directory)?;
        let _ = recipe.answer();
        let players = METHODS
            .into_iter()
            .filter(|method| !out_of_scope(scene, *method))
            .flat_map(|method| RATES.map(|rate| (method, rate)));
        let players: Vec<_> = players.collect();
        found.extend(crew::map(crew::cores(), &players, |(method, rate)| {
            let outcome = Outcome::of(&recipe, *method, *rate);
            let times = outcome.measured.times;
            let [update, force] = [times.update[0], times.force[0]];
            Found {
                scene: scene.name,
                method: *method,
                rate: *rate,
                felt: [Measure::JndP95, Measure::JndShare].map(|of| outcome.worst(of)),
                core: 1e-6 * (update * f64::from(*rate) + force / TICK),
                within: outcome.passes(&recipe),
            }
        }));
        eprintln!("{}", scene.name);
    }
    Ok(found)
}

/// Whether a method was foretold to be within the budget; `None` where nothing was.
fn foretold(scene: &str, method: Method, rate: u32) -> Option<bool> {
    let fields = |line: &'static str| line.splitn(6, ',').collect::<Vec<_>>();
    let mut lines = PREDICTIONS.lines().map(fields);
    let line = lines.find(|of| of.first() == Some(&scene) && of.get(1) == Some(&method.name()))?;
    match *line.get(column(rate) + 1)? {
        "yes" => Some(true),
        "no" => Some(false),
        _ => None,
    }
}

/// Which method was foretold to be the cheapest within the budget.
fn foretold_cheapest(scene: &str, rate: u32) -> Option<&'static str> {
    let mut lines = CHEAPEST.lines().map(|line| line.split(','));
    let mut line = lines.find(|of| of.clone().next() == Some(scene))?;
    line.nth(column(rate))
}

/// In the files: after the scene, 1000, 300 and 70 Hz.
fn column(rate: u32) -> usize {
    let place = RATES.iter().rev().position(|known| *known == rate);
    place.map_or(usize::MAX / 2, |place| place + 1)
}

/// Who is the cheapest within the budget, or "none".
fn cheapest(found: &[Found], scene: &str, rate: u32) -> &'static str {
    let within = found
        .iter()
        .filter(|f| f.scene == scene && f.rate == rate && f.within);
    let least = within.min_by(|a, b| a.core.total_cmp(&b.core));
    least.map_or("none", |f| f.method.name())
}

/// `held-out-methods-found.csv`.
pub fn csv(found: &[Found]) -> String {
    let mut text =
        "scene,method,rate_hz,foretold,within,j_p95,j_share_above_1,core_share\n".to_owned();
    for f in found {
        let said = foretold(f.scene, f.method, f.rate).map_or("", |yes| yes_or_no(yes));
        let _ = writeln!(
            text,
            "{},{},{},{said},{},{:.4},{:.4},{:.3e}",
            f.scene,
            f.method.name(),
            f.rate,
            yes_or_no(f.within),
            f.felt[0],
            f.felt[1],
            f.core
        );
    }
    text
}

fn yes_or_no(yes: bool) -> &'static str {
    if yes { "yes" } else { "no" }
}

/// A table of Markdown, how many predictions held of how many, and the same of who is the cheapest.
pub fn verdict(found: &[Found]) -> (String, [usize; 4]) {
    let mut text = "| scene | method | within at 1000 / 300 / 70 Hz | foretold | J there |\n| --- | --- | --- | --- | --- |\n".to_owned();
    let mut counts = [0; 4];
    for of_one in found.chunks(RATES.len()) {
        let rates: Vec<&Found> = of_one.iter().rev().collect();
        let first = rates[0];
        let said = rates
            .iter()
            .map(|f| foretold(f.scene, f.method, f.rate).is_some_and(|yes| yes));
        let said: Vec<bool> = said.collect();
        let right = rates
            .iter()
            .zip(&said)
            .filter(|(f, said)| f.within == **said);
        counts[0] += right.count();
        counts[1] += rates.len();
        let each = |of: &dyn Fn(usize) -> String| (0..rates.len()).map(of).collect::<Vec<_>>();
        let found = each(&|i| yes_or_no(rates[i].within).to_owned()).join(" / ");
        let foretold = each(&|i| {
            let said_so = yes_or_no(said[i]);
            if said[i] == rates[i].within {
                said_so.to_owned()
            } else {
                format!("**{said_so}**")
            }
        });
        let felt = each(&|i| format!("{:.2}", rates[i].felt[0])).join(" / ");
        let (scene, method) = (first.scene, first.method.name());
        let _ = writeln!(
            text,
            "| {scene} | {method} | {found} | {} | {felt} |",
            foretold.join(" / ")
        );
    }
    let fronts = fronts(found);
    counts[2] = fronts
        .iter()
        .filter(|(_, found, said)| found == said)
        .count();
    counts[3] = fronts.len();
    text.push_str(
        "\n| scene and rate | cheapest within the budget | foretold |\n| --- | --- | --- |\n",
    );
    for (place, found, said) in fronts {
        let said = if found == said {
            said.to_owned()
        } else {
            format!("**{said}**")
        };
        let _ = writeln!(text, "| {place} | {found} | {said} |");
    }
    (text, counts)
}

/// Scene and rate, who is the cheapest, and who was foretold to be.
fn fronts(found: &[Found]) -> Vec<(String, &'static str, &'static str)> {
    let mut fronts = Vec::new();
    let mut last = "";
    for f in found {
        if f.scene != last {
            last = f.scene;
            for rate in RATES.iter().rev() {
                let place = format!("{}, {rate} Hz", f.scene);
                let said = foretold_cheapest(f.scene, *rate).unwrap_or("");
                fronts.push((place, cheapest(found, f.scene, *rate), said));
            }
        }
    }
    fronts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fidelity::held_out::scenes::all;

    #[test]
    fn something_is_foretold_of_every_method_that_has_a_part() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for scene in all(folder.path()).expect("files can be written") {
            for rate in RATES {
                for method in METHODS {
                    let said = foretold(scene.name, method, rate);
                    let has_part = !out_of_scope(&scene, method);
                    assert_eq!(said.is_some(), has_part, "{} {method:?}", scene.name);
                }
                let said = foretold_cheapest(scene.name, rate).expect("a front");
                let of = METHODS.iter().find(|method| method.name() == said);
                let within =
                    of.is_some_and(|method| foretold(scene.name, *method, rate) == Some(true));
                assert!(within || said == "none", "{} {rate}: {said}", scene.name);
            }
        }
    }
}
