//! From counters of 16 bits, which wrap and whose bytes may be damaged, to counts that may be believed.
//!
//! The wire has no checksum. What is known instead: a string's length changes no faster than a hand moves, and its speed no faster than a hand
//! is stopped. Readings that break the second are kept until three in a row agree with each other (those of a grip that is slammed do, those that were
//! damaged do not); one that breaks the first is never believed.

use std::time::Duration;

use taut_spidar::STRINGS;

/// Fastest change of a length, m/s: faster than the port lets a hand move.
const FASTEST: f64 = 5.0;
/// Fastest change of that, m/s^2, of one reading alone.
const HARDEST: f64 = 150.0;
/// Time from which on a hand is allowed no more, s: what it may do grows with the square, and so does what damage may.
const LONGEST_STEP: f64 = 2.5e-3;
/// Counts that rounding and jitter of the readings' times may add.
const SLACK: f64 = 2.0;
/// After a silence of this length the boards may have been without power.
const OUTAGE: Duration = Duration::from_millis(100);
/// Counters this near zero after an outage are those of a board that began anew.
const NEAR_ZERO: i16 = 3;
/// Shortest and longest time over which a speed is taken, s.
const STEP: (f64, f64) = (2e-4, 1.0);

/// Counters of eight motors.
#[derive(Clone, Copy, Debug)]
pub struct Counters {
    /// m, above zero.
    metres_per_count: f64,
    /// Believed counts, with their time, once there are any.
    counts: Option<([i32; STRINGS], Duration)>,
    /// Of the counts, counts/s.
    rates: [f64; STRINGS],
    /// The last readings that were not believed, the newest first: they wait for a third that agrees with them.
    waiting: [Option<([i16; STRINGS], Duration)>; 2],
    were_reset: bool,
}

impl Counters {
    /// Of strings with this length per count, m, of either sign.
    #[must_use]
    pub fn new(metres_per_count: f64) -> Self {
        Self {
            metres_per_count: metres_per_count.abs(),
            counts: None,
            rates: [0.0; STRINGS],
            waiting: [None; 2],
            were_reset: false,
        }
    }

    /// Whether the boards began to count anew: what was calibrated is lost.
    #[must_use]
    pub fn were_reset(&self) -> bool {
        self.were_reset
    }

    /// Takes a reading at `now`; the counts, where they are believed.
    pub fn take(&mut self, now: Duration, raw: &[i16; STRINGS]) -> Option<[i32; STRINGS]> {
        if self.were_reset {
            return None;
        }
        let Some((counts, time)) = self.counts else {
            // Nothing else is known of the first.
            let Some(rates) = self.agreed(now, raw) else {
                self.waiting = [Some((*raw, now)), self.waiting[0]];
                return None;
            };
            return Some(self.believe(now, raw.map(i32::from), rates));
        };
        let silence = now.saturating_sub(time);
        let low = counts.map(|count| count as i16); // the counter's own bits
        if silence > OUTAGE
            && raw
                .iter()
                .all(|counter| counter.unsigned_abs() <= NEAR_ZERO as u16)
            && low
                .iter()
                .any(|counter| counter.unsigned_abs() > 2 * NEAR_ZERO as u16)
        {
            self.were_reset = true;
            return None;
        }
        let change = changes(&low, raw);
        let span = seconds(silence);
        let rates = if !self.is_reachable(&change, silence) {
            None
        } else if self.is_smooth(&change, &self.rates, span) {
            Some(change.map(|change| f64::from(change) / span))
        } else {
            self.agreed(now, raw)
        };
        let Some(rates) = rates else {
            self.waiting = [Some((*raw, now)), self.waiting[0]];
            return None;
        };
        let next = std::array::from_fn(|i| counts[i].wrapping_add(change[i]));
        Some(self.believe(now, next, rates))
    }

    /// The rates of a reading that goes on as the two before it, which were not believed, do.
    fn agreed(&self, now: Duration, raw: &[i16; STRINGS]) -> Option<[f64; STRINGS]> {
        let [Some((second, then)), Some((first, before))] = self.waiting else {
            return None;
        };
        let earlier = seconds(then.saturating_sub(before));
        let rates = changes(&first, &second).map(|change| f64::from(change) / earlier);
        let passed = now.saturating_sub(then);
        let change = changes(&second, raw);
        let agrees = self.is_reachable(&changes(&first, &second), then.saturating_sub(before))
            && self.is_reachable(&change, passed)
            && self.is_smooth(&change, &rates, seconds(passed));
        agrees.then(|| change.map(|change| f64::from(change) / seconds(passed)))
    }

    fn believe(
        &mut self,
        now: Duration,
        counts: [i32; STRINGS],
        rates: [f64; STRINGS],
    ) -> [i32; STRINGS] {
        self.counts = Some((counts, now));
        self.rates = rates;
        self.waiting = [None; 2];
        counts
    }

    fn is_reachable(&self, change: &[i32; STRINGS], passed: Duration) -> bool {
        let most = FASTEST / self.metres_per_count * seconds(passed) + SLACK;
        change.iter().all(|change| f64::from(change.abs()) <= most)
    }

    /// As a hand goes on. After a longer time no more is allowed than after a short one, so that little passes by chance.
    fn is_smooth(&self, change: &[i32; STRINGS], rates: &[f64; STRINGS], span: f64) -> bool {
        let extrapolated = span.min(LONGEST_STEP);
        let most = HARDEST / self.metres_per_count * extrapolated * extrapolated + SLACK;
        let off = |i: usize| (f64::from(change[i]) - rates[i] * span).abs();
        (0..STRINGS).all(|i| off(i) <= most)
    }
}

fn seconds(passed: Duration) -> f64 {
    passed.as_secs_f64().clamp(STEP.0, STEP.1)
}

/// From one counter to the next, whichever way is shorter around.
fn changes(from: &[i16; STRINGS], to: &[i16; STRINGS]) -> [i32; STRINGS] {
    std::array::from_fn(|i| i32::from(to[i].wrapping_sub(from[i])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ms;

    fn at(time: u64) -> [i16; STRINGS] {
        // 1 m/s, some 29 counts a millisecond, alternating in direction.
        std::array::from_fn(|i| {
            let way = 29 * time as i64 * if i % 2 == 0 { 1 } else { -1 };
            (way + 30_000) as i16
        })
    }

    fn running() -> Counters {
        let mut counters = Counters::new(-3.485e-5);
        for time in 0..100 {
            let believed = counters.take(ms(time), &at(time));
            assert_eq!(believed.is_some(), time > 1, "{time}");
        }
        counters
    }

    #[test]
    fn counters_wrap_and_counts_do_not() {
        let mut counters = running();
        let mut last = [0; STRINGS];
        for time in 100..3000 {
            last = counters.take(ms(time), &at(time)).expect("a hand's motion");
        }
        assert_eq!(last[0], 30_000 + 29 * 2999);
        assert_eq!(last[1], 30_000 - 29 * 2999);
    }

    #[test]
    fn a_damaged_reading_is_not_believed_and_a_slammed_grip_is_by_the_third() {
        for bit in 4..16 {
            let mut counters = running();
            let mut raw = at(100);
            raw[3] ^= 1 << bit;
            assert_eq!(counters.take(ms(100), &raw), None, "bit {bit}");
            assert!(counters.take(ms(101), &at(101)).is_some());
        }
        let mut counters = running();
        let stopped = at(99);
        assert_eq!(counters.take(ms(100), &stopped), None);
        assert_eq!(counters.take(ms(101), &stopped), None);
        assert!(counters.take(ms(102), &stopped).is_some());
        // Two damaged ones agree in nothing but that they are wrong.
        let mut counters = running();
        let (mut one, mut other) = (at(100), at(101));
        one[3] ^= 128;
        other[5] ^= 128;
        assert_eq!(counters.take(ms(100), &one), None);
        assert_eq!(counters.take(ms(101), &other), None);
        assert!(counters.take(ms(102), &at(102)).is_some());
    }

    #[test]
    fn boards_that_began_anew_have_lost_their_calibration() {
        let mut counters = running();
        assert_eq!(counters.take(ms(2000), &[0; STRINGS]), None);
        assert!(counters.were_reset());
        assert_eq!(counters.take(ms(2001), &at(99)), None);
        // A silence alone does not.
        let mut counters = running();
        let _ = counters.take(ms(2000), &at(99));
        let _ = counters.take(ms(2001), &at(99));
        assert!(counters.take(ms(2002), &at(99)).is_some());
    }
}
