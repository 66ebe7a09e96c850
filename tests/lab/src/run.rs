//! All of the laboratory, or what of it is wanted: runs it with a bar of progress, and writes its files.

use std::error::Error;
use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};

use crate::clock::RATES;
use crate::method::Method;
use crate::outcome::{Outcome, run_recipe};
use crate::recipe::Recipe;
use crate::recipes::{Extent, STUDIES, all};
use crate::row::{Row, Verdict};
use crate::store::Store;
use crate::sweeps::{self, Point, Sweep};
use crate::{chart, page, report};

/// The rate at which this project's method must pass every recipe, Hz.
pub const OWN_RATE: u32 = 1000;

/// What is wanted.
#[derive(Clone, Debug)]
pub struct Plan {
    /// How much of each recipe.
    pub extent: Extent,
    /// Names of recipes and studies; `None` is all.
    pub recipes: Option<Vec<String>>,
    /// Who runs them.
    pub methods: Vec<Method>,
    /// Which sweeps.
    pub sweeps: Vec<Sweep>,
}

/// Everything that came of a plan.
#[derive(Clone, Debug, Default)]
pub struct Results {
    /// By recipe.
    pub rows: Vec<Row>,
    /// Those that are runs along a path.
    pub outcomes: Vec<Outcome>,
    /// Points of each sweep.
    pub sweeps: Vec<(Sweep, Vec<Point>)>,
    /// What each recipe and study is about: name, text.
    pub about: Vec<(&'static str, &'static str)>,
}

impl Plan {
    fn wants(&self, name: &str) -> bool {
        let is_named = |names: &Vec<String>| names.iter().any(|wanted| wanted == name);
        self.recipes.as_ref().is_none_or(is_named)
    }

    /// Says which of the wanted recipes there is none of.
    pub fn validate(&self) -> Result<(), String> {
        let recipes = all(self.extent);
        let known = |name: &str| {
            recipes.iter().any(|recipe| recipe.name == name)
                || STUDIES.iter().any(|study| study.name == name)
        };
        let mut wanted = self.recipes.iter().flatten();
        match wanted.find(|name| !known(name)) {
            Some(name) => Err(format!("there is no recipe `{name}`")),
            None => Ok(()),
        }
    }

    /// Runs everything that `store` does not have. The bar is drawn where standard error is a terminal.
    pub fn run(&self, store: &Store) -> Results {
        let recipes = all(self.extent);
        let wanted: Vec<&Recipe> = recipes.iter().filter(|r| self.wants(r.name)).collect();
        let studies: Vec<_> = STUDIES.iter().filter(|s| self.wants(s.name)).collect();
        let runs = |recipe: &&Recipe| {
            let has_part = |method: &&Method| (recipe.out_of_scope)(**method).is_none();
            self.methods.iter().filter(has_part).count() * RATES.len()
        };
        let steps = studies.len()
            + wanted.iter().map(runs).sum::<usize>()
            + self.sweeps.iter().map(Sweep::count).sum::<usize>();
        let bar = bar(steps);
        let mut results = Results::default();
        for study in studies {
            bar.set_message(format!("{}: {}", study.name, study.about));
            results.rows.extend((study.run)(self.extent));
            results.about.push((study.name, study.about));
            bar.inc(1);
        }
        for recipe in wanted {
            bar.set_message(format!("{recipe:?}"));
            let (outcomes, rows) = run_recipe(recipe, &self.methods, store, |_| bar.inc(1));
            results.outcomes.extend(outcomes);
            results.rows.extend(rows);
            results.about.push((recipe.name, recipe.about));
        }
        results.rows.sort_by(|a, b| a.recipe.cmp(b.recipe)); // stable: cases stay in their order
        for sweep in &self.sweeps {
            bar.set_message(format!("sweep of {}", sweep.name));
            let points = sweep.run(self.extent, &recipes, store, || bar.inc(1));
            results.sweeps.push((*sweep, points));
        }
        bar.finish_and_clear();
        results
    }
}

/// Draws nothing where standard error is no terminal.
fn bar(steps: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len}, {eta} to go  {msg}");
    ProgressBar::new(steps as u64).with_style(style.expect("the template is one"))
}

impl Results {
    /// Writes tables, CSV files and charts; with `page`, `report.html` too.
    pub fn write(&self, directory: &Path, page: bool) -> Result<(), Box<dyn Error>> {
        std::fs::create_dir_all(directory)?;
        if !self.about.is_empty() {
            report::write(&self.rows, &self.outcomes, directory)?;
            chart::write(&self.rows, &self.outcomes, directory)?;
        }
        for (sweep, points) in &self.sweeps {
            sweeps::write(sweep, points, directory)?;
        }
        if page {
            std::fs::write(directory.join("report.html"), page::html(self)?)?;
        }
        Ok(())
    }
}

/// Whether a row is a failure of this project's own: of its method at the rate that counts, or of something that has no rate.
#[must_use]
pub fn own_failure(row: &Row) -> bool {
    is_own(row) && row.verdict == Verdict::Fail
}

/// Whether a row is of this project's method at the rate that counts, or of something that has no rate.
#[must_use]
pub fn is_own(row: &Row) -> bool {
    row.rate.is_none() || (row.method == Method::Ours.name() && row.rate == Some(OWN_RATE))
}
