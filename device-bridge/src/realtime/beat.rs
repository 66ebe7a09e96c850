//! When a periodic loop is due: absolute deadlines on a beat of the monotonic clock that keeps clear of the kernel's own.
//!
//! Recent Linux (seen on 6.18) ticks at whole multiples of its period on this clock (4 ms at `CONFIG_HZ=250`, on all cores at once), so at whole milliseconds. A
//! loop that is due just before has the kernel's interrupt, and what it defers, within its own work every time; one that is due a quarter of a millisecond
//! after it does not. Where the kernel ticks is shown by `cargo run --release -p taut --no-default-features --example control_loop -- --by-phase`.

use std::time::Duration;

use super::{monotonic_now, sleep_until};

/// Where in the millisecond the loop is due that touches a device: the kernel has done by then, and comes again no sooner than in three times as long.
pub const CLEAR_OF_KERNEL_TICK: Duration = Duration::from_micros(250);

/// The first of the times `phase + k period` that is at least one period after `now`.
#[must_use]
pub fn first_on_beat(now: Duration, period: Duration, phase: Duration) -> Duration {
    let earliest = now + period;
    // From the last time on the beat, if `earliest` is not one; no beat without a period.
    let on_beat = phase.as_nanos().checked_rem(period.as_nanos()).unwrap_or(0);
    let beyond = (earliest.as_nanos() + period.as_nanos() - on_beat)
        .checked_rem(period.as_nanos())
        .unwrap_or(0);
    if beyond == 0 {
        return earliest;
    }
    // Less than a period, which is far less than 2^64 ns.
    earliest + (period - Duration::from_nanos(beyond as u64))
}

/// Deadlines of a periodic loop on the monotonic clock.
#[derive(Clone, Copy, Debug)]
pub struct Ticker {
    period: Duration,
    next: Duration,
}

impl Ticker {
    /// The first deadline is one `period` from now, or up to two, so that it lies [`CLEAR_OF_KERNEL_TICK`].
    #[must_use]
    pub fn new(period: Duration) -> Self {
        Self::at_phase(period, CLEAR_OF_KERNEL_TICK)
    }

    /// The same with the deadlines at `phase` of the period.
    #[must_use]
    pub fn at_phase(period: Duration, phase: Duration) -> Self {
        Self {
            period,
            next: first_on_beat(monotonic_now(), period, phase),
        }
    }

    /// Sleeps to the next deadline. Returns how many whole periods were missed before it: they are skipped, not
    /// caught up, so a stall does not end in a burst.
    pub fn wait(&mut self) -> u64 {
        sleep_until(self.next);
        let missed = whole_periods(monotonic_now().saturating_sub(self.next), self.period);
        self.next += self
            .period
            .saturating_mul(u32::try_from(missed).unwrap_or(u32::MAX))
            + self.period;
        missed
    }
}

fn whole_periods(late: Duration, period: Duration) -> u64 {
    let periods = late.as_nanos().checked_div(period.as_nanos()).unwrap_or(0);
    u64::try_from(periods).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_time_on_the_beat_is_a_period_away_and_less_than_two() {
        let (us, period) = (Duration::from_micros, Duration::from_millis(1));
        for phase in [us(0), us(200), us(5250)] {
            for now in [
                us(0),
                us(199),
                us(200),
                us(201),
                us(999),
                us(1000),
                us(12_345),
            ] {
                let first = first_on_beat(now, period, phase);
                assert!(
                    first >= now + period && first < now + 2 * period,
                    "{now:?} {first:?}"
                );
                assert_eq!(
                    first.as_nanos() % period.as_nanos(),
                    phase.as_nanos() % period.as_nanos(),
                    "{first:?}"
                );
            }
        }
        // Nothing to divide by: at once.
        assert_eq!(first_on_beat(period, us(0), us(250)), period);
    }

    #[test]
    fn a_ticker_is_due_clear_of_the_kernel() {
        let period = Duration::from_millis(1);
        let ticker = Ticker::new(period);
        assert_eq!(
            ticker.next.as_nanos() % period.as_nanos(),
            CLEAR_OF_KERNEL_TICK.as_nanos()
        );
    }

    #[test]
    fn a_ticker_skips_what_it_missed_and_keeps_its_phase() {
        let period = Duration::from_millis(2);
        let mut ticker = Ticker::new(period);
        let first = ticker.next;
        sleep_until(first + 3 * period);
        let missed = ticker.wait();
        assert!(missed >= 3);
        let offset = (ticker.next - first).as_nanos() % period.as_nanos();
        assert_eq!(offset, 0);
        assert!(ticker.next > first + 3 * period);
    }
}
