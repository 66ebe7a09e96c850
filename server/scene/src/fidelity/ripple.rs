//! Ripple: what comes and goes with the updates, in the band that fingers feel best.
//!
//! | symbol | unit | meaning                                         |
//! |--------|------|-------------------------------------------------|
//! | f      | Hz   | updates of the constraint set per second        |
//! | A      | N    | what a new set changes of the force             |
//! | tau    | s    | time between two forces, 1 ms                   |
//!
//! Between two sets an error grows evenly, and with the next it is less by A: a sawtooth of the mean square A^2 / 12, sampled m = 1 / (f tau) times a period
//! A^2 (1 - 1 / m^2) / 12. A tone of that mean square has the amplitude A sqrt((1 - (f tau)^2) / 6); 30 mN of one between 30 and 500 Hz are just felt.
//! At 1 kHz every force has its own set, and nothing comes and goes. An error that comes at once, lasts and goes is a pulse: in a window of W = 100 ms one of
//! the height A and the length t has the mean square A^2 t / W. What is slower than the band is no ripple, a mean, a slope and two periods of 10 and 20 Hz:
//! of a pulse that is longer than some 5 ms no more than a third of its height is left, whatever its length, that of the steps at its ends.
//! A window in which the right force itself makes a step that is felt has no ripple.

use super::errors::{JND_CHANGE, JND_MAGNITUDE, TICK};

/// Amplitude that is just felt, N: a hand that holds 0.35 kg.
pub const JND_RIPPLE: f64 = 0.03;
/// Windows that ripple is looked for in, s.
pub const WINDOW: f64 = 0.1;
/// What is left of the height of a long pulse without what is slower than the band: see the test.
const OF_LONG_PULSE: f64 = 0.33;
/// How much of the time one event spoils, s: windows overlap by half.
pub const SPOILED: f64 = 1.5 * WINDOW;

/// Amplitude of a sawtooth that changes by `change`, N, with each set, N.
#[must_use]
pub fn sawtooth(change: f64, rate: f64) -> f64 {
    let sampled = 1.0 - (rate * TICK).powi(2);
    change * (sampled.max(0.0) / 6.0).sqrt()
}

/// Amplitude of a pulse of the height `error`, N, that lasts `time`, s, in a window, N.
#[must_use]
pub fn pulse(error: f64, time: f64) -> f64 {
    error * (2.0 * time / WINDOW).sqrt().min(OF_LONG_PULSE)
}

/// An amplitude in just-noticeable differences.
#[must_use]
pub fn ripple_jnd(amplitude: f64) -> f64 {
    amplitude / JND_RIPPLE
}

/// Whether a force that turns by `angle`, rad, in a millisecond is smooth: such a step is not felt.
#[must_use]
pub fn is_smooth(force: f64, angle: f64) -> bool {
    force * angle <= (JND_MAGNITUDE * force).max(JND_CHANGE) // false for NaN
}

#[cfg(test)]
mod tests {
    use super::*;

    fn amplitude(samples: &[f64]) -> f64 {
        let count = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / count;
        let square = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
        (2.0 * square).sqrt()
    }

    #[test]
    fn a_sawtooth_has_the_amplitude_of_its_samples() {
        for (rate, each) in [(100.0, 10), (200.0, 5), (500.0, 2), (1000.0, 1)] {
            let samples: Vec<f64> = (0..1000)
                .map(|i| 0.2 * f64::from(i % each) / f64::from(each))
                .collect();
            assert!((sawtooth(0.2, rate) - amplitude(&samples)).abs() < 1e-9);
        }
    }

    /// The amplitude of a window's samples without their mean, slope, and periods of 10 and 20 Hz.
    fn amplitude_in_band(samples: &[f64]) -> f64 {
        let count = samples.len() as f64;
        let middle = |i: usize| (i as f64 + 0.5) / count - 0.5;
        let wave = |periods: f64, quarter: f64, i: usize| {
            (std::f64::consts::TAU * (periods * middle(i) + quarter)).sin()
        };
        let slow = (0..6).map(|shape| {
            let values = (0..samples.len()).map(|i| match shape {
                0 => 1.0,
                1 => middle(i),
                2 => wave(1.0, 0.0, i),
                3 => wave(1.0, 0.25, i),
                4 => wave(2.0, 0.0, i),
                _ => wave(2.0, 0.25, i),
            });
            nalgebra::DVector::from_iterator(samples.len(), values)
        });
        let columns: Vec<_> = slow.collect();
        let shapes = nalgebra::DMatrix::from_columns(&columns).qr().q();
        let given = nalgebra::DVector::from_column_slice(samples);
        let left = &given - &shapes * (shapes.transpose() * &given);
        (2.0 * left.norm_squared() / count).sqrt()
    }

    #[test]
    fn a_pulse_is_never_felt_more_than_said() {
        for length in [1_usize, 3, 5, 10, 15, 30, 60] {
            let most = (0..100 - length)
                .map(|from| {
                    let pulse = (0..100).map(|i| f64::from((from..from + length).contains(&i)));
                    amplitude_in_band(&pulse.collect::<Vec<_>>())
                })
                .fold(0.0, f64::max);
            let said = pulse(1.0, length as f64 * TICK);
            assert!(
                most <= said && most > 0.7 * said,
                "{length}: {most} of {said}"
            );
        }
    }

    #[test]
    fn a_turn_that_is_felt_as_a_step_is_not_smooth() {
        assert!(is_smooth(2.0, 0.05) && !is_smooth(2.0, 0.1));
    }
}
