//! One setting of this project's method at a time: what accuracy it buys, and what time it costs.
//!
//! A sweep writes `sweep-NAME.csv`, and `sweep-NAME.svg` with a panel for each recipe. Everything but what it sweeps is as in
//! [`Scene::fitted`](crate::method::Scene::fitted).

mod files;
mod mesh_level;
mod settings;
mod solver_limits;
mod solvers;
mod wire;

use god_object::Settings;

pub use files::{csv, write};
pub(crate) use files::{legend, panels};

use crate::crew;
use crate::measure::Measure;
use crate::measured::{Measured, judged};
use crate::methods::GodObjectMethod;
use crate::recipe::Recipe;
use crate::recipes::{Extent, named};
use crate::store::{Store, recipe_key};

/// All, most telling first.
pub const SWEEPS: [Sweep; 10] = [
    settings::SHARE,
    settings::ROUNDS,
    settings::RATE,
    settings::LOOK_AHEAD,
    settings::ADAPTATION,
    settings::CCD_TOLERANCE,
    solvers::SWEEP,
    solver_limits::SWEEP,
    mesh_level::SWEEP,
    wire::SWEEP,
];

/// What a sweep varies.
pub struct Variant {
    /// What it is called in files and legends.
    pub label: String,
    /// Updates a second, Hz.
    pub rate: u32,
    /// Settings from those of the recipe.
    pub settings: Box<dyn Fn(Settings) -> Settings + Sync>,
}

/// A run of a recipe that a sweep has made for itself.
#[derive(Debug)]
pub struct Case {
    /// With its settings.
    pub recipe: Recipe,
    /// What it is called in files and legends.
    pub label: String,
    /// Updates a second, Hz.
    pub rate: u32,
    /// What it costs, where that is not the time of an update.
    pub cost: Option<f64>,
}

/// What a sweep's errors are bought with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// 99th percentile of the CPU time of an update or a projection, us: differs between runs.
    Time,
    /// Bytes on the wire a second, kB/s.
    Bandwidth,
}

impl Cost {
    /// Name of the column.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::Time => "update_p99_us",
            Self::Bandwidth => "bandwidth_kb_per_s",
        }
    }

    /// Name of the axis.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Time => "p99 of an update, us",
            Self::Bandwidth => "on the wire, kB/s",
        }
    }
}

/// How a sweep runs.
#[derive(Clone, Copy, Debug)]
pub enum Runs {
    /// Variants of the settings, on these recipes: names and cases.
    Settings(
        &'static [(&'static str, &'static str)],
        fn() -> Vec<Variant>,
    ),
    /// Recipes of its own.
    Recipes(fn(Extent) -> Vec<Case>),
    /// Something else; on so many threads.
    Own(fn(Extent, usize) -> Vec<Point>),
}

/// One sweep.
#[derive(Clone, Copy, Debug)]
pub struct Sweep {
    /// In files and on the command line.
    pub name: &'static str,
    /// What is varied, and what is not.
    pub about: &'static str,
    /// What the error is, and its unit.
    pub error: &'static str,
    /// What it is drawn over.
    pub cost: Cost,
    /// What runs.
    pub runs: Runs,
}

/// One point of a sweep: a row of its CSV.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Of the recipe.
    pub recipe: &'static str,
    /// Of the recipe.
    pub case: String,
    /// What was set.
    pub setting: String,
    /// Updates a second, Hz.
    pub rate: Option<u32>,
    /// Of the sweep.
    pub error: f64,
    /// Of [`Sweep::cost`]; where that is a time, no other field differs between runs.
    pub cost: f64,
    /// Other measures, in the order of the CSV; empty where there are none.
    pub measures: Vec<f64>,
}

/// What else the CSV has of every point.
pub(crate) const SHOWN: [Measure; 7] = [
    Measure::DirectionP95,
    Measure::MagnitudeP95,
    Measure::TorqueP95,
    Measure::Step,
    Measure::FirstForceDepth,
    Measure::Penetration,
    Measure::Energy,
];

impl Sweep {
    /// How many steps of progress it is, in an extent.
    pub fn count(&self, extent: Extent) -> usize {
        match self.runs {
            Runs::Settings(recipes, variants) => recipes.len() * variants().len(),
            Runs::Recipes(cases) => cases(extent).len(),
            Runs::Own(_) => 1,
        }
    }

    /// All its points, made on so many threads; calls `done` after each run.
    pub fn run(
        &self,
        extent: Extent,
        recipes: &[Recipe],
        store: &Store,
        threads: usize,
        done: impl Fn() + Sync,
    ) -> Vec<Point> {
        let point = |recipe: &Recipe, label: &str, rate, cost: Option<f64>, settings: &Settings| {
            let measured = run(recipe, rate, settings, store);
            done();
            Point {
                recipe: recipe.name,
                case: recipe.case.clone(),
                setting: label.to_owned(),
                rate: Some(rate),
                error: measured.worst(Measure::Felt),
                cost: cost.unwrap_or(measured.times.update[1]),
                measures: SHOWN.map(|measure| measured.worst(measure)).to_vec(),
            }
        };
        match self.runs {
            Runs::Own(run) => {
                let points = run(extent, threads);
                done();
                points
            }
            Runs::Recipes(cases) => crew::map(threads, &cases(extent), |case| {
                let fitted = case.recipe.scene.fitted(1.0 / f64::from(case.rate));
                point(&case.recipe, &case.label, case.rate, case.cost, &fitted)
            }),
            Runs::Settings(names, variants) => {
                let variants = variants();
                let tasks: Vec<(&Recipe, &Variant)> = names
                    .iter()
                    .flat_map(|(name, case)| {
                        let recipe = named(recipes, name, case);
                        variants.iter().map(move |variant| (recipe, variant))
                    })
                    .collect();
                crew::map(threads, &tasks, |(recipe, variant)| {
                    let fitted = recipe.scene.fitted(1.0 / f64::from(variant.rate));
                    let settings = (variant.settings)(fitted);
                    point(recipe, &variant.label, variant.rate, None, &settings)
                })
            }
        }
    }
}

fn run(recipe: &Recipe, rate: u32, settings: &Settings, store: &Store) -> Measured {
    let key = format!("sweep {} {rate} {settings:?}", recipe_key(recipe));
    store.get(recipe.name, &key, Measured::from_numbers, || {
        let start = || Box::new(GodObjectMethod::new(&recipe.scene, settings)) as _;
        let measured = Measured::of(recipe, rate, &judged(recipe.phases), None, start);
        let numbers = measured.to_numbers();
        (measured, numbers)
    })
}
