//! Six-vectors padded to eight lanes, and products of at most six of them: plain loops that become vector instructions.
//!
//! The order of every sum is fixed here, so that the same numbers come out however the code is compiled.

use super::projection::MAX_ACTIVE;
use crate::spatial::Vector6;

/// Six components and two zeros: two AVX registers.
pub(crate) type Lanes8 = [f64; 8];

/// `v` and two zeros.
#[inline]
pub(crate) fn widened(v: &Vector6) -> Lanes8 {
    [v[0], v[1], v[2], v[3], v[4], v[5], 0.0, 0.0]
}

/// The first six lanes.
#[inline]
pub(crate) fn vector6(lanes: &Lanes8) -> Vector6 {
    Vector6::new(lanes[0], lanes[1], lanes[2], lanes[3], lanes[4], lanes[5])
}

/// `a . b`.
#[inline]
pub(crate) fn dot(a: &Lanes8, b: &Lanes8) -> f64 {
    let mut sums = [0.0; 4];
    for k in 0..4 {
        sums[k] = a[k] * b[k] + a[k + 4] * b[k + 4];
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

/// `a + s b`.
#[inline]
pub(crate) fn add_scaled(a: &Lanes8, b: &Lanes8, s: f64) -> Lanes8 {
    let mut sum = *a;
    for k in 0..8 {
        sum[k] += b[k] * s;
    }
    sum
}

/// The products of every column with `x`: `C^T x`.
#[inline]
pub(crate) fn products(columns: &[Lanes8; MAX_ACTIVE], x: &Lanes8) -> Lanes8 {
    let mut all = [0.0; 8];
    for (product, column) in all.iter_mut().zip(columns) {
        *product = dot(column, x);
    }
    all
}

/// The combination of the columns with the weights `x`: `C x`.
#[inline]
pub(crate) fn combine(columns: &[Lanes8; MAX_ACTIVE], x: &Lanes8) -> Lanes8 {
    // Two chains, for half the latency of one.
    let (mut even, mut odd) = ([0.0; 8], [0.0; 8]);
    for k in 0..8 {
        even[k] = columns[0][k] * x[0] + columns[2][k] * x[2] + columns[4][k] * x[4];
        odd[k] = columns[1][k] * x[1] + columns[3][k] * x[3] + columns[5][k] * x[5];
    }
    add_scaled(&even, &odd, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_and_combinations_are_those_of_a_matrix() {
        let columns: [Lanes8; MAX_ACTIVE] = std::array::from_fn(|c| {
            std::array::from_fn(|r| {
                if r < 6 {
                    (r * r + 3 * c) as f64 - 7.0
                } else {
                    0.0
                }
            })
        });
        let x: Lanes8 = [1.0, -2.0, 3.0, 5.0, -7.0, 11.0, 0.0, 0.0];
        let matrix = nalgebra::Matrix6::from_fn(|r, c| columns[c][r]);
        assert_eq!(vector6(&combine(&columns, &x)), matrix * vector6(&x));
        assert_eq!(
            vector6(&products(&columns, &x)),
            matrix.transpose() * vector6(&x)
        );
        assert_eq!(widened(&vector6(&x)), x);
        assert_eq!(dot(&x, &x), 209.0);
    }
}
