//! A recipe run for one method at one rate, over all start phases, against its pass lines.

use taut_method_tests::checker::PenetrationChecker;

use crate::clock::{self, RATES};
use crate::cpu_time::quantile;
use crate::measure::{Measure, Measures};
use crate::method::{Method, Tuning};
use crate::recipe::{Ideal, Line, Recipe};
use crate::reference::{FORCE_ERROR, TORQUE_ERROR};
use crate::row::{Row, Verdict};

/// What came of it.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Of the recipe.
    pub recipe: &'static str,
    /// Of the recipe.
    pub case: String,
    /// Who ran it.
    pub method: Method,
    /// Updates a second, Hz.
    pub rate: u32,
    /// With what.
    pub tuning: Tuning,
    /// One for each start phase.
    pub phases: Vec<Measures>,
    /// What passes, and whether it did.
    pub lines: Vec<(Line, bool)>,
    /// What each tuning came to that was tried; empty where there was no choice.
    pub trials: Vec<Trial>,
    /// CPU times of the thread.
    pub times: Times,
}

/// A tuning that was tried, from one start phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// With what.
    pub tuning: Tuning,
    /// How many lines and probes it missed.
    pub missed: usize,
    /// Its error in just-noticeable differences; NaN where there is no right answer.
    pub felt: f64,
}

/// Median and 99th percentile of CPU times, us.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    /// Of updates.
    pub update: [f64; 2],
    /// Of forces.
    pub force: [f64; 2],
}

impl Outcome {
    /// Runs a recipe with the best of the method's tunings: that which is felt least from one start phase, and of these the one that
    /// misses the fewest lines.
    #[must_use]
    pub fn of(recipe: &Recipe, method: Method, rate: u32) -> Self {
        let tunings = method.tunings();
        let trials: Vec<Trial> = match tunings.as_slice() {
            [_] => Vec::new(),
            several => several
                .iter()
                .map(|tuning| {
                    let trial = Self::from_phases(recipe, method, rate, *tuning, 1);
                    Trial {
                        tuning: *tuning,
                        missed: trial.missed(recipe),
                        felt: trial.worst(Measure::Felt),
                    }
                })
                .collect(),
        };
        // NaN, where nothing is felt to be compared, is the same for all.
        let best = trials
            .iter()
            .min_by(|a, b| a.felt.total_cmp(&b.felt).then(a.missed.cmp(&b.missed)))
            .map_or(tunings[0], |trial| trial.tuning);
        let mut outcome = Self::tuned(recipe, method, rate, best);
        outcome.trials = trials;
        outcome
    }

    /// Runs a recipe with this tuning.
    #[must_use]
    pub fn tuned(recipe: &Recipe, method: Method, rate: u32, tuning: Tuning) -> Self {
        Self::from_phases(recipe, method, rate, tuning, recipe.phases)
    }

    fn from_phases(recipe: &Recipe, method: Method, rate: u32, tuning: Tuning, count: u32) -> Self {
        let checker = PenetrationChecker::new(&recipe.scene.world);
        let (mut updates, mut forces) = (Vec::new(), Vec::new());
        let phases: Vec<Measures> = (0..count)
            .map(|k| {
                let phase = (f64::from(k) + 0.5) / f64::from(count);
                let mut started = method.start(&recipe.scene, 1.0 / f64::from(rate), tuning);
                let run = clock::run(started.as_mut(), recipe, rate, phase);
                updates.extend(run.update_us);
                forces.extend(run.force_us);
                Measures::of(recipe, &checker, &run.ticks)
            })
            .collect();
        let mut outcome = Self {
            recipe: recipe.name,
            case: recipe.case.clone(),
            method,
            rate,
            tuning,
            phases,
            lines: Vec::new(),
            trials: Vec::new(),
            times: Times {
                update: [0.5, 0.99].map(|share| quantile(&updates, share)),
                force: [0.5, 0.99].map(|share| quantile(&forces, share)),
            },
        };
        for line in (recipe.lines)(rate) {
            let passes = outcome.worst(line.measure) <= line.limit; // false for NaN
            outcome.lines.push((line, passes));
        }
        outcome
    }

    /// The largest value over the phases; NaN where one is.
    #[must_use]
    pub fn worst(&self, measure: Measure) -> f64 {
        let values = self.phases.iter().map(|phase| phase.get(measure));
        values.fold(
            f64::NEG_INFINITY,
            |a, b| {
                if a.is_nan() || a > b { a } else { b }
            },
        )
    }

    /// The mean over the phases.
    #[must_use]
    pub fn mean(&self, measure: Measure) -> f64 {
        let sum: f64 = self.phases.iter().map(|phase| phase.get(measure)).sum();
        sum / self.phases.len() as f64
    }

    /// The largest value of a probe over the phases; NaN where one is.
    fn worst_probe(&self, probe: usize) -> f64 {
        let values = self.phases.iter().map(|phase| phase.probes[probe]);
        values.fold(
            f64::NEG_INFINITY,
            |a, b| if a.is_nan() || a > b { a } else { b },
        )
    }

    fn missed(&self, recipe: &Recipe) -> usize {
        let probes = recipe.probes.iter().enumerate().filter(|(index, probe)| {
            let passes = self.worst_probe(*index) <= (probe.limit)(self.rate); // false for NaN
            !passes
        });
        self.lines.iter().filter(|(_, passes)| !passes).count() + probes.count()
    }

    /// Whether every line and every probe is passed.
    #[must_use]
    pub fn passes(&self, recipe: &Recipe) -> bool {
        self.missed(recipe) == 0
    }

    /// A row for every measure and probe. What this project's method is known not to keep is open, not failed.
    #[must_use]
    pub fn rows(&self, recipe: &Recipe) -> Vec<Row> {
        let base = Row {
            settings: self.tuning.to_string(),
            rate: Some(self.rate),
            p99_us: self.times.update[1],
            ..Row::new(self.recipe, &self.case, self.method.name())
        };
        let limited = |key: &'static str, value: f64, unit: &str, limit: f64| {
            let mut row = base.clone().at_most(key, value, unit, limit);
            let open = recipe.open.iter().find(|open| {
                open.key == key && open.rate == self.rate && self.method == Method::Ours
            });
            if let (Some(open), Verdict::Fail) = (open, &row.verdict) {
                row.verdict = Verdict::Open(open.reason);
            }
            row
        };
        let mut rows = Vec::new();
        for measure in Measure::ALL {
            let (key, unit, value) = (measure.key(), measure.unit(), self.worst(*measure));
            let line = self.lines.iter().find(|(line, _)| line.measure == *measure);
            match line {
                Some((line, _)) => rows.push(limited(key, value, unit, line.limit)),
                None => rows.push(base.clone().shown(key, value, unit)),
            }
        }
        for (index, probe) in recipe.probes.iter().enumerate() {
            let (value, limit) = (self.worst_probe(index), (probe.limit)(self.rate));
            rows.push(if limit.is_finite() {
                limited(probe.key, value, probe.unit, limit)
            } else {
                base.clone().shown(probe.key, value, probe.unit)
            });
        }
        rows
    }
}

/// Everything about one recipe: its reference answer, and every method at every rate or why not. Calls `done` after each.
pub fn run_recipe(recipe: &Recipe, mut done: impl FnMut(&Outcome)) -> (Vec<Outcome>, Vec<Row>) {
    let (mut outcomes, mut rows) = (Vec::new(), Vec::new());
    if let Ideal::Reference = recipe.ideal {
        rows.extend(reference_rows(recipe));
    }
    for method in Method::ALL {
        if let Some(reason) = (recipe.out_of_scope)(method) {
            rows.push(Row::new(recipe.name, &recipe.case, method.name()).out_of_scope(reason));
            continue;
        }
        for rate in RATES {
            let outcome = Outcome::of(recipe, method, rate);
            rows.extend(outcome.rows(recipe));
            done(&outcome);
            outcomes.push(outcome);
        }
    }
    (outcomes, rows)
}

/// What is known of the error of a recipe's reference answer.
#[must_use]
pub fn reference_rows(recipe: &Recipe) -> Vec<Row> {
    let answer = recipe.answer();
    let row = Row {
        settings: format!("{} steps a millisecond", answer.steps),
        ..Row::new(recipe.name, &recipe.case, "reference")
    };
    vec![
        row.clone().at_most(
            "reference_force_error",
            answer.force_error,
            "N",
            FORCE_ERROR,
        ),
        row.at_most(
            "reference_torque_error",
            answer.torque_error,
            "N m",
            TORQUE_ERROR,
        ),
    ]
}
