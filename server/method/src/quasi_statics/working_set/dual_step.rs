//! How forces pass between the rows held and a new one, none of them pulling.
//!
//! | symbol  | name in code   | meaning                                                            |
//! |---------|----------------|--------------------------------------------------------------------|
//! | c       | `coefficients` | `n = N c + perpendicular`: the new row's normal seen from those held |
//! | lambda  | `multiplier`   | forces of the rows held                                            |
//! | t       | `step`         | growth of the new row's force: lambda becomes `lambda - t c`       |
//!
//! Source: Goldfarb, Idnani 1983.

use super::{Decomposed, WorkingSet};

/// A coefficient of a dependent row is noise below this, relative to the largest one. Only its sign matters: a row that
/// noise made blocking would hand an arbitrary force to the others.
const COEFFICIENT_TOLERANCE: f64 = 1e-9;

impl WorkingSet {
    /// How far the new row's multiplier may grow before one of the rows held stops pushing, and which one that is.
    #[inline]
    pub(crate) fn longest_dual_step(&self, seen: &Decomposed) -> (f64, Option<usize>) {
        // Noise in the coefficients of a dependent row must not make a row block.
        let threshold = if seen.is_dependent() {
            self.coefficient_noise(seen)
        } else {
            0.0
        };
        let mut step = (f64::INFINITY, None);
        for k in 0..self.len {
            let coefficient = seen.coefficients[k];
            if coefficient > threshold && self.multiplier[k] < step.0 * coefficient {
                step = (self.multiplier[k] / coefficient, Some(k));
            }
        }
        step
    }

    #[inline]
    fn coefficient_noise(&self, seen: &Decomposed) -> f64 {
        let largest = seen.coefficients[..self.len]
            .iter()
            .fold(0.0_f64, |l, c| l.max(c.abs()));
        COEFFICIENT_TOLERANCE * largest
    }

    /// Moves the multipliers of the rows held while that of the new row grows by `step`.
    #[inline]
    pub(crate) fn take_dual_step(&mut self, seen: &Decomposed, step: f64) {
        for k in 0..self.len {
            let moved = self.multiplier[k] - step * seen.coefficients[k];
            self.multiplier[k] = moved.max(0.0);
        }
    }

    /// Gives the force `force` of a dependent row to the rows held, as much of it as leaves none of them pulling.
    /// `None` if they took all; else what they took, and the position of the row that has no force left.
    pub(crate) fn take_over(&mut self, seen: &Decomposed, force: f64) -> Option<(f64, usize)> {
        let noise = self.coefficient_noise(seen);
        let mut taken = (force, None);
        for k in 0..self.len {
            let coefficient = seen.coefficients[k];
            if coefficient < -noise && self.multiplier[k] < -coefficient * taken.0 {
                taken = (self.multiplier[k] / -coefficient, Some(k));
            }
        }
        self.take_dual_step(seen, -taken.0);
        taken.1.map(|position| (taken.0, position))
    }
}
