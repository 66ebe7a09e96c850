//! The bridge's own time stamps, as they come back with what was computed from them, on the clock of the ticks.
//!
//! A reading is stamped with session time as the bridge knows it, and forces and constraint sets carry that stamp as their origin. So an age is a
//! difference on one clock: how long ago this bridge took the reading. No error of the clock filter is in it, and no delay can make it
//! smaller.

use std::time::Duration;

use taut_link::proto::SessionTime;

/// The offset is slewed by 200 ppm at most: a change of more than this from one tick to the next is a new clock.
const NEW_CLOCK_NS: i128 = 1_000_000;
/// How far ahead of now a stamp of a moment ago may seem, by slewing.
const AHEAD_NS: u64 = 1_000_000;

/// Tells when own stamps were made.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OwnStamps {
    known: Option<Known>,
}

#[derive(Clone, Copy, Debug)]
struct Known {
    now: Duration,
    session_ns: u64,
    /// Stamps of this clock are not before this.
    first_ns: u64,
}

impl OwnStamps {
    /// Takes session time at `now`; `None` while the clock is not locked.
    pub(crate) fn follow(&mut self, now: Duration, session: Option<SessionTime>) {
        let offset =
            |now: Duration, session_ns: u64| i128::from(session_ns) - now.as_nanos() as i128;
        self.known = session.map(|session| {
            let same_clock = self.known.filter(|known| {
                let change = offset(now, session.ns) - offset(known.now, known.session_ns);
                change.abs() <= NEW_CLOCK_NS
            });
            Known {
                now,
                session_ns: session.ns,
                first_ns: same_clock.map_or(session.ns, |known| known.first_ns),
            }
        });
    }

    /// When the stamp was made, on the clock of the ticks; `None` where that is not known: no stamp, one of another clock, or one from
    /// the future.
    pub(crate) fn made(&self, stamp_ns: u64) -> Option<Duration> {
        let known = self.known?;
        let own = stamp_ns >= known.first_ns && stamp_ns > 0;
        let past = stamp_ns <= known.session_ns.saturating_add(AHEAD_NS);
        let age = Duration::from_nanos(known.session_ns.saturating_sub(stamp_ns));
        (own && past).then(|| known.now.saturating_sub(age))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ms;

    const MS: u64 = 1_000_000;

    fn session(ns: u64) -> Option<SessionTime> {
        Some(SessionTime {
            ns,
            uncertainty_ns: 40_000,
        })
    }

    #[test]
    fn a_stamp_is_as_old_as_the_time_since_it_was_made() {
        let mut stamps = OwnStamps::default();
        assert_eq!(stamps.made(5), None, "the clock was never locked");
        for tick in 0..100 {
            stamps.follow(ms(1000 + tick), session((7000 + tick) * MS));
        }
        assert_eq!(stamps.made(7059 * MS), Some(ms(1059)));
        assert_eq!(stamps.made(7099 * MS), Some(ms(1099)));
        assert_eq!(stamps.made(0), None, "none");
        assert_eq!(stamps.made(6999 * MS), None, "before the clock was known");
        assert_eq!(stamps.made(7101 * MS), None, "from the future");
        assert_eq!(stamps.made(u64::MAX), None);
    }

    #[test]
    fn stamps_of_a_clock_before_a_step_are_not_of_this_one() {
        let mut stamps = OwnStamps::default();
        for tick in 0..100 {
            stamps.follow(ms(1000 + tick), session((7000 + tick) * MS));
        }
        stamps.follow(ms(1100), session(7600 * MS));
        assert_eq!(stamps.made(7590 * MS), None, "not ten milliseconds old");
        stamps.follow(ms(1150), session(7650 * MS));
        assert_eq!(stamps.made(7620 * MS), Some(ms(1120)));
        stamps.follow(ms(1151), None);
        assert_eq!(stamps.made(7651 * MS), None);
        stamps.follow(ms(1200), session(7700 * MS));
        assert_eq!(stamps.made(7651 * MS), None, "it was not known meanwhile");
    }
}
