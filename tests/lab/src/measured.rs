//! What is measured of runs of one recipe from every start phase, whoever runs it.

use crate::clock;
use crate::cpu_time::quantile;
use crate::measure::{Measure, Measures};
use crate::method::HapticMethod;
use crate::recipe::Recipe;

/// Median and 99th percentile of CPU times, us.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Times {
    /// Of updates.
    pub update: [f64; 2],
    /// Of forces.
    pub force: [f64; 2],
}

/// Measures and times.
#[derive(Clone, Debug)]
pub struct Measured {
    /// One for each start phase.
    pub phases: Vec<Measures>,
    /// CPU times of the thread.
    pub times: Times,
}

impl Measured {
    /// Runs a recipe at a rate, Hz, from `count` phases, each with a method that `start` gives.
    pub fn of(
        recipe: &Recipe,
        rate: u32,
        count: u32,
        start: impl Fn() -> Box<dyn HapticMethod>,
    ) -> Self {
        let (mut updates, mut forces) = (Vec::new(), Vec::new());
        let phases = (0..count)
            .map(|k| {
                let phase = (f64::from(k) + 0.5) / f64::from(count);
                let run = clock::run(start().as_mut(), recipe, rate, phase);
                updates.extend(run.update_us);
                forces.extend(run.force_us);
                Measures::of(recipe, &run.ticks)
            })
            .collect();
        Self {
            phases,
            times: Times {
                update: [0.5, 0.99].map(|share| quantile(&updates, share)),
                force: [0.5, 0.99].map(|share| quantile(&forces, share)),
            },
        }
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

    /// Times, number of probes, then measures and probes phase by phase.
    pub(crate) fn to_numbers(phases: &[Measures], times: &Times) -> Vec<f64> {
        let mut numbers = [times.update, times.force].concat();
        numbers.push(phases.first().map_or(0, |phase| phase.probes.len()) as f64);
        for phase in phases {
            numbers.extend(phase.values().iter().chain(&phase.probes));
        }
        numbers
    }

    /// `None` where these are no such numbers.
    pub(crate) fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let ([u50, u99, f50, f99, probes], rest) = numbers.split_first_chunk::<5>()?;
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
            times: Times {
                update: [*u50, *u99],
                force: [*f50, *f99],
            },
        })
    }
}
