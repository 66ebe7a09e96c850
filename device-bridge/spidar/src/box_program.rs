//! A least-squares problem in eight bounded unknowns, by block principal pivoting with a warm start.
//!
//! | symbol | name in code     | meaning                                              |
//! |--------|------------------|------------------------------------------------------|
//! | A      | `rows`           | 6 x 8                                                |
//! | f      | `target`         | 6                                                    |
//! | s      | `regularisation` | small, so that the answer is unique                  |
//! | H      | `gram`           | `A^T A + s I`, positive definite                     |
//! | g      | `gradient`       | `H x - A^T f - s x_0`                                |
//!
//! `min |A x - f|^2 / 2 + s |x - x_0|^2 / 2` subject to `lower <= x <= upper`. A guess says of each unknown whether it
//! is free or held at a bound; the free ones are solved for, and every unknown that disagrees with its guess changes
//! sides at once. With the right guess that is one factorisation. Where exchanging all of them stops making progress,
//! only the last one is exchanged (Murty's rule), which cannot cycle because H is positive definite.
//!
//! Source: Judice and Pires 1994, block principal pivoting for box-constrained strictly monotone problems.

use crate::cholesky::Cholesky;
use crate::{PerString, STRINGS};

/// Most factorisations of one solution. Two or three are usual; the rest bounds the time.
pub(crate) const MAX_FACTORISATIONS: u32 = 60;
/// Exchanges of all offenders without progress before Murty's rule takes over.
const MAX_BLOCK_FAILURES: u32 = 4;
/// An unknown or a gradient may be this much on the wrong side, relative to the largest entry of the right-hand side
/// (plus one newton): some twenty times the rounding of a gradient. Over s it is how far a tension may be off, N.
const SIDE_TOLERANCE: f64 = 2e-14;

/// Where an unknown is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// Between its bounds.
    Free,
    /// At its lower bound.
    Lower,
    /// At its upper bound.
    Upper,
}

/// Bounds of the unknowns; `lower <= upper`. Equal bounds fix an unknown.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub(crate) lower: PerString,
    pub(crate) upper: PerString,
}

/// The matrix of the problem; targets and bounds vary.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxProgram {
    rows: [PerString; 6],
    regularisation: f64,
    gram: [[f64; STRINGS]; STRINGS],
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxAnswer {
    pub(crate) x: PerString,
    pub(crate) sides: [Side; STRINGS],
    /// `A x`.
    pub(crate) image: [f64; 6],
    /// Largest `|x - clamp(x - g)|`: zero at the optimum, by a gradient that shares nothing with the factorisation.
    pub(crate) kkt_residual: f64,
    pub(crate) factorisations: u32,
    /// False if `MAX_FACTORISATIONS` ran out or an input was not finite; `x` is within its bounds all the same.
    pub(crate) solved: bool,
}

#[allow(
    clippy::needless_range_loop,
    reason = "loops over eight lanes of several arrays, as the compiler vectorises them"
)]
impl BoxProgram {
    pub(crate) fn new(rows: &[PerString; 6], regularisation: f64) -> Self {
        let mut gram = [[0.0; STRINGS]; STRINGS];
        for row in rows {
            for i in 0..STRINGS {
                for j in 0..STRINGS {
                    gram[i][j] += row[i] * row[j];
                }
            }
        }
        Self {
            rows: *rows,
            regularisation: 0.0,
            gram,
        }
        .regularised(regularisation)
    }

    /// The same with another s.
    pub(crate) fn regularised(mut self, regularisation: f64) -> Self {
        for (i, row) in self.gram.iter_mut().enumerate() {
            row[i] += regularisation - self.regularisation;
        }
        self.regularisation = regularisation;
        self
    }

    /// A.
    pub(crate) fn rows(&self) -> &[PerString; 6] {
        &self.rows
    }

    /// `A x`.
    pub(crate) fn image(&self, x: &PerString) -> [f64; 6] {
        std::array::from_fn(|k| (0..STRINGS).map(|i| self.rows[k][i] * x[i]).sum())
    }

    /// `normal . a_i`.
    pub(crate) fn along(&self, normal: &[f64; 6], i: usize) -> f64 {
        (0..6).map(|k| normal[k] * self.rows[k][i]).sum()
    }

    /// Solves for one target. `guess` is the sides of a problem near by; any guess gives the same answer.
    pub(crate) fn solve(
        &self,
        target: &[f64; 6],
        reference: &PerString,
        bounds: &Bounds,
        guess: &[Side; STRINGS],
    ) -> BoxAnswer {
        let linear = self.linear(target, reference);
        let largest = linear.iter().fold(1.0, |a: f64, b| a.max(b.abs()));
        let tolerance = SIDE_TOLERANCE * largest;
        let mut sides = *guess;
        let mut fewest = STRINGS + 1;
        let mut failures = 0;
        let mut x = bounds.lower;
        let mut factorisations = 0;
        let mut solved = false;
        while factorisations < MAX_FACTORISATIONS {
            factorisations += 1;
            let Some(found) = self.stationary(&linear, bounds, &sides) else {
                break; // not finite
            };
            x = found;
            let wrong = self.offenders(&x, &linear, bounds, &sides, tolerance);
            let count = wrong.iter().flatten().count();
            if count == 0 {
                solved = true;
                break;
            }
            if count < fewest {
                fewest = count;
                failures = 0;
            } else {
                failures += 1;
            }
            let all = failures <= MAX_BLOCK_FAILURES;
            for i in (0..STRINGS).rev() {
                if let Some(side) = wrong[i] {
                    sides[i] = side;
                    if !all {
                        break;
                    }
                }
            }
        }
        for i in 0..STRINGS {
            // NaN becomes the lower bound.
            let inside = x[i] >= bounds.lower[i];
            x[i] = if inside {
                x[i].min(bounds.upper[i])
            } else {
                bounds.lower[i]
            };
        }
        let image = self.image(&x);
        BoxAnswer {
            x,
            sides,
            image,
            kkt_residual: self.kkt_residual(&x, &image, target, reference, bounds),
            factorisations,
            solved,
        }
    }

    /// `A^T f + s x_0`.
    fn linear(&self, target: &[f64; 6], reference: &PerString) -> PerString {
        let mut linear = reference.map(|x| self.regularisation * x);
        for (row, f) in self.rows.iter().zip(target) {
            for i in 0..STRINGS {
                linear[i] += row[i] * f;
            }
        }
        linear
    }

    /// The unknowns with the held ones at their bounds and no gradient along the free ones.
    #[inline]
    fn stationary(
        &self,
        linear: &PerString,
        bounds: &Bounds,
        sides: &[Side; STRINGS],
    ) -> Option<PerString> {
        let mut matrix = self.gram;
        let mut right = *linear;
        for j in 0..STRINGS {
            let at = match sides[j] {
                Side::Free => continue,
                Side::Lower => bounds.lower[j],
                Side::Upper => bounds.upper[j],
            };
            // The row and column of a held unknown become those of the identity.
            for i in 0..STRINGS {
                right[i] -= self.gram[i][j] * at;
                matrix[i][j] = 0.0;
                matrix[j][i] = 0.0;
            }
            matrix[j][j] = 1.0;
        }
        let held = |side: Side, i: usize, free: f64| match side {
            Side::Free => free,
            Side::Lower => bounds.lower[i],
            Side::Upper => bounds.upper[i],
        };
        for i in 0..STRINGS {
            right[i] = held(sides[i], i, right[i]);
        }
        let x = Cholesky::new(&matrix)?.solve(&right);
        x.iter().all(|x| x.is_finite()).then_some(x)
    }

    /// The side to which each unknown that is on a wrong one belongs.
    #[inline]
    fn offenders(
        &self,
        x: &PerString,
        linear: &PerString,
        bounds: &Bounds,
        sides: &[Side; STRINGS],
        tolerance: f64,
    ) -> [Option<Side>; STRINGS] {
        let mut gradient = linear.map(|c| -c);
        for j in 0..STRINGS {
            for i in 0..STRINGS {
                gradient[i] += self.gram[j][i] * x[j];
            }
        }
        std::array::from_fn(|i| {
            let fixed = bounds.lower[i] == bounds.upper[i];
            match sides[i] {
                Side::Free if fixed || x[i] < bounds.lower[i] - tolerance => Some(Side::Lower),
                Side::Free if x[i] > bounds.upper[i] + tolerance => Some(Side::Upper),
                Side::Lower if !fixed && gradient[i] < -tolerance => Some(Side::Free),
                Side::Upper if !fixed && gradient[i] > tolerance => Some(Side::Free),
                _ => None,
            }
        })
    }

    /// Largest `|x - clamp(x - g)|`, with g from the rows.
    fn kkt_residual(
        &self,
        x: &PerString,
        image: &[f64; 6],
        target: &[f64; 6],
        reference: &PerString,
        bounds: &Bounds,
    ) -> f64 {
        let mut largest = 0.0_f64;
        for i in 0..STRINGS {
            let mut gradient = self.regularisation * (x[i] - reference[i]);
            for k in 0..6 {
                gradient += self.rows[k][i] * (image[k] - target[k]);
            }
            let stepped = (x[i] - gradient).max(bounds.lower[i]).min(bounds.upper[i]);
            let residual = (x[i] - stepped).abs();
            // A NaN gradient is the worst residual, not the best.
            largest = if gradient.is_nan() {
                f64::INFINITY
            } else {
                largest.max(residual)
            };
        }
        largest
    }
}
