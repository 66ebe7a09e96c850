//! Session time: how long the server has been up.
//!
//! Everything that leaves a loop is stamped with it. On the wire it is nanoseconds; clients convert it by their clock filter.

use std::time::Duration;

use taut_bridge::realtime::monotonic_now;

/// The clock of one run of the server. Copies read the same clock.
#[derive(Clone, Copy, Debug)]
pub struct SessionClock {
    /// The start, on the clock that threads sleep by.
    monotonic_start: Duration,
    /// The same for the network, which takes its own readings.
    link: taut_link::SessionClock,
}

impl SessionClock {
    /// A clock that reads zero now.
    pub fn start() -> Self {
        Self {
            monotonic_start: monotonic_now(),
            link: taut_link::SessionClock::start_now(),
        }
    }

    /// The same clock for the network, apart by less than a microsecond.
    pub fn for_link(&self) -> taut_link::SessionClock {
        self.link
    }

    /// How much later this clock began than `earlier` did.
    pub(crate) fn since(&self, earlier: &Self) -> Duration {
        self.monotonic_start.saturating_sub(earlier.monotonic_start)
    }

    /// Session time now. Never runs back.
    #[inline]
    pub fn now(&self) -> Duration {
        monotonic_now().saturating_sub(self.monotonic_start)
    }

    /// What the system's monotonic clock reads at `time`, for absolute sleeps.
    #[inline]
    pub fn monotonic(&self, time: Duration) -> Duration {
        self.monotonic_start + time
    }
}

/// Session time in nanoseconds, as on the wire; holds for 584 years.
#[inline]
pub(crate) fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn session_time_and_the_monotonic_clock_belong_together() {
        let clock = SessionClock::start();
        let time = clock.now();
        assert_eq!(
            clock.monotonic(time) - clock.monotonic(Duration::ZERO),
            time
        );
        assert!(clock.now() >= time);
        assert!(clock.monotonic(clock.now()) <= monotonic_now());
    }

    #[test]
    fn nanoseconds_saturate_instead_of_wrapping() {
        assert_eq!(nanoseconds(Duration::from_micros(3)), 3_000);
        assert_eq!(nanoseconds(Duration::MAX), u64::MAX);
    }
}
