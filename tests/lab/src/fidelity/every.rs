//! The choice of fidelity in every recipe with a right answer, and in every scene that is shipped.
//!
//! A recipe says of its use what a scene file may say: how fast its hand goes and turns while it touches something, how hard it presses in the median, and
//! where it goes. The choice has no constant that was fitted to any of them, so each is judged as if it had been left out.

use std::fmt::Write as _;
use std::path::PathBuf;

use god_object::Pose;
use god_object::spatial::linear;
use taut_plant::{MinJerkPath, ViaPoint};
use taut_scene::fidelity::decide::{RATES, ROUNDS};
use taut_scene::fidelity::need::rates;
use taut_scene::fidelity::{Fixed, SceneNeed, Usage, decide};
use taut_scene::{BuiltScene, Scene as SceneFile, SceneError};

use super::sweep::{BUDGET, Setting, Swept, measured};
use super::tables::markdown;
use crate::clock::TICK;
use crate::cpu_time::quantile;
use crate::crew;
use crate::measure::FELT_FORCE;
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};
use crate::recipes::{Extent, all};

/// Poses of a hand's path are this many ticks apart.
const PATH_TICKS: usize = 10;
/// Of a hand whose recipe touches nothing, N: what is felt of it is all there is.
const NO_FORCE: f64 = FELT_FORCE / 0.07;
/// Most of a shipped scene's path that is run, s.
const LONGEST: f64 = 10.0;
/// Scenes that are shipped.
const SHIPPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../server/scenes");

/// The ratio of a choice that is within the budget.
fn ratio(judged: &Swept) -> Option<f64> {
    judged.ratio().filter(|_| judged.is_within())
}

/// Recipes and shipped scenes of these names, or all.
pub(crate) fn run(names: &[String]) -> Result<Vec<Swept>, SceneError> {
    let mut cases = all(Extent::Quick);
    cases.retain(|recipe| !matches!(recipe.ideal, Ideal::None));
    cases.extend(shipped()?);
    let wanted = |recipe: &Recipe| names.is_empty() || names.iter().any(|n| n == recipe.name);
    cases.retain(wanted);
    Ok(crew::map(crew::cores(), &cases, |recipe| {
        let judged = judge(recipe);
        eprintln!("{}", judged.name);
        judged
    }))
}

/// The choice of a recipe beside every rate and number of rounds at its tolerance.
fn judge(recipe: &Recipe) -> Swept {
    let scene = &recipe.scene;
    let need = SceneNeed::of_world(&scene.world, &scene.settings, &usage(recipe));
    let chosen = decide(&need, &Fixed::default(), BUDGET, None);
    let with = |rate: f64, rounds: u32| {
        let setting = Setting {
            rate,
            gap_tolerance: chosen.gap_tolerance,
            rounds,
            mesh_error: 0.0,
        };
        measured(recipe, setting)
    };
    let auto = with(chosen.rate, chosen.rounds);
    let others = RATES
        .iter()
        .flat_map(|rate| ROUNDS.map(|rounds| (*rate, rounds)));
    let others = others.map(|(rate, rounds)| {
        if (rate, rounds) == (chosen.rate, chosen.rounds) {
            auto
        } else {
            with(rate, rounds)
        }
    });
    Swept {
        name: format!("{} {}", recipe.name, recipe.case),
        predicted_j: chosen.j,
        auto,
        all: others.collect(),
        timed: Vec::new(),
    }
}

/// How a recipe is used: what its hand does while the right force is felt.
fn usage(recipe: &Recipe) -> Usage {
    let poses: Vec<Pose> = (0..recipe.ticks())
        .map(|tick| (recipe.device)(f64::from(tick) * TICK))
        .collect();
    let forces = recipe.answer().wrenches.iter().map(|w| linear(w).norm());
    let forces: Vec<f64> = forces.collect();
    let touching: Vec<usize> = (1..poses.len())
        .filter(|i| forces[*i] > FELT_FORCE && forces[i - 1] > FELT_FORCE)
        .collect();
    let moving: Vec<usize> = if touching.is_empty() {
        (1..poses.len()).collect()
    } else {
        touching.clone()
    };
    let fastest = |of: fn([f64; 2]) -> f64| {
        let each = moving
            .iter()
            .map(|i| of(rates([&poses[i - 1], &poses[*i]], TICK)));
        each.fold(0.0, f64::max)
    };
    let pressed: Vec<f64> = touching.iter().map(|i| forces[*i]).collect();
    let obstacle = recipe.moving.as_ref().map(|moving| {
        let at = |tick: u32| moving(f64::from(tick) * TICK);
        let each = (1..recipe.ticks()).map(|tick| rates([&at(tick - 1), &at(tick)], TICK)[0]);
        each.fold(0.0, f64::max)
    });
    Usage {
        speed: fastest(|[speed, _]| speed),
        turn_rate: fastest(|[_, turn]| turn),
        force: if pressed.is_empty() {
            NO_FORCE
        } else {
            quantile(&pressed, 0.5)
        },
        path: poses.iter().step_by(PATH_TICKS).copied().collect(),
        obstacle_speeds: obstacle.into_iter().collect(),
    }
}

/// The shipped scenes, the device where the hand means to be. One whose files are not there is told and left
/// out, and so is one whose obstacle moves and
/// turns the body: there is no right answer for it.
fn shipped() -> Result<Vec<Recipe>, SceneError> {
    let mut recipes = Vec::new();
    for name in ["sphere-on-plane", "peg-in-a-hole", "two-bunnies"] {
        let built = SceneFile::load(&PathBuf::from(SHIPPED).join(format!("{name}.toml")))?.build();
        let built = match built {
            Ok(built) => built,
            Err(error) => {
                eprintln!("{name} is left out: {error}");
                continue;
            }
        };
        recipes.extend(along_its_path(name, &built));
    }
    eprintln!("moving-plate is left out: it has no right answer");
    Ok(recipes)
}

fn along_its_path(name: &'static str, built: &BuiltScene) -> Option<Recipe> {
    let samples = built.hand.as_ref()?.path.samples();
    let first = samples.first()?.time;
    let via = samples.iter().map(|sample| ViaPoint {
        time_s: sample.time - first,
        pose: sample.pose,
    });
    let path = MinJerkPath::new(via.collect(), false).ok()?;
    let duration = (samples.last()?.time - first).min(LONGEST);
    Some(Recipe {
        ideal: Ideal::Reference,
        check_every: u32::MAX,
        ..Recipe::new(
            ("shipped", name.to_owned()),
            "shipped",
            Scene::built(built),
            duration,
            move |time| path.at(time).0,
        )
    })
}

/// CSV of every setting of every case.
pub(crate) fn csv(judged: &[Swept]) -> String {
    let mut text =
        "case,rate_hz,rounds,chosen,predicted_j,j,j_p95,j_p99,j_first,cost_us_per_s\n".to_owned();
    for case in judged {
        for m in &case.all {
            let chosen = m.setting == case.auto.setting;
            let predicted = if chosen {
                format!("{:.6}", case.predicted_j)
            } else {
                String::new()
            };
            let _ = writeln!(
                text,
                "\"{}\",{},{},{chosen},{predicted},{:.6},{:.6},{:.6},{:.6},{:.3}",
                case.name,
                m.setting.rate,
                m.setting.rounds,
                m.j,
                m.percentiles[0],
                m.percentiles[1],
                m.first,
                m.cost
            );
        }
    }
    text
}

/// A table of Markdown, with how many are within the budget and how dear they are in the median.
pub(crate) fn table(judged: &[Swept]) -> String {
    let mut text = markdown("case", judged, ratio);
    let ratios: Vec<f64> = judged.iter().filter_map(ratio).collect();
    let count = |of: fn(&Swept) -> bool| judged.iter().filter(|case| of(case)).count();
    let _ = writeln!(
        text,
        "\n{} of {} within the budget, {} where some setting is; cost over the least: median {:.2}, three quarters at most {:.2}, most {:.2}",
        count(Swept::is_within),
        judged.len(),
        count(|case| case.cheapest().is_some()),
        quantile(&ratios, 0.5),
        quantile(&ratios, 0.75),
        quantile(&ratios, 1.0)
    );
    text
}
