//! Stability and passivity of a sampled wall in closed form.
//!
//! | symbol | name in code        | unit    | meaning                                        |
//! |--------|---------------------|---------|------------------------------------------------|
//! | K      | `stiffness`         | N/m     | of the wall                                    |
//! | B      | `virtual_damping`   | N s/m   | of the wall, by a backward difference          |
//! | b      | `damping`           | N s/m   | of the device                                  |
//! | f_c    | `coulomb`           | N       | Coulomb friction of the device                 |
//! | T      | `period`            | s       | of the samples                                 |
//! | t_d    | `delay`             | s       | of the force                                   |
//! | Delta  | `resolution`        | m       | of the encoder                                 |
//!
//! The same about an axis, with N m for N and rad for m.
//! Sources: Colgate & Schenkel 1997; Gil et al. 2004, Hulin et al. 2006; Abbott & Okamura 2005.

use std::f64::consts::PI;

/// Frequencies at which [`passive_damping`] is looked for, up to half the sample rate.
const FREQUENCIES: u32 = 4000;

/// `K < (b + B) / (T/2 + t_d)`: stability of the linear loop, for short delays and low damping.
///
/// Source: Gil et al. 2004; Hulin et al. 2006 with delay. [`SampledLoop`](super::SampledLoop) is exact.
#[must_use]
pub fn linear_limit(damping: f64, virtual_damping: f64, period: f64, delay: f64) -> f64 {
    (damping + virtual_damping) / (0.5 * period + delay)
}

/// `b > K T/2 + |B|`, solved for K: passivity of a sampled wall without delay; 0 where the wall's own damping is too much.
///
/// Source: Colgate & Schenkel 1997.
#[must_use]
pub fn passive_limit(damping: f64, virtual_damping: f64, period: f64) -> f64 {
    (2.0 * (damping - virtual_damping.abs()) / period).max(0.0)
}

/// `K <= min(2 b / T, 2 f_c / Delta)`: passivity with an encoder that counts and Coulomb friction; without delay or damping of
/// the wall.
///
/// Source: Abbott & Okamura 2005.
#[must_use]
pub fn passive_limit_quantised(damping: f64, coulomb: f64, period: f64, resolution: f64) -> f64 {
    passive_limit(damping, 0.0, period).min(resolution_limit(coulomb, resolution))
}

/// `2 f_c / Delta` of it.
pub(super) fn resolution_limit(coulomb: f64, resolution: f64) -> f64 {
    if resolution > 0.0 {
        2.0 * coulomb / resolution
    } else {
        f64::INFINITY
    }
}

/// Damping that a device must exceed for the sampled wall `H(z) = K + B (z - 1) / (T z)`, a delay late, to be passive:
/// the largest over w of `T / (2 (1 - cos w T)) Re{(1 - e^{-j w T}) H e^{-j w t_d}}`.
///
/// Exact for delays of whole samples. Source: Colgate & Schenkel 1997, with the delay in H.
#[must_use]
pub fn passive_damping(stiffness: f64, virtual_damping: f64, period: f64, delay: f64) -> f64 {
    // The limit at w = 0: what a slow motion loses.
    let mut largest = stiffness * (0.5 * period + delay) - virtual_damping;
    let rate = virtual_damping / period;
    for k in 1..=FREQUENCIES {
        let angle = PI * f64::from(k) / f64::from(FREQUENCIES);
        let late = angle * delay / period;
        // H = (K + B/T) - B/T e^{-j w T}; times (1 - e^{-j w T}); each power n of e^{-j w T} has the real part cos(n w T + w t_d).
        let real = (stiffness + rate) * late.cos()
            - (stiffness + 2.0 * rate) * (angle + late).cos()
            + rate * (2.0 * angle + late).cos();
        largest = largest.max(0.5 * period * real / (1.0 - angle.cos()));
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 1e-3;

    #[test]
    fn the_general_condition_is_the_closed_form_without_delay() {
        for (stiffness, virtual_damping) in [(1000.0, 0.0), (1000.0, 3.0), (0.0, 2.0), (5e4, 1.0)] {
            let closed = stiffness * 0.5 * PERIOD + virtual_damping;
            let general = passive_damping(stiffness, virtual_damping, PERIOD, 0.0);
            assert!((general / closed - 1.0).abs() < 1e-9, "{general} {closed}");
            assert!((passive_limit(closed, virtual_damping, PERIOD) - stiffness).abs() < 1e-9);
        }
    }

    #[test]
    fn a_delayed_spring_needs_the_damping_of_a_slow_motion() {
        for samples in [1.0, 2.0, 7.0] {
            let delay = samples * PERIOD;
            let needed = passive_damping(1000.0, 0.0, PERIOD, delay);
            assert!((needed - 1000.0 * (0.5 * PERIOD + delay)).abs() < 1e-9);
        }
    }

    #[test]
    fn damping_of_the_wall_that_is_a_sample_late_leaks_at_once() {
        // One sample late, a pure damper is a leak of 3 B at half the sample rate less nothing: by hand at w = pi / T,
        // (T/4) Re{2 (2 B / T) e^{-j pi}} = -B, at w = 0 -B; between them it is positive.
        let needed = passive_damping(0.0, 1.0, PERIOD, PERIOD);
        assert!(needed > 0.9 && needed < 1.2, "{needed}");
    }

    #[test]
    fn the_smaller_of_hold_and_encoder_decides() {
        assert_eq!(
            passive_limit_quantised(1.0, 0.02, PERIOD, 29.24e-6),
            2.0 * 0.02 / 29.24e-6
        );
        assert_eq!(passive_limit_quantised(1.0, 1.0, PERIOD, 29.24e-6), 2000.0);
        assert_eq!(passive_limit_quantised(1.0, 0.0, PERIOD, 0.0), 2000.0);
        assert_eq!(passive_limit_quantised(1.0, 0.0, PERIOD, 1e-5), 0.0);
    }
}
