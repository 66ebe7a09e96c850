//! The tensions that render no wrench, and the smallest that render one: a factorisation of the 6 x 8 matrix of a pose.
//!
//! | symbol | name in code | meaning                                                            |
//! |--------|--------------|--------------------------------------------------------------------|
//! | A      | `rows`       | 6 x 8, of full rank                                                |
//! | Q R    |              | `A^T`: Q orthogonal as a product of reflections, R upper triangular |
//! | N      | `basis`      | the last two columns of Q: `A N = 0`, `N^T N = 1`                  |
//!
//! Every `t` with `A t = f` is `A^+ f + N y` with two unknowns y, so that what eight strings can do with one wrench is a polygon.
//!
//! Source: Golub and Van Loan, Matrix Computations, Householder's factorisation.

use crate::{PerString, STRINGS};

const COMPONENTS: usize = 6;
/// A diagonal entry of R below this share of the largest: a direction of wrench that the strings hardly render.
const SINGULAR: f64 = 1e-6;

#[derive(Clone, Copy, Debug)]
pub(crate) struct NullSpace {
    /// N, by columns.
    pub(crate) basis: [PerString; 2],
    reflections: [Reflection; COMPONENTS],
    /// Row k, column j >= k of R at `[j][k]`; the diagonal holds reciprocals.
    triangle: [[f64; COMPONENTS]; COMPONENTS],
}

/// `1 - beta v v^T`.
#[derive(Clone, Copy, Debug)]
struct Reflection {
    v: PerString,
    beta: f64,
}

impl Reflection {
    #[inline]
    fn apply(&self, x: &mut PerString) {
        let along: f64 = self.v.iter().zip(x.iter()).map(|(v, x)| v * x).sum();
        let change = self.beta * along;
        for (x, v) in x.iter_mut().zip(&self.v) {
            *x -= change * v;
        }
    }
}

impl NullSpace {
    /// `None` where the rows are not of full rank, or not finite.
    pub(crate) fn of(rows: &[PerString; COMPONENTS]) -> Option<Self> {
        let mut columns = *rows;
        let none = Reflection {
            v: [0.0; STRINGS],
            beta: 0.0,
        };
        let mut reflections = [none; COMPONENTS];
        let mut triangle = [[0.0; COMPONENTS]; COMPONENTS];
        let (mut smallest, mut largest) = (f64::INFINITY, 0.0_f64);
        for k in 0..COMPONENTS {
            let mut v = columns[k];
            v[..k].fill(0.0);
            let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let positive = norm > 0.0 && norm.is_finite(); // false for NaN
            if !positive {
                return None;
            }
            smallest = smallest.min(norm);
            largest = largest.max(norm);
            let diagonal = -norm.copysign(v[k]);
            let beta = 1.0 / (norm * (norm + v[k].abs()));
            v[k] -= diagonal;
            let reflection = Reflection { v, beta };
            for column in &mut columns[k + 1..] {
                reflection.apply(column);
            }
            triangle[k][..k].copy_from_slice(&columns[k][..k]);
            triangle[k][k] = 1.0 / diagonal;
            reflections[k] = reflection;
        }
        if smallest < SINGULAR * largest {
            return None;
        }
        let mut space = Self {
            basis: [[0.0; STRINGS]; 2],
            reflections,
            triangle,
        };
        space.basis = std::array::from_fn(|column| {
            let mut unit = [0.0; STRINGS];
            unit[COMPONENTS + column] = 1.0;
            space.unreflected(unit)
        });
        Some(space)
    }

    /// `A^+ f`: the smallest x with `A x = f`.
    pub(crate) fn smallest(&self, f: &[f64; COMPONENTS]) -> PerString {
        let mut x = [0.0; STRINGS];
        for j in 0..COMPONENTS {
            let known: f64 = (0..j).map(|k| self.triangle[j][k] * x[k]).sum();
            x[j] = (f[j] - known) * self.triangle[j][j];
        }
        self.unreflected(x)
    }

    /// `Q x`.
    fn unreflected(&self, mut x: PerString) -> PerString {
        for reflection in self.reflections.iter().rev() {
            reflection.apply(&mut x);
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Geometry, Pose, StringMatrix};
    use nalgebra::Vector3;

    #[test]
    fn the_basis_renders_nothing_and_the_smallest_renders_the_wrench() {
        for name in Geometry::shipped_names() {
            let geometry = Geometry::shipped(name).expect("shipped");
            let pose = Pose::new(
                Vector3::new(0.01, -0.02, 0.015),
                Vector3::new(0.3, -0.2, 0.4),
            );
            let rows = StringMatrix::at(&geometry, &pose).scaled_rows(geometry.arm());
            let Some(space) = NullSpace::of(&rows) else {
                panic!("{name} is of full rank");
            };
            let dot = |a: &PerString, b: &PerString| -> f64 { (0..8).map(|i| a[i] * b[i]).sum() };
            let [first, second] = &space.basis;
            for row in &rows {
                assert!(dot(row, first).abs() < 1e-14 && dot(row, second).abs() < 1e-14);
            }
            assert!((dot(first, first) - 1.0).abs() < 1e-14);
            assert!((dot(second, second) - 1.0).abs() < 1e-14);
            assert!(dot(first, second).abs() < 1e-14);

            let f = [1.0, -2.0, 0.5, 0.3, 3.0, -1.0];
            let x = space.smallest(&f);
            for k in 0..6 {
                assert!((dot(&rows[k], &x) - f[k]).abs() < 1e-12);
            }
            // Nothing that renders nothing can be taken off it.
            assert!(dot(&x, first).abs() < 1e-12 && dot(&x, second).abs() < 1e-12);
        }
    }

    #[test]
    fn rows_that_depend_on_each_other_are_refused() {
        let mut rows = [[0.0; 8]; 6];
        for (k, row) in rows.iter_mut().enumerate() {
            row[k] = 1.0;
            row[7] = 0.5;
        }
        assert!(NullSpace::of(&rows).is_some());
        rows[5] = rows[0];
        assert!(NullSpace::of(&rows).is_none());
        rows[5] = [f64::NAN; 8];
        assert!(NullSpace::of(&rows).is_none());
        assert!(NullSpace::of(&[[0.0; 8]; 6]).is_none());
    }
}
