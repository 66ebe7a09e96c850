//! A recipe run for one method at one rate, over all start phases, against its pass lines.

use crate::clock::RATES;
use crate::measure::Measure;
use crate::measured::{Measured, TRAINING, judged, largest};
use crate::method::{Method, Tuning};
use crate::recipe::{Ideal, Line, Recipe};
use crate::reference::{FORCE_ERROR, TORQUE_ERROR};
use crate::row::{Row, Verdict};
use crate::store::{Store, recipe_key};

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
    /// From each start phase.
    pub measured: Measured,
    /// What passes, and whether it did.
    pub lines: Vec<(Line, bool)>,
    /// What each tuning came to that was tried; empty where there was no choice.
    pub trials: Vec<Trial>,
}

/// A tuning that was tried, from the phases for [`TRAINING`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// With what.
    pub tuning: Tuning,
    /// How many lines and probes it missed.
    pub missed: usize,
    /// Its error in just-noticeable differences; NaN where there is no right answer.
    pub felt: f64,
}

impl Outcome {
    /// Runs a recipe with the best of the method's tunings: that which misses the fewest lines from the phases for [`TRAINING`], and of these the one
    /// that is felt least.
    pub fn of(recipe: &Recipe, method: Method, rate: u32) -> Self {
        let tunings = method.tunings();
        let tried: Vec<Self> = match tunings.as_slice() {
            [_] => Vec::new(),
            several => several
                .iter()
                .map(|tuning| Self::from_phases(recipe, method, rate, *tuning, &TRAINING))
                .collect(),
        };
        let trial = |tried: &Self| Trial {
            tuning: tried.tuning,
            missed: tried.missed(recipe).len(),
            felt: tried.worst(Measure::JndP95),
        };
        let trials: Vec<Trial> = tried.iter().map(trial).collect();
        // NaN, where nothing is felt to be compared, is the same for all.
        let best = trials
            .iter()
            .min_by(|a, b| (a.missed.cmp(&b.missed)).then(a.felt.total_cmp(&b.felt)))
            .map_or(tunings[0], |trial| trial.tuning);
        let mut outcome = Self::tuned(recipe, method, rate, best);
        outcome.trials = trials;
        outcome
    }

    /// Runs a recipe with this tuning.
    pub fn tuned(recipe: &Recipe, method: Method, rate: u32, tuning: Tuning) -> Self {
        Self::from_phases(recipe, method, rate, tuning, &judged(recipe.phases))
    }

    fn from_phases(
        recipe: &Recipe,
        method: Method,
        rate: u32,
        tuning: Tuning,
        phases: &[f64],
    ) -> Self {
        let period = 1.0 / f64::from(rate);
        let start = || method.start(&recipe.scene, period, tuning);
        let measured = Measured::of(recipe, rate, phases, Some((method, tuning)), start);
        Self::judged(recipe, method, rate, tuning, measured)
    }

    /// With the pass lines of the recipe.
    fn judged(
        recipe: &Recipe,
        method: Method,
        rate: u32,
        tuning: Tuning,
        measured: Measured,
    ) -> Self {
        let judged = |line: Line| {
            let passes = measured.worst(line.measure) <= line.limit; // false for NaN
            (line, passes)
        };
        let lines = (recipe.lines)(rate).into_iter().chain(recipe.felt_lines());
        Self {
            recipe: recipe.name,
            case: recipe.case.clone(),
            method,
            rate,
            tuning,
            lines: lines.map(judged).collect(),
            measured,
            trials: Vec::new(),
        }
    }

    /// [`Outcome::of`], or what it came to before, where `store` has it.
    pub fn kept(store: &Store, recipe: &Recipe, method: Method, rate: u32) -> Self {
        let key = format!(
            "{} {:?} {rate} {:?}",
            recipe_key(recipe),
            method,
            method.tunings()
        );
        store.get(
            recipe.name,
            &key,
            |numbers| Self::from_numbers(recipe, method, rate, numbers),
            || {
                let outcome = Self::of(recipe, method, rate);
                let numbers = outcome.to_numbers();
                (outcome, numbers)
            },
        )
    }

    /// Tuning, trials, and what was measured; the rest follows from the recipe.
    fn to_numbers(&self) -> Vec<f64> {
        let tunings = self.method.tunings();
        let index = |tuning| tunings.iter().position(|known| *known == tuning);
        let index = |tuning| index(tuning).map_or(f64::NAN, |index| index as f64);
        let mut numbers = vec![index(self.tuning), self.trials.len() as f64];
        for trial in &self.trials {
            numbers.extend([index(trial.tuning), trial.missed as f64, trial.felt]);
        }
        numbers.extend(self.measured.to_numbers());
        numbers
    }

    fn from_numbers(recipe: &Recipe, method: Method, rate: u32, numbers: &[f64]) -> Option<Self> {
        let tunings = method.tunings();
        let tuning = |index: f64| tunings.get(index as usize).copied();
        let (head, rest) = numbers.split_first_chunk::<2>()?;
        let (trials, measured) = rest.split_at_checked(3 * head[1] as usize)?;
        let trials: Option<Vec<Trial>> = trials
            .chunks(3)
            .map(|trial| {
                Some(Trial {
                    tuning: tuning(trial[0])?,
                    missed: trial[1] as usize,
                    felt: trial[2],
                })
            })
            .collect();
        let measured = Measured::from_numbers(measured)?;
        let mut outcome = Self::judged(recipe, method, rate, tuning(head[0])?, measured);
        outcome.trials = trials?;
        Some(outcome)
    }

    /// The largest value over the phases; NaN where one is.
    pub fn worst(&self, measure: Measure) -> f64 {
        self.measured.worst(measure)
    }

    /// The mean over the phases.
    pub fn mean(&self, measure: Measure) -> f64 {
        let phases = &self.measured.phases;
        let sum: f64 = phases.iter().map(|phase| phase.get(measure)).sum();
        sum / phases.len() as f64
    }

    /// The largest value of a probe over the phases; NaN where one is.
    fn worst_probe(&self, probe: usize) -> f64 {
        largest(self.measured.phases.iter().map(|phase| phase.probes[probe]))
    }

    /// Names of the lines and probes that it missed.
    pub fn missed(&self, recipe: &Recipe) -> Vec<&'static str> {
        let lines = self.lines.iter().filter(|(_, passes)| !passes);
        let probes = recipe.probes.iter().enumerate().filter(|(index, probe)| {
            let passes = self.worst_probe(*index) <= (probe.limit)(self.rate); // false for NaN
            !passes
        });
        let lines = lines.map(|(line, _)| line.measure.key());
        lines.chain(probes.map(|(_, probe)| probe.key)).collect()
    }

    /// Whether every line and every probe is passed.
    #[must_use]
    pub fn passes(&self, recipe: &Recipe) -> bool {
        self.missed(recipe).is_empty()
    }

    /// A row for every measure and probe. What this project's method is known not to keep is open, not failed.
    #[must_use]
    pub fn rows(&self, recipe: &Recipe) -> Vec<Row> {
        let base = Row {
            settings: self.tuning.to_string(),
            rate: Some(self.rate),
            p99_us: self.measured.times.update[1],
            load: Some(self.measured.load),
            ..Row::new(self.recipe, &self.case, self.method.name())
        };
        let limited = |key: &'static str, value: f64, unit: &str, limit: f64| {
            let mut row = base.clone().at_most(key, value, unit, limit);
            let open = recipe.open.iter().find(|open| {
                open.key == key && open.rate == self.rate && self.method == open.method
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

/// Who runs a recipe: each method that has a part in it, at every rate.
pub fn players(recipe: &Recipe, methods: &[Method]) -> Vec<(Method, u32)> {
    let with_part = methods
        .iter()
        .filter(|method| (recipe.out_of_scope)(**method).is_none());
    with_part
        .flat_map(|method| RATES.map(|rate| (*method, rate)))
        .collect()
}

/// Everything about one recipe: its reference answer, what came of its [`players`], in their order, and why other methods have no part.
pub fn recipe_rows(recipe: &Recipe, methods: &[Method], outcomes: &[Outcome]) -> Vec<Row> {
    let mut rows = Vec::new();
    if let Ideal::Reference | Ideal::Oracle = recipe.ideal {
        rows.extend(reference_rows(recipe));
    }
    for method in methods.iter().copied() {
        if let Some(reason) = (recipe.out_of_scope)(method) {
            rows.push(Row::new(recipe.name, &recipe.case, method.name()).out_of_scope(reason));
        }
        let by_it = outcomes.iter().filter(|outcome| outcome.method == method);
        rows.extend(by_it.flat_map(|outcome| outcome.rows(recipe)));
    }
    rows
}

/// What is known of the error of a recipe's reference answer.
#[must_use]
pub fn reference_rows(recipe: &Recipe) -> Vec<Row> {
    let answer = recipe.answer();
    let by = match recipe.ideal {
        Ideal::Oracle => "oracle",
        _ => "reference",
    };
    let row = Row {
        settings: format!("{} steps a millisecond", answer.steps),
        ..Row::new(recipe.name, &recipe.case, by)
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
