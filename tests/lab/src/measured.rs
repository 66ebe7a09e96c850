//! What is measured of runs of one recipe from every start phase, whoever runs it.

use crate::clock::{self, Charge, TICK};
use crate::costs::{self, Cost};
use crate::cpu_time::quantile;
use crate::measure::{Measure, Measures};
use crate::method::{HapticMethod, Method, Tuning};
use crate::recipe::Recipe;

/// Start phases that tunings are chosen from, in periods. None of them is [`judged`]: 3 (2 k + 1) is odd, 2 n and 4 n
/// are even.
pub const TRAINING: [f64; 2] = [1.0 / 3.0, 2.0 / 3.0];

/// The `count` start phases that a recipe is judged from: the middles of as many parts of a period, (2 k + 1) / (2 n).
pub fn judged(count: u32) -> Vec<f64> {
    let phases = (0..count).map(|k| (f64::from(k) + 0.5) / f64::from(count));
    phases.collect()
}

/// Median and 99th percentile of CPU times, us.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Times {
    /// Of updates.
    pub update: [f64; 2],
    /// Of forces.
    pub force: [f64; 2],
}

/// What a method takes on the virtual clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Updates a second that it held, Hz.
    pub held: f64,
    /// Share of one core that its updates and forces take.
    pub core: f64,
}

/// Measures and times.
#[derive(Clone, Debug)]
pub struct Measured {
    /// One for each start phase.
    pub phases: Vec<Measures>,
    /// CPU times of the thread.
    pub times: Times,
    /// On the virtual clock; NaN where no costs are known.
    pub load: Load,
}

impl Measured {
    /// Runs a recipe at a rate, Hz, from start phases, each with a method that `start` gives. `payer` is whose costs are charged; without
    /// one, or where its costs are not known, every update takes its whole period.
    pub fn of(
        recipe: &Recipe,
        rate: u32,
        phases: &[f64],
        payer: Option<(Method, Tuning)>,
        start: impl Fn() -> Box<dyn HapticMethod>,
    ) -> Self {
        let (mut updates, mut forces) = (Vec::new(), Vec::new());
        let cost = payer.and_then(|(by, with)| costs::of(recipe, by, with, rate));
        let charge = |phase: f64| match (payer, cost) {
            (Some((by, with)), Some(cost)) => {
                Charge::Drawn(cost, costs::seed(recipe, by, with, rate, phase))
            }
            _ => Charge::WholePeriod,
        };
        let (mut charged, mut spanned) = (0.0, 0.0);
        let phases = phases
            .iter()
            .map(|phase| {
                let charge = &mut charge(*phase);
                let run = clock::run(start().as_mut(), recipe, rate, *phase, charge);
                charged += run.charged;
                spanned += run.spanned;
                updates.extend(run.update_us);
                forces.extend(run.force_us);
                Measures::through_port(recipe, &run.ticks)
            })
            .collect();
        Self {
            load: load(updates.len(), charged, spanned, cost),
            phases,
            times: Times {
                update: [0.5, 0.99].map(|share| quantile(&updates, share)),
                force: [0.5, 0.99].map(|share| quantile(&forces, share)),
            },
        }
    }

    /// The largest value over the phases; NaN where one is.
    pub fn worst(&self, measure: Measure) -> f64 {
        largest(self.phases.iter().map(|phase| phase.get(measure)))
    }

    /// Times, number of probes, then measures and probes phase by phase.
    pub(crate) fn to_numbers(&self) -> Vec<f64> {
        let (times, load) = (self.times, self.load);
        let mut numbers = [times.update, times.force, [load.held, load.core]].concat();
        let probes = self.phases.first().map_or(0, |phase| phase.probes.len());
        numbers.push(probes as f64);
        for phase in &self.phases {
            numbers.extend(phase.values().iter().chain(&phase.probes));
        }
        numbers
    }

    /// `None` where these are no such numbers.
    pub(crate) fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let ([u50, u99, f50, f99, held, core, probes], rest) = numbers.split_first_chunk::<7>()?;
        let measures = Measure::ALL.len();
        let width = measures + *probes as usize;
        let phases: Option<Vec<Measures>> = rest
            .chunks(width)
            .map(|phase| {
                let (values, probes) = phase.split_at_checked(measures)?;
                Measures::kept(values, probes)
            })
            .collect();
        let whole = !rest.is_empty() && rest.len().is_multiple_of(width);
        Some(Self {
            phases: phases.filter(|_| whole)?,
            load: Load {
                held: *held,
                core: *core,
            },
            times: Times {
                update: [*u50, *u99],
                force: [*f50, *f99],
            },
        })
    }
}

/// The largest of the values; NaN where one is.
pub(crate) fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(
        f64::NEG_INFINITY,
        |a, b| if a.is_nan() || a > b { a } else { b },
    )
}

/// Of so many updates, which took `charged` of `spanned` s on the virtual clock.
fn load(updates: usize, charged: f64, spanned: f64, cost: Option<Cost>) -> Load {
    let forces = cost.map_or(f64::NAN, |cost| 1e-6 * cost.force / TICK);
    Load {
        held: updates as f64 / spanned,
        core: charged / spanned + forces,
    }
}
