//! A rate with a burst: how fast bulk may be sent, or messages be taken.
//!
//! | symbol | name in code | unit | meaning                                                        |
//! |--------|--------------|------|----------------------------------------------------------------|
//! | TAT    | `free_ns`    | ns   | when all that was taken so far would be through at the even rate |
//! | τ      | `burst_ns`   | ns   | how far ahead of the even rate one may be                       |
//!
//! Source: ITU-T I.371, annex A (generic cell rate algorithm, virtual scheduling).

/// The pace. Times are arguments.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    per_second: u64,
    burst_ns: u64,
    free_ns: u64,
}

impl Pace {
    /// `per_second` units a second, of which `burst` may go at once after a pause.
    ///
    /// # Panics
    /// When `per_second` is 0.
    pub const fn new(per_second: u64, burst: u64) -> Pace {
        assert!(per_second > 0, "a pace of nothing per second never ends");
        Pace {
            per_second,
            burst_ns: time_of(burst, per_second),
            free_ns: 0,
        }
    }

    /// Books `amount` and returns when it may go: now or later, in the order of the bookings.
    pub fn book(&mut self, now_ns: u64, amount: u64) -> u64 {
        let free_ns = self.free_ns.max(now_ns);
        self.free_ns = free_ns.saturating_add(time_of(amount, self.per_second));
        free_ns.saturating_sub(self.burst_ns).max(now_ns)
    }
}

/// Time of `amount` at the even rate, ns, rounded up.
const fn time_of(amount: u64, per_second: u64) -> u64 {
    let ns = (amount as u128 * 1_000_000_000).div_ceil(per_second as u128);
    if ns > u64::MAX as u128 {
        u64::MAX
    } else {
        ns as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SECOND: u64 = 1_000_000_000;

    #[test]
    fn a_burst_goes_at_once_and_the_rest_at_the_rate() {
        let mut pace = Pace::new(10, 5);
        let at: Vec<u64> = (0..10)
            .map(|_| pace.book(SECOND, 1) / (SECOND / 10))
            .collect();
        assert_eq!(at, [10, 10, 10, 10, 10, 10, 11, 12, 13, 14]);
    }

    #[test]
    fn a_pause_does_not_save_up_more_than_the_burst() {
        let mut pace = Pace::new(10, 2);
        pace.book(0, 1);
        let late = 100 * SECOND;
        let at: Vec<u64> = (0..4).map(|_| pace.book(late, 1) - late).collect();
        assert_eq!(at, [0, 0, 0, SECOND / 10]);
    }

    proptest! {
        #[test]
        fn in_no_stretch_of_time_goes_more_than_the_rate_and_a_burst(
            bookings in proptest::collection::vec((0u64..SECOND, 1u64..50), 2..100),
            rate in 1u64..1000, burst in 0u64..200,
        ) {
            let mut pace = Pace::new(rate, burst);
            let mut now = 0;
            let mut gone = Vec::new();
            for (pause, amount) in bookings {
                now += pause;
                let at = pace.book(now, amount);
                prop_assert!(at >= now);
                gone.push((at, amount));
            }
            for first in 0..gone.len() {
                for last in first..gone.len() {
                    prop_assert!(gone[first].0 <= gone[last].0, "in order");
                    // The last one of the stretch is out when it may begin to go: it is not counted.
                    let sum: u64 = gone[first..last].iter().map(|(_, amount)| amount).sum();
                    let stretch = (gone[last].0 - gone[first].0) as f64 / SECOND as f64;
                    let most = stretch * rate as f64 + burst as f64 + 1.0;
                    prop_assert!(sum as f64 <= most, "{sum} > {most}");
                }
            }
        }
    }
}
