//! Cholesky factorisation of small dense matrices of fixed size, without allocation.

/// `A = L L^T` of a symmetric positive definite matrix.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cholesky<const N: usize> {
    /// Lower triangle; the diagonal holds reciprocals.
    factor: [[f64; N]; N],
    /// Smallest pivot over its own diagonal entry: 1 for a diagonal matrix, 0 for a singular one.
    pub(crate) smallest_pivot_ratio: f64,
}

#[allow(
    clippy::needless_range_loop,
    reason = "indices as in the textbook factorisation"
)]
impl<const N: usize> Cholesky<N> {
    /// Factorises; reads the lower triangle. `None` if a pivot is not above zero (NaN included).
    #[inline]
    pub(crate) fn new(matrix: &[[f64; N]; N]) -> Option<Self> {
        let mut factor = *matrix;
        let mut smallest = 1.0_f64;
        for j in 0..N {
            let mut pivot = factor[j][j];
            for k in 0..j {
                pivot -= factor[j][k] * factor[j][k];
            }
            let positive = pivot > 0.0 && pivot.is_finite(); // false for NaN
            if !positive {
                return None;
            }
            smallest = smallest.min(pivot / matrix[j][j]);
            let reciprocal = 1.0 / pivot.sqrt();
            factor[j][j] = reciprocal;
            for i in j + 1..N {
                let mut entry = factor[i][j];
                for k in 0..j {
                    entry -= factor[i][k] * factor[j][k];
                }
                factor[i][j] = entry * reciprocal;
            }
        }
        Some(Self {
            factor,
            smallest_pivot_ratio: smallest,
        })
    }

    /// Solves `L y = b`, so that `|y|^2 = b . A^-1 b`.
    #[inline]
    pub(crate) fn forward(&self, b: &[f64; N]) -> [f64; N] {
        let mut y = *b;
        for i in 0..N {
            for k in 0..i {
                y[i] -= self.factor[i][k] * y[k];
            }
            y[i] *= self.factor[i][i];
        }
        y
    }

    /// Solves `A x = b`.
    #[inline]
    pub(crate) fn solve(&self, b: &[f64; N]) -> [f64; N] {
        let mut x = self.forward(b);
        for i in (0..N).rev() {
            for k in i + 1..N {
                x[i] -= self.factor[k][i] * x[k];
            }
            x[i] *= self.factor[i][i];
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solution_satisfies_its_equations() {
        let a = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
        let b = [1.0, -2.0, 0.3];
        let factor = Cholesky::new(&a).expect("positive definite");
        let x = factor.solve(&b);
        for i in 0..3 {
            let row: f64 = (0..3).map(|k| a[i][k] * x[k]).sum();
            assert!((row - b[i]).abs() < 1e-14);
        }
        let y = factor.forward(&b);
        let energy: f64 = y.iter().map(|y| y * y).sum();
        let work: f64 = (0..3).map(|k| b[k] * x[k]).sum();
        assert!((energy - work).abs() < 1e-14);
    }

    #[test]
    fn singular_and_nan_are_refused() {
        assert!(Cholesky::new(&[[1.0, 1.0], [1.0, 1.0]]).is_none());
        assert!(Cholesky::new(&[[f64::NAN, 0.0], [0.0, 1.0]]).is_none());
    }
}
