//! Velocity from counted lengths: the longest past window that a straight line fits to within one count.
//!
//! The difference of two samples 1 ms apart errs by a count per millisecond, 20 mm/s; a low-pass filter would trade
//! that for lag at every speed. The window here is long where the string moves slowly or evenly and short where it turns.
//! A string at rest has exactly no velocity.
//!
//! Source: Janabi-Sharifi, Hayward, Chen 2000 (first-order adaptive windowing, end fit).

use std::time::Duration;

use crate::{PerString, STRINGS};

/// Samples that are kept: the longest window is 15 ms at 1 kHz.
const WINDOW: usize = 16;

/// Rates of eight lengths. No allocation; at most `8 * 15` comparisons per sample.
#[derive(Clone, Debug)]
pub struct LengthRates {
    /// What a count may hide, m, per string.
    noise: PerString,
    times: [Duration; WINDOW],
    lengths: [PerString; WINDOW],
    newest: usize,
    count: usize,
}

impl LengthRates {
    /// Rates of lengths that are counted in steps of `metres_per_count` (any sign).
    #[must_use]
    pub fn new(metres_per_count: &PerString) -> Self {
        Self {
            noise: metres_per_count.map(f64::abs),
            times: [Duration::ZERO; WINDOW],
            lengths: [[0.0; STRINGS]; WINDOW],
            newest: 0,
            count: 0,
        }
    }

    /// Forgets all samples, as after a fault or a calibration.
    pub fn reset(&mut self) {
        self.count = 0;
    }

    /// Takes a sample and returns the rates, m/s; zero until there are two. A sample that is not later than the last one
    /// starts afresh.
    #[must_use]
    pub fn step(&mut self, time: Duration, lengths: &PerString) -> PerString {
        if self.count > 0 && time <= self.times[self.newest] {
            self.reset();
        }
        self.newest = (self.newest + 1) % WINDOW;
        self.times[self.newest] = time;
        self.lengths[self.newest] = *lengths;
        self.count = (self.count + 1).min(WINDOW);
        std::array::from_fn(|string| self.rate(string))
    }

    fn rate(&self, string: usize) -> f64 {
        let newest = self.lengths[self.newest][string];
        let noise = self.noise[string];
        // Slopes that pass within `noise` of every sample so far.
        let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut rate = 0.0;
        for back in 1..self.count {
            let past = (self.newest + WINDOW - back) % WINDOW;
            let span = (self.times[self.newest] - self.times[past]).as_secs_f64();
            let change = newest - self.lengths[past][string];
            let slope = change / span;
            let fits = slope >= least && slope <= most; // false for NaN
            if back > 1 && !fits {
                break;
            }
            rate = slope;
            least = least.max((change - noise) / span);
            most = most.min((change + noise) / span);
        }
        rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: f64 = 2e-5;

    /// The worst error of the rate of `length` (m, at t seconds), counted, over one second, after the window has filled.
    fn worst_error(length: impl Fn(f64) -> f64, rate: impl Fn(f64) -> f64) -> f64 {
        let mut rates = LengthRates::new(&[COUNT; STRINGS]);
        let mut worst = 0.0_f64;
        for tick in 0..1000_u32 {
            let t = f64::from(tick) * 1e-3;
            let counted = (length(t) / COUNT).floor() * COUNT;
            let found = rates.step(Duration::from_millis(tick.into()), &[counted; STRINGS]);
            if tick > 20 {
                worst = worst.max((found[3] - rate(t)).abs());
            }
        }
        worst
    }

    #[test]
    fn rest_has_no_velocity() {
        assert_eq!(worst_error(|_| 0.1, |_| 0.0), 0.0);
    }

    #[test]
    fn an_even_motion_is_followed_to_a_count_per_window() {
        // A count over the 15 ms of the window; the plain difference errs by a count per millisecond.
        let worst = worst_error(|t| 0.1 + 0.037 * t, |_| 0.037);
        assert!(worst <= COUNT / 15e-3 * 1.01, "{worst}");
    }

    #[test]
    fn a_fast_swing_is_followed_with_little_lag() {
        let omega = std::f64::consts::TAU * 3.0;
        let worst = worst_error(
            |t| 0.1 + 0.02 * (omega * t).sin(),
            |t| 0.02 * omega * (omega * t).cos(),
        );
        // The peak is 377 mm/s. Where the speed changes most (7.1 m/s^2), a window that hides one count is 4.7 ms long, and
        // its middle 2.4 ms old: 17 mm/s, plus a count over the window.
        assert!(worst < 0.025, "{worst}");
    }

    #[test]
    fn time_that_runs_back_starts_afresh() {
        let mut rates = LengthRates::new(&[COUNT; STRINGS]);
        let _ = rates.step(Duration::from_millis(5), &[0.1; STRINGS]);
        assert_eq!(
            rates.step(Duration::from_millis(4), &[0.2; STRINGS])[0],
            0.0
        );
    }
}
