//! One axis of a device, a hand and a sampled wall: the state from one sample to the next, exactly.
//!
//! | symbol   | name in code      | unit  | meaning                                                         |
//! |----------|-------------------|-------|-----------------------------------------------------------------|
//! | x, v, f  |                   | m, m/s, N | grip, and what the motor renders                            |
//! | u_k      |                   | N     | `-K x_k - B (x_k - x_(k-1)) / T`, takes effect t_d after the sample |
//! | d, r     | `whole`, `rest`   | –, s  | `t_d = d T + r`, 0 <= r < T                                     |
//! | rho      | `spectral_radius` | –     | largest modulus of an eigenvalue: what a disturbance grows by per sample |
//!
//! The state is `(x, v, f, x_(k-1), u_(k-1), ..., u_(k-d-1))`. Between samples the plant is solved by a matrix exponential: the
//! first r of a period under `u_(k-d-1)`, the rest under `u_(k-d)`. Nothing is approximated but in the last digits. Hand and
//! device are rigidly joined; Coulomb friction and counting are left out.

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::exponential::HeldStep;
use crate::hand::Hand;

/// Squarings of the state matrix: the norm of the 2^48th power tells the spectral radius to rounding, each adding one.
const SQUARINGS: u32 = 48;
/// Widest relative bracket in which a critical stiffness is told.
const BRACKET: f64 = 1e-9;
/// Softest and stiffest wall that is looked at, N/m or N m/rad.
const STIFFNESSES: [f64; 2] = [1e-6, 1e12];
/// Ratio of the stiffnesses at which the first unstable one is looked for.
const SEARCH_RATIO: f64 = 1.1;

/// One axis of the loop, along which the numbers are in kg, N and m, or about which in kg m^2, N m and rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledLoop {
    /// m of the device: kg.
    pub mass: f64,
    /// b of the device: N s/m.
    pub damping: f64,
    /// Mass that the hand adds.
    pub hand_mass: f64,
    /// Damping of the hand.
    pub hand_damping: f64,
    /// Stiffness of the hand.
    pub hand_stiffness: f64,
    /// T: s.
    pub period: f64,
    /// t_d: s, from the sample to the first effect of its force.
    pub delay: f64,
    /// Time constant of the motors: s.
    pub motor_lag: f64,
    /// B of the wall: N s/m.
    pub virtual_damping: f64,
}

impl SampledLoop {
    /// Nothing but a period: to be filled in.
    #[must_use]
    pub fn at_period(period: f64) -> Self {
        Self {
            mass: 0.0,
            damping: 0.0,
            hand_mass: 0.0,
            hand_damping: 0.0,
            hand_stiffness: 0.0,
            period,
            delay: 0.0,
            motor_lag: 0.0,
            virtual_damping: 0.0,
        }
    }

    /// The same with a hand, along an axis.
    #[must_use]
    pub fn held_along(self, hand: &Hand) -> Self {
        Self {
            hand_mass: hand.mass,
            hand_damping: hand.damping,
            hand_stiffness: hand.stiffness,
            ..self
        }
    }

    /// The same with a hand, about an axis.
    #[must_use]
    pub fn held_about(self, hand: &Hand) -> Self {
        Self {
            hand_mass: hand.rotational_inertia,
            hand_damping: hand.rotational_damping,
            hand_stiffness: hand.rotational_stiffness,
            ..self
        }
    }

    /// rho with a wall of `stiffness` (N/m): below 1 every disturbance dies away, above 1 some grow.
    ///
    /// NaN where a number is not finite or the mass is not positive.
    #[must_use]
    pub fn spectral_radius(&self, stiffness: f64) -> f64 {
        let mut power = self.state_matrix(stiffness);
        // rho = lim |A^n|^(1/n), n = 2^k, with the norm taken out at each squaring.
        let mut logarithm = 0.0;
        let mut share = 1.0;
        for _ in 0..SQUARINGS {
            let norm = power.norm();
            if norm == 0.0 {
                return 0.0;
            }
            logarithm += share * norm.ln();
            share *= 0.5;
            power /= norm;
            power = &power * &power;
        }
        (logarithm + share * power.norm().ln()).exp()
    }

    /// The stiffness up to which every softer wall is stable: N/m.
    ///
    /// 0 where even the softest is not, infinite where the stiffest looked at (1e12) is.
    #[must_use]
    pub fn critical_stiffness(&self) -> f64 {
        let stable = |stiffness: f64| self.spectral_radius(stiffness) < 1.0; // false for NaN
        let [softest, stiffest] = STIFFNESSES;
        // The search starts far below the linear rule, at which a loop that is ever stable still is.
        let rule = super::linear_limit(
            self.damping + self.hand_damping,
            self.virtual_damping,
            self.period,
            self.delay + self.motor_lag,
        );
        let mut good = (rule * 1e-3).clamp(softest, stiffest);
        if !stable(good) {
            return 0.0;
        }
        let mut bad = good * SEARCH_RATIO;
        while stable(bad) {
            good = bad;
            bad *= SEARCH_RATIO;
            if bad > stiffest {
                return f64::INFINITY;
            }
        }
        while bad / good > 1.0 + BRACKET {
            let middle = 0.5 * (good + bad);
            if stable(middle) {
                good = middle;
            } else {
                bad = middle;
            }
        }
        good
    }

    /// From the state at one sample to that at the next.
    fn state_matrix(&self, stiffness: f64) -> DMatrix<f64> {
        let whole = (self.delay / self.period).floor();
        let rest = self.delay - whole * self.period;
        let whole = whole as usize;
        let past = whole + usize::from(rest > 0.0);
        let (begin, end) = (self.held(rest), self.held(self.period - rest));
        let advance = |step: &HeldStep<3, 1>| Matrix3::identity() + step.change;

        let size = 4 + past;
        let mut next = DMatrix::zeros(size, size);
        let mut plant = advance(&end) * advance(&begin);
        // Without lag the motor renders what is commanded: the plant's f is nobody's memory.
        if self.motor_lag == 0.0 {
            plant.column_mut(2).fill(0.0);
            plant.row_mut(2).fill(0.0);
        }
        next.view_mut((0, 0), (3, 3)).copy_from(&plant);
        next[(3, 0)] = 1.0; // x_(k-1)

        // u_k as a row of the state.
        let rate = self.virtual_damping / self.period;
        let mut command = DMatrix::zeros(1, size);
        command[(0, 0)] = -(stiffness + rate);
        command[(0, 3)] = rate;
        // What u_(k-n) does within the period.
        let mut effect = |samples_ago: usize, response: Vector3<f64>| {
            if samples_ago == 0 {
                let added = response * &command;
                let mut rows = next.rows_mut(0, 3);
                rows += added;
            } else {
                let mut column = next.view_mut((0, 3 + samples_ago), (3, 1));
                column += response;
            }
        };
        effect(whole, end.response);
        if rest > 0.0 {
            effect(whole + 1, advance(&end) * begin.response);
        }
        for n in 1..=past {
            if n == 1 {
                next.row_mut(4).copy_from(&command.row(0));
            } else {
                next[(3 + n, 2 + n)] = 1.0;
            }
        }
        next
    }

    /// The plant over `duration` seconds with a held command: state x, v, f.
    fn held(&self, duration: f64) -> HeldStep<3, 1> {
        let mass = self.mass + self.hand_mass;
        let damping = self.damping + self.hand_damping;
        let mut rates = Matrix3::zeros();
        rates[(0, 1)] = 1.0;
        rates[(1, 0)] = -self.hand_stiffness / mass;
        rates[(1, 1)] = -damping / mass;
        let mut input = Vector3::zeros();
        if self.motor_lag > 0.0 {
            rates[(1, 2)] = 1.0 / mass;
            rates[(2, 2)] = -1.0 / self.motor_lag;
            input[2] = 1.0 / self.motor_lag;
        } else {
            input[1] = 1.0 / mass;
        }
        HeldStep::new(&rates, &input, duration)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::linear_limit;
    use proptest::prelude::*;

    fn released(damping: f64, virtual_damping: f64, delay: f64) -> SampledLoop {
        SampledLoop {
            mass: 0.2,
            damping,
            delay,
            virtual_damping,
            ..SampledLoop::at_period(1e-3)
        }
    }

    #[test]
    fn without_delay_the_limit_is_that_of_the_characteristic_polynomial() {
        // x, v with a hold: det = e^{-bT/m} (1 + ...); by the Jury criterion the constant term reaches 1 first.
        let (mass, damping, period): (f64, f64, f64) = (0.2, 1.0, 1e-3);
        let decay = (-damping * period / mass).exp();
        // x+ = x + g1 v + g2 u, v+ = decay v + g1/m u, with g1 = m (1 - decay) / b, g2 = (T - g1) / b.
        let g1 = mass * (1.0 - decay) / damping;
        let g2 = (period - g1) / damping;
        // det = decay - K g2 decay + K g1 g1 / m = 1.
        let exact = (1.0 - decay) / (g1 * g1 / mass - g2 * decay);
        let found = released(damping, 0.0, 0.0).critical_stiffness();
        assert!((found / exact - 1.0).abs() < 1e-6, "{found} {exact}");
    }

    #[test]
    fn the_linear_rule_is_right_within_a_twentieth_for_a_light_device() {
        for damping in [0.5, 1.0, 2.0, 5.0] {
            for virtual_damping in [0.0, 2.0, 5.0] {
                for delay in [0.0, 0.5e-3, 1e-3, 2e-3] {
                    let exact = released(damping, virtual_damping, delay).critical_stiffness();
                    let rule = linear_limit(damping, virtual_damping, 1e-3, delay);
                    assert!((exact / rule - 1.0).abs() < 0.05, "{exact} {rule}");
                }
            }
        }
    }

    #[test]
    fn a_lag_costs_about_as_much_as_a_delay() {
        let lagging = SampledLoop {
            motor_lag: 1e-3,
            ..released(1.0, 0.0, 0.0)
        };
        let ratio = lagging.critical_stiffness() / released(1.0, 0.0, 1e-3).critical_stiffness();
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    }

    #[test]
    fn a_wall_that_damps_more_than_the_sampling_bears_is_never_stable() {
        // B beyond about 2 m / T sets an eigenvalue beneath -1 whatever K is.
        assert_eq!(released(1.0, 800.0, 0.0).critical_stiffness(), 0.0);
    }

    #[test]
    fn numbers_that_make_no_device_have_no_stable_stiffness() {
        assert_eq!(SampledLoop::at_period(1e-3).critical_stiffness(), 0.0);
        assert_eq!(released(f64::NAN, 0.0, 0.0).critical_stiffness(), 0.0);
    }

    proptest! {
        #[test]
        fn the_spectral_radius_is_that_of_the_eigenvalues(
            damping in 0.1..5.0_f64, virtual_damping in 0.0..10.0_f64, delay in 0.0..4e-3_f64,
            lag in prop::sample::select(vec![0.0, 0.3e-3, 1e-3]), stiffness in 10.0..20_000.0_f64,
            hand in prop::sample::select(vec![Hand::RELEASED, Hand::LIGHT, Hand::FIRM]),
        ) {
            let axis = SampledLoop { motor_lag: lag, ..released(damping, virtual_damping, delay) }.held_along(&hand);
            let matrix = axis.state_matrix(stiffness);
            let eigenvalues = matrix.complex_eigenvalues();
            let largest = eigenvalues.iter().map(|z| z.norm()).fold(0.0, f64::max);
            let found = axis.spectral_radius(stiffness);
            prop_assert!((found - largest).abs() < 1e-7 * largest, "{} {}", found, largest);
        }
    }
}
