//! One setting of this project's method at a time: what accuracy it buys, and what time it costs.
//!
//! A sweep writes `sweep-NAME.csv`, and `sweep-NAME.svg` with a panel for each recipe. Everything but what it sweeps is as in
//! [`Scene::fitted`](crate::method::Scene::fitted).

mod adaptation;
mod ccd_tolerance;
mod files;
mod implicit_rounds;
mod look_ahead;
mod share;
mod solvers;
mod update_rate;

use god_object::Settings;

pub use files::{csv, write};
pub(crate) use files::{legend, panels};

use crate::measure::Measure;
use crate::measured::Measured;
use crate::methods::GodObjectMethod;
use crate::recipe::Recipe;
use crate::recipes::Extent;
use crate::store::{Store, recipe_key};

/// All, most telling first.
pub const SWEEPS: [Sweep; 7] = [
    share::SWEEP,
    implicit_rounds::SWEEP,
    update_rate::SWEEP,
    look_ahead::SWEEP,
    adaptation::SWEEP,
    ccd_tolerance::SWEEP,
    solvers::SWEEP,
];

/// Sweeps that are wanted and not there: what, and why.
pub const MISSING: [(&str, &str); 4] = [
    (
        "solvers by tolerance and iteration cap",
        "tolerances and caps are constants of the solvers; they are swept by the number of contacts instead",
    ),
    ("mesh level", "recipes are not run on simplified meshes yet"),
    (
        "quantisation and rate of poses on the wire",
        "poses go as 32-bit floats; there is no other coding to compare with",
    ),
    (
        "stability: stiffness against delay, rate, damping, quantisation",
        "maps of their own: see docs/stability.md and cargo run --release -p taut-control-tests --bin stability_map",
    ),
];

/// What a sweep varies.
#[derive(Clone, Debug)]
pub struct Variant {
    /// What it is called in files and legends.
    pub label: String,
    /// Updates a second, Hz.
    pub rate: u32,
    /// Settings from those of the recipe.
    pub settings: fn(Settings, f64) -> Settings,
    /// The number that `settings` takes.
    pub value: f64,
}

/// How a sweep runs.
#[derive(Clone, Copy, Debug)]
pub enum Runs {
    /// Variants of the settings, on these recipes: names and cases.
    Settings(
        &'static [(&'static str, &'static str)],
        fn() -> Vec<Variant>,
    ),
    /// Something that is no run along a path.
    Own(fn(Extent) -> Vec<Point>),
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
    /// 99th percentile of the CPU time, us: no other field differs between runs.
    pub p99_us: f64,
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
    /// How many runs of recipes it has.
    #[must_use]
    pub fn count(&self) -> usize {
        match self.runs {
            Runs::Settings(recipes, variants) => recipes.len() * variants().len(),
            Runs::Own(_) => 1,
        }
    }

    /// All its points; calls `done` after each run.
    ///
    /// # Panics
    ///
    /// Where a recipe that it names is not there: both are made in code.
    pub fn run(
        &self,
        extent: Extent,
        recipes: &[Recipe],
        store: &Store,
        mut done: impl FnMut(),
    ) -> Vec<Point> {
        let (names, variants) = match self.runs {
            Runs::Own(run) => {
                let points = run(extent);
                done();
                return points;
            }
            Runs::Settings(names, variants) => (names, variants()),
        };
        let mut points = Vec::new();
        for (name, case) in names {
            let recipe = recipes.iter().find(|r| r.name == *name && r.case == *case);
            let recipe = recipe.unwrap_or_else(|| panic!("no recipe {name}, {case}"));
            for variant in &variants {
                let measured = run(recipe, variant, store);
                points.push(Point {
                    recipe: recipe.name,
                    case: recipe.case.clone(),
                    setting: variant.label.clone(),
                    rate: Some(variant.rate),
                    error: measured.worst(Measure::Felt),
                    p99_us: measured.times.update[1],
                    measures: SHOWN.map(|measure| measured.worst(measure)).to_vec(),
                });
                done();
            }
        }
        points
    }
}

fn run(recipe: &Recipe, variant: &Variant, store: &Store) -> Measured {
    let fitted = recipe.scene.fitted(1.0 / f64::from(variant.rate));
    let settings = (variant.settings)(fitted, variant.value);
    let key = format!("sweep {} {} {settings:?}", recipe_key(recipe), variant.rate);
    store.get(recipe.name, &key, Measured::from_numbers, || {
        let start = || Box::new(GodObjectMethod::new(&recipe.scene, &settings)) as _;
        let measured = Measured::of(recipe, variant.rate, recipe.phases, start);
        let numbers = Measured::to_numbers(&measured.phases, &measured.times);
        (measured, numbers)
    })
}
