//! A recipe run for one method at one rate, over all start phases, against its pass lines.

use taut_method_tests::checker::PenetrationChecker;

use crate::clock;
use crate::cpu_time::quantile;
use crate::measure::{Measure, Measures};
use crate::method::{Method, Tuning};
use crate::recipe::{Line, Recipe};

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
    /// CPU times of the thread.
    pub times: Times,
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
        let best = match tunings.as_slice() {
            [only] => Some(*only),
            several => several
                .iter()
                .map(|tuning| {
                    let trial = Self::from_phases(recipe, method, rate, *tuning, 1);
                    let missed = trial.lines.iter().filter(|(_, passes)| !passes).count();
                    (missed, trial.worst(Measure::Felt), *tuning)
                })
                .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
                .map(|(_, _, tuning)| tuning),
        };
        Self::tuned(recipe, method, rate, best.unwrap_or(Tuning::Default))
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
                let run = clock::run(
                    started.as_mut(),
                    &recipe.device,
                    recipe.duration,
                    rate,
                    phase,
                );
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

    /// Whether every line is passed.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.lines.iter().all(|(_, passes)| *passes)
    }
}
