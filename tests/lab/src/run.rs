//! All of the laboratory, or what of it is wanted: runs it with a bar of progress, and writes its files.

use std::error::Error;
use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};

use crate::crew;
use crate::method::Method;
use crate::outcome::{Outcome, players, recipe_rows};
use crate::page::traces::{self, Trace};
use crate::recipe::{Ideal, Recipe};
use crate::recipes::{Extent, STUDIES, all};
use crate::row::{Row, Verdict};
use crate::score::{Score, scores};
use crate::store::Store;
use crate::study::Study;
use crate::sweeps::{self, Point, Sweep};
use crate::{chart, figures, maps, overview, page, reasons, report};

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
    /// The stability maps, too.
    pub maps: bool,
    /// On how many threads. Answers do not depend on it; times do a little, since cores share what is behind them.
    pub threads: usize,
}

/// One thing to be done, by itself.
enum Task<'a> {
    Study(&'a Study),
    Run(&'a Recipe, Method, u32),
}

/// What came of it.
enum Done {
    Rows(Vec<Row>),
    Outcome(Box<Outcome>),
}

/// Everything that came of a plan.
#[derive(Clone, Debug, Default)]
pub struct Results {
    /// By recipe.
    pub rows: Vec<Row>,
    /// Those that are runs along a path.
    pub outcomes: Vec<Outcome>,
    /// What each method came to in the cases that all can run.
    pub scores: Vec<Score>,
    /// Points of each sweep.
    pub sweeps: Vec<(Sweep, Vec<Point>)>,
    /// Points of the stability maps.
    pub(crate) maps: Vec<maps::Point>,
    /// What the port takes from the right answer of each recipe.
    pub port: Vec<figures::PortError>,
    /// Forces over time in some recipes.
    pub traces: Vec<Trace>,
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
    ///
    /// The order of rows, outcomes and points is that of the plan, whatever was done first.
    pub fn run(&self, store: &Store) -> Results {
        let recipes = all(self.extent);
        let wanted: Vec<&Recipe> = recipes.iter().filter(|r| self.wants(r.name)).collect();
        let studies: Vec<&Study> = STUDIES.iter().filter(|s| self.wants(s.name)).collect();
        let bar = bar(self.steps(&wanted, &studies));
        self.make_references(&wanted, &bar);
        let mut results = Results::default();
        for done in self.done(&wanted, &studies, store, &bar) {
            match done {
                Done::Rows(rows) => results.rows.extend(rows),
                Done::Outcome(outcome) => results.outcomes.push(*outcome),
            }
        }
        let abouts = studies.iter().map(|study| (study.name, study.about));
        results.about.extend(abouts);
        results.scores = scores(&wanted, &results.outcomes, Method::SIX_DEGREES);
        results.port = figures::port_errors(&wanted);
        let mut rest = results.outcomes.as_slice();
        for recipe in wanted {
            let (its, others) = rest.split_at(self.runs_of(recipe));
            rest = others;
            results.rows.extend(recipe_rows(recipe, &self.methods, its));
            results.about.push((recipe.name, recipe.about));
        }
        results.rows.sort_by(|a, b| a.recipe.cmp(b.recipe)); // stable: cases stay in their order
        results.traces = traces::run(&recipes, &results.outcomes);
        for sweep in &self.sweeps {
            bar.set_message(format!("sweep of {}", sweep.name));
            let points = sweep.run(self.extent, &recipes, store, self.threads, || bar.inc(1));
            results.sweeps.push((*sweep, points));
        }
        if self.maps {
            bar.set_message("stability maps");
            results.maps = maps::run(self.extent, self.threads, || bar.inc(1));
        }
        bar.finish_and_clear();
        results
    }

    fn runs_of(&self, recipe: &Recipe) -> usize {
        players(recipe, &self.methods).len()
    }

    /// What the bar counts.
    fn steps(&self, wanted: &[&Recipe], studies: &[&Study]) -> usize {
        let runs = wanted.iter().map(|recipe| self.runs_of(recipe));
        let points = self.sweeps.iter().map(|sweep| sweep.count(self.extent));
        let maps = self.maps.then(|| maps::tasks(self.extent).len());
        studies.len() + runs.sum::<usize>() + points.sum::<usize>() + maps.unwrap_or(0)
    }

    /// Before all else: whoever needs a reference while another makes it would wait.
    fn make_references(&self, wanted: &[&Recipe], bar: &ProgressBar) {
        let has_reference = |recipe: &&&Recipe| matches!(recipe.ideal, Ideal::Reference);
        let references: Vec<&Recipe> = wanted.iter().filter(has_reference).copied().collect();
        crew::map(self.threads, &references, |recipe| {
            bar.set_message(format!("{recipe:?}: reference"));
            let _ = recipe.answer();
        });
    }

    /// Studies, then every recipe with each of its players.
    fn done(
        &self,
        wanted: &[&Recipe],
        studies: &[&Study],
        store: &Store,
        bar: &ProgressBar,
    ) -> Vec<Done> {
        let by_recipe = wanted.iter().flat_map(|recipe| {
            let players = players(recipe, &self.methods).into_iter();
            players.map(|(method, rate)| Task::Run(recipe, method, rate))
        });
        let tasks: Vec<Task<'_>> = studies
            .iter()
            .map(|study| Task::Study(study))
            .chain(by_recipe)
            .collect();
        crew::map(self.threads, &tasks, |task| {
            let done = match task {
                Task::Study(study) => {
                    bar.set_message(format!("{}: {}", study.name, study.about));
                    Done::Rows((study.run)(self.extent))
                }
                Task::Run(recipe, method, rate) => {
                    bar.set_message(format!("{recipe:?}"));
                    Done::Outcome(Box::new(Outcome::kept(store, recipe, *method, *rate)))
                }
            };
            bar.inc(1);
            done
        })
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
            report::write(&self.rows, &self.outcomes, &self.scores, directory)?;
            chart::write(&self.rows, &self.outcomes, directory)?;
            overview::write(&self.rows, &self.outcomes, directory)?;
            reasons::write(&self.scores, directory)?;
            figures::write(&self.scores, &self.outcomes, &self.port, directory)?;
            if !self.traces.is_empty() {
                std::fs::write(directory.join("traces.csv"), traces::csv(&self.traces))?;
            }
        }
        for (sweep, points) in &self.sweeps {
            sweeps::write(sweep, points, directory)?;
        }
        if !self.maps.is_empty() {
            maps::write(&self.maps, directory)?;
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

/// Whether a row is of this project's method at the rate that counts, or of something that has no rate and is no solver that stands beside ours for comparison.
#[must_use]
pub fn is_own(row: &Row) -> bool {
    let compared = row.method == "projected Gauss-Seidel";
    (row.rate.is_none() && !compared)
        || (row.method == Method::Ours.name() && row.rate == Some(OWN_RATE))
}
