//! Every setting of the grid, run and measured, and the verdict on the scene's own choice.
//!
//! Error: J of `felt`, the worst of the start phases: its 95th percentile, or half of its 99th where that is more, so that half a
//! just-noticeable difference is the two lines of the laboratory at once. Cost: nominal microseconds of the god-object loop a second, counted and so the
//! same on every machine of a type.

use std::path::Path;

use taut_scene::fidelity::decide::{MESH_ERRORS, RATES, ROUNDS, TOLERANCES};
use taut_scene::{BuiltScene, FidelityPlan, Scene as SceneFile, SceneError};

use super::counted::Counted;
use super::scenes::FidelityScene;
use crate::clock::{Charge, TICK, run};
use crate::cpu_time::quantile;
use crate::felt::Felt;
use crate::measure::{Measure, Measures};
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};

/// Shares of a period at which the first update begins.
const PHASES: [f64; 2] = [0.25, 0.75];
/// Times of an update that are allowed, nominal us.
pub const TIMES: [f64; 4] = [20.0, 60.0, 120.0, 200.0];
/// What is spent of the error, J.
pub const BUDGET: f64 = 0.5;

/// One setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Hz.
    pub rate: f64,
    /// m.
    pub gap_tolerance: f64,
    /// Implicit rounds.
    pub rounds: u32,
    /// m; 0 is the mesh in the file.
    pub mesh_error: f64,
}

/// A setting and what was measured of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Which.
    pub setting: Setting,
    /// Error, in just-noticeable differences.
    pub j: f64,
    /// 95th and 99th percentile of J.
    pub percentiles: [f64; 2],
    /// J of the first version: the largest of direction, magnitude, torque and step, each by itself.
    pub first: f64,
    /// Nominal us of the god-object loop a second.
    pub cost: f64,
}

/// A choice within a time.
#[derive(Clone, Debug)]
pub struct Timed {
    /// Most nominal time of an update that was allowed, us.
    pub time_us: f64,
    /// What the scene chose.
    pub plan: FidelityPlan,
    /// The choice, measured.
    pub auto: Measured,
}

/// The choice of a scene beside other settings.
#[derive(Clone, Debug)]
pub struct Swept {
    /// Of the scene.
    pub name: String,
    /// Error of the choice, as it is predicted.
    pub predicted_j: f64,
    /// The choice, measured.
    pub auto: Measured,
    /// The settings that were run.
    pub all: Vec<Measured>,
    /// Choices by the time that an update may take.
    pub timed: Vec<Timed>,
}

impl Measured {
    /// Nominal time of an update, us.
    pub fn update_us(&self) -> f64 {
        self.cost / self.setting.rate
    }
}

impl Swept {
    /// The cheapest within the budget, if any is.
    pub fn cheapest(&self) -> Option<&Measured> {
        let within = self.all.iter().filter(|measured| measured.j <= BUDGET);
        within.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// The least error of all settings.
    pub fn least_error(&self) -> f64 {
        self.all.iter().map(|m| m.j).fold(f64::INFINITY, f64::min)
    }

    /// The least error of the settings whose updates take no more than a time, us; infinite where none is so fast.
    pub fn least_error_within(&self, time_us: f64) -> f64 {
        let fast = self.all.iter().filter(|m| m.update_us() <= time_us);
        fast.map(|m| m.j).fold(f64::INFINITY, f64::min)
    }

    /// Cost of the choice over the cheapest that is within the budget.
    pub fn ratio(&self) -> Option<f64> {
        self.cheapest().map(|best| self.auto.cost / best.cost)
    }

    /// Whether the choice is within the budget.
    #[must_use]
    pub fn is_within(&self) -> bool {
        self.auto.j <= BUDGET
    }

    /// Whether it is, or no setting is.
    #[must_use]
    pub fn is_kept(&self) -> bool {
        self.is_within() || self.cheapest().is_none()
    }
}

impl FidelityScene {
    /// The scene file, with this where a mesh may be simplified.
    pub(super) fn file(&self, simplify: &str, directory: &Path) -> Result<SceneFile, SceneError> {
        let text = self.text.replace("{simplify}", simplify);
        SceneFile::parse("fidelity.toml", &text, directory)
    }
}

/// With the settings of the file.
pub(super) fn without_choice(file: &SceneFile) -> Result<BuiltScene, SceneError> {
    file.with_override("fidelity.mode=\"off\"")?.build()
}

/// What the scene chooses, from its file alone.
pub fn choice(scene: &FidelityScene, directory: &Path) -> Result<(Setting, f64), SceneError> {
    let (setting, plan) = chosen(&scene.file("", directory)?.build()?);
    Ok((setting, plan.predicted_j))
}

/// Builds, runs and measures. `quick` takes every other rate and the ends of the other lists.
pub fn sweep(scene: &FidelityScene, directory: &Path, quick: bool) -> Result<Swept, SceneError> {
    let file = scene.file("", directory)?;
    let built = file.build()?;
    let size = built.size;
    let (setting, plan) = chosen(&built);
    let right = answer(scene, &without_choice(&file)?);
    let auto = measure(scene, &built, setting, &right);
    let choose = |time_us: &f64| -> Result<Timed, SceneError> {
        let within = format!("fidelity.time_us={time_us:?}");
        let built = file.with_override(&within)?.build()?;
        let (setting, plan) = chosen(&built);
        Ok(Timed {
            time_us: *time_us,
            auto: measure(scene, &built, setting, &right),
            plan,
        })
    };
    let timed = TIMES.iter().map(choose).collect::<Result<Vec<_>, _>>()?;
    let has_meshes = scene.text.contains("{simplify}");
    let mesh_errors = if has_meshes { &MESH_ERRORS[..] } else { &[0.0] };
    let mut all = Vec::new();
    for mesh_error in mesh_errors.iter().map(|share| share * size) {
        let simplify = if mesh_error > 0.0 {
            format!(", simplify = {{ max_error = {mesh_error:?} }}")
        } else {
            String::new()
        };
        let base = without_choice(&scene.file(&simplify, directory)?)?;
        let step = if quick { 2 } else { 1 };
        for rate in RATES.iter().step_by(step) {
            for tolerance in TOLERANCES.iter().step_by(step) {
                for rounds in ROUNDS.iter().step_by(step) {
                    let setting = Setting {
                        rate: *rate,
                        gap_tolerance: tolerance * size,
                        rounds: *rounds,
                        mesh_error,
                    };
                    all.push(measure(scene, &base, setting, &right));
                }
            }
        }
    }
    all.push(auto);
    Ok(Swept {
        name: scene.name.to_owned(),
        predicted_j: plan.predicted_j,
        auto,
        all,
        timed,
    })
}

/// What a scene chose by itself, with its reasons.
fn chosen(built: &BuiltScene) -> (Setting, FidelityPlan) {
    let plan = built.fidelity.clone();
    let plan = plan.unwrap_or_else(|| panic!("the scene chooses"));
    let setting = Setting {
        rate: plan.update_rate_hz,
        gap_tolerance: built.settings.gap_tolerance,
        rounds: built.settings.implicit_rounds,
        mesh_error: built.simplified.first().map_or(0.0, |s| s.max_error),
    };
    (setting, plan)
}

/// The scene as a recipe, with this right answer.
pub(super) fn recipe(scene: &FidelityScene, built: &BuiltScene, ideal: Ideal) -> Recipe {
    let moving = built.motions.first().cloned();
    let device = scene.device.clone();
    Recipe {
        ideal,
        moving: moving
            .map(|motion| -> crate::recipe::Motion { Box::new(move |time| motion.pose_at(time)) }),
        check_every: u32::MAX,
        ..Recipe::new(
            ("fidelity", scene.name.to_owned()),
            "fidelity",
            Scene::built(built),
            scene.duration,
            move |time| device(time),
        )
    }
}

/// Where the right answer of a scene comes from.
pub(super) fn ideal(scene: &FidelityScene) -> Ideal {
    scene.ideal.map_or(Ideal::Reference, Ideal::closed)
}

/// The right wrench at every tick.
fn answer(scene: &FidelityScene, built: &BuiltScene) -> Vec<god_object::Vector6> {
    let recipe = recipe(scene, built, ideal(scene));
    let answer = recipe.answer();
    if !answer.converged() {
        eprintln!(
            "{}: half the step changes the right answer by {:.3} N, {:.5} N m: too much to judge errors by",
            scene.name, answer.force_error, answer.torque_error
        );
    }
    answer.wrenches.clone()
}

fn measure(
    scene: &FidelityScene,
    built: &BuiltScene,
    setting: Setting,
    right: &[god_object::Vector6],
) -> Measured {
    let right = right.to_vec();
    let at = move |time: f64| right[(time / TICK).round() as usize];
    measured(&recipe(scene, built, Ideal::closed(at)), setting)
}

/// A recipe run with a setting from both start phases.
pub(super) fn measured(recipe: &Recipe, setting: Setting) -> Measured {
    let mut scene = recipe.scene.clone();
    scene.settings.gap_tolerance = setting.gap_tolerance;
    scene.settings.implicit_rounds = setting.rounds;
    let right = &recipe.answer().wrenches;
    let (mut percentiles, mut first, mut work) = ([0.0_f64; 2], 0.0_f64, 0);
    for phase in PHASES {
        let mut method = Counted::new(&scene, &(recipe.device)(0.0));
        let charge = &mut Charge::WholePeriod;
        let ran = run(&mut method, recipe, setting.rate as u32, phase, charge);
        let felt = Felt::new(&ran.ticks, right, scene.arm());
        for (most, share) in percentiles.iter_mut().zip([0.95, 0.99]) {
            *most = or_more(*most, quantile(&felt.each, share));
        }
        first = or_more(first, Measures::of(recipe, &ran.ticks).get(Measure::Felt));
        work += method.work.nominal_us();
    }
    Measured {
        setting,
        j: or_more(percentiles[0], 0.5 * percentiles[1]),
        percentiles,
        first,
        cost: work as f64 / (PHASES.len() as f64 * recipe.duration),
    }
}

/// The larger of two; what is not a number is no small error.
fn or_more(most: f64, other: f64) -> f64 {
    if other.is_nan() {
        f64::INFINITY
    } else {
        most.max(other)
    }
}
