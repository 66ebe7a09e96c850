//! The exact solution of a linear system over a time in which its input is held.
//!
//! | symbol  | name in code | meaning                                              |
//! |---------|--------------|------------------------------------------------------|
//! | A, B    | `a`, `b`     | `z' = A z + B u`                                     |
//! | h       | `duration`   | s; u is constant meanwhile (zero-order hold)         |
//! | E       | `change`     | `exp(A h) - 1`: what the state changes by itself     |
//! | Gamma   | `response`   | integral of `exp(A s) B` over s from 0 to h          |
//!
//! With `phi = sum (A h)^k / (k + 1)!`, `E = A h phi` and `Gamma = h phi B`: a Taylor series over `h / 2^s`, short enough to converge at once,
//! then doubled s times: `E(2h) = 2 E + E^2` and `Gamma(2h) = 2 Gamma + E Gamma`. E instead of `exp(A h)` keeps the digits of short steps, in
//! which little changes.
//! Source: scaling and squaring, as in Higham, "Functions of Matrices", 2008, Section 10.3, here with the identity taken out; the series with few
//! products of matrices as in Section 4.2 (Paterson, Stockmeyer).

use nalgebra::SMatrix;

/// The series runs over a time in which the norm of `A h` is at most this.
const SERIES_NORM: f64 = 0.5;
/// Terms of the series, four by four: the next one, `0.5^16 / 17!`, is 4e-20, beneath rounding.
const SERIES_TERMS: usize = 16;
/// Most doublings: 2^60 series lengths, more than any time that a plant is asked for.
const MAX_DOUBLINGS: u32 = 60;

/// What a linear system does over a time with a held input: `z + change * z + response * u`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldStep<const N: usize, const M: usize> {
    /// `exp(A h) - 1`.
    pub(crate) change: SMatrix<f64, N, N>,
    /// Integral of `exp(A s) B`.
    pub(crate) response: SMatrix<f64, N, M>,
}

impl<const N: usize, const M: usize> HeldStep<N, M> {
    /// The step of `z' = A z + B u` over `duration` seconds, accurate to rounding. No allocation.
    pub(crate) fn new(a: &SMatrix<f64, N, N>, b: &SMatrix<f64, N, M>, duration: f64) -> Self {
        debug_assert!(duration >= 0.0);
        // Row sums bound every eigenvalue.
        let norm = (0..N)
            .map(|row| a.row(row).iter().map(|x| x.abs()).sum::<f64>())
            .fold(0.0, f64::max)
            * duration;
        let mut doublings = 0;
        let mut scale = 1.0;
        while norm * scale > SERIES_NORM && doublings < MAX_DOUBLINGS {
            scale *= 0.5;
            doublings += 1;
        }

        let short = duration * scale;
        let ah = a * short;
        // The powers 0 to 3 in groups, each times (A h)^4 of the one before, from the last group on.
        let squared = ah * ah;
        let fourth = squared * squared;
        let powers = [SMatrix::identity(), ah, squared, squared * ah];
        let mut phi = SMatrix::<f64, N, N>::zeros();
        for first in (0..SERIES_TERMS).step_by(powers.len()).rev() {
            if first + powers.len() < SERIES_TERMS {
                phi *= fourth;
            }
            for (k, power) in powers.iter().enumerate() {
                phi += power * factorial(first + k + 1).recip();
            }
        }
        let mut change = ah * phi;
        let mut response = phi * b * short;
        for _ in 0..doublings {
            response = response * 2.0 + change * response;
            change = change * 2.0 + change * change;
        }
        Self { change, response }
    }
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|k| k as f64).product()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix1, Matrix2, Vector2};

    #[test]
    fn decay_and_its_integral_are_exact_over_short_and_long_times() {
        for duration in [1e-9, 1e-3, 0.7, 40.0_f64] {
            let step = HeldStep::new(&Matrix1::new(-3.0), &Matrix1::new(2.0), duration);
            let exact = (-3.0 * duration).exp_m1();
            assert!((step.change[0] - exact).abs() <= 1e-13 * exact.abs());
            let exact = -2.0 / 3.0 * exact;
            assert!((step.response[0] - exact).abs() <= 1e-13 * exact.abs());
        }
    }

    #[test]
    fn an_undamped_oscillator_keeps_its_energy() {
        let omega: f64 = 120.0;
        let a = Matrix2::new(0.0, 1.0, -omega * omega, 0.0);
        let step = HeldStep::new(&a, &Vector2::zeros(), 1e-3);
        let mut state = Vector2::new(1.0, 0.0);
        for _ in 0..10_000 {
            state += step.change * state;
        }
        let energy = state.x * state.x + (state.y / omega).powi(2);
        assert!((energy - 1.0).abs() < 1e-9, "{energy}");
        // After 10 s: cos(1200).
        assert!((state.x - (omega * 10.0).cos()).abs() < 1e-9);
    }

    #[test]
    fn two_steps_are_one_of_both_times() {
        let a = Matrix2::new(0.0, 1.0, -900.0, -12.0);
        let b = Vector2::new(0.0, 5.0);
        let [first, second, both] = [0.4e-3, 0.6e-3, 1e-3].map(|h| HeldStep::new(&a, &b, h));
        let start = Vector2::new(0.02, -0.3);
        let step = |s: &HeldStep<2, 1>, z: Vector2<f64>| z + s.change * z + s.response * 1.7;
        let split = step(&second, step(&first, start));
        assert!((split - step(&both, start)).norm() < 1e-15);
    }
}
