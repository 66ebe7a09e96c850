//! How optimal an answer is, measured on the way out: the largest Karush-Kuhn-Tucker residual.
//!
//! The same four residuals as those of `kkt_residual`, without a second pass over the rows: the last scan of a solver is the
//! measurement of primal feasibility. It is made at the acceleration that is answered, on rows in the coordinates that they were given in.
//! A solver can neither make a scan nor a certificate itself, so that its mistakes cannot hide.

use super::least_distance::{LeastDistance, Scan};
use super::metric::scaled_norm;
use super::projection::MAX_ACTIVE;
use super::working_set::WorkingSet;
use crate::spatial::Vector6;
use arrayvec::ArrayVec;

/// Rows that carry force, with their multipliers for unit rows.
pub(crate) type ActiveRows = ArrayVec<(u32, f64), MAX_ACTIVE>;

/// A problem larger than this, in the unit of the metric, is not measured: its products may overflow.
const LARGEST_SCALE: f64 = 1e250;

/// An acceleration and the residual that it was found to have.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Certificate {
    acceleration: Vector6,
    residual: f64,
}

impl Certificate {
    /// Measures what `scan` found together with the forces `active`.
    #[inline]
    pub(crate) fn new(problem: &LeastDistance, scan: &Scan, active: &[(u32, f64)]) -> Certificate {
        let acceleration = *scan.acceleration();
        let scale = problem.scale().max(problem.metric().norm(&acceleration));
        let mut worst = scan.violation();
        let mut unexplained = problem
            .metric()
            .whiten(&(acceleration - problem.unconstrained()));
        let mut sound = scale < LARGEST_SCALE; // false for NaN
        for (row, multiplier) in active {
            let slack = -problem.violation_at(*row as usize, &acceleration);
            unexplained -= problem.normal(*row as usize) * *multiplier;
            sound &= *multiplier >= 0.0; // false for NaN
            worst = worst.max(slack.abs().min(*multiplier));
        }
        // In the unit of the force: between walls that nearly face each other multipliers are far larger, and hide nothing.
        let stationarity = scaled_norm(&unexplained);
        sound &= stationarity >= 0.0 || scale == 0.0; // false for NaN
        let worst = worst.max(stationarity).max(0.0);
        let residual = if !sound {
            f64::INFINITY
        } else if worst == 0.0 {
            0.0
        } else {
            worst / scale
        };
        Certificate {
            acceleration,
            residual,
        }
    }

    /// The constrained acceleration.
    #[inline]
    pub(crate) fn acceleration(&self) -> &Vector6 {
        &self.acceleration
    }

    /// The largest residual, relative to the problem's scale; infinite where it could not be measured.
    #[inline]
    pub(crate) fn residual(&self) -> f64 {
        self.residual
    }
}

/// The rows of a working set with their multipliers.
#[inline]
pub(crate) fn active_rows(set: &WorkingSet) -> ActiveRows {
    set.rows()
        .iter()
        .copied()
        .zip(set.multipliers().iter().copied())
        .collect()
}
