//! How far an answer is from its own limit: what half the clearance and half the step change.

use god_object::Vector6;
use god_object::spatial::{angular, linear};

use super::{Fineness, Followed};
use crate::cpu_time::quantile;

/// The run that is kept, and those whose differences from it are its error.
pub(super) const VARIANTS: [&str; 3] = ["kept", "half the clearance", "half the step"];

pub(super) fn variant(index: usize) -> Fineness {
    let kept = Fineness::default();
    match index {
        1 => Fineness {
            clearance: 0.5 * kept.clearance,
            ..kept
        },
        2 => Fineness {
            step: 0.5 * kept.step,
            samples: 2 * kept.samples,
            ..kept
        },
        _ => kept,
    }
}

/// Differences of force, N, and torque, N m, millisecond by millisecond.
pub(crate) fn apart(one: &[Vector6], other: &[Vector6]) -> [Vec<f64>; 2] {
    let pairs = || one.iter().zip(other);
    [
        pairs().map(|(a, b)| linear(&(a - b)).norm()).collect(),
        pairs().map(|(a, b)| angular(&(a - b)).norm()).collect(),
    ]
}

/// The larger of the 95th percentiles of what the variants change: N, N m.
pub(super) fn errors(runs: &[Followed]) -> [f64; 2] {
    let mut errors = [0.0_f64; 2];
    for run in &runs[1..] {
        let apart = apart(&runs[0].wrenches, &run.wrenches);
        for (error, differences) in errors.iter_mut().zip(apart) {
            *error = error.max(quantile(&differences, 0.95));
        }
    }
    errors
}
