//! Clock filter: session time from the four-timestamp exchange.
//!
//! | symbol | name in code   | unit | meaning                                                   |
//! |--------|----------------|------|-----------------------------------------------------------|
//! | θ      | `offset`       | ns   | session time − client time, ((t2 − t1) + (t3 − t4)) / 2     |
//! | δ      | `round_trip`   | ns   | time on the way, (t4 − t1) − (t3 − t2)                     |
//! | φ      | `DRIFT_PPM`    | 10⁻⁶ | most that two clocks drift apart between measurements      |
//!
//! The error of one exchange is at most δ/2, growing with its age by φ; the filter follows the exchange of the last 64 with the smallest
//! δ/2 + φ·age, and moves there by at most [`SLEW_PPM`], so that session time never jumps and never runs backwards.
//! Source: RFC 5905 (NTP version 4), section 10 (clock filter, dispersion).

use crate::time::TimeResponse;

/// Exchanges remembered.
pub const WINDOW: usize = 64;
/// Exchanges before session time is given out.
pub const EXCHANGES_TO_LOCK: usize = 8;
/// Most that the given session time is sped up or slowed down: invisible in motion, mends 1 ms in 5 s.
pub const SLEW_PPM: i64 = 200;
/// Assumed drift between two quartz clocks: twice the 25 ppm of usual parts.
pub const DRIFT_PPM: i64 = 50;
/// Disagreement beyond which slewing is hopeless (a suspended machine, a restarted server): the filter starts again, ns.
pub const STEP_THRESHOLD_NS: i64 = 500_000_000;

/// A moment of the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SessionTime {
    /// Nanoseconds since the server started.
    pub ns: u64,
    /// Largest error that the measurements allow, ns.
    pub uncertainty_ns: u64,
}

#[derive(Clone, Copy, Debug)]
struct Exchange {
    at: i64,
    offset: i64,
    round_trip: i64,
}

impl Exchange {
    fn error_at(&self, now: i64) -> i64 {
        self.round_trip / 2 + (now - self.at).max(0) / 1_000_000 * DRIFT_PPM
    }
}

/// The filter. Times are arguments: ns since any fixed moment of the client's monotonic clock.
#[derive(Clone, Debug)]
pub struct ClockFilter {
    exchanges: [Option<Exchange>; WINDOW],
    next: usize,
    count: usize,
    /// Best exchange when last updated: where the offset moves to.
    target: Option<Exchange>,
    /// Offset given out at `applied_at`.
    applied: i64,
    applied_at: i64,
    locked: bool,
    steps: u32,
}

impl Default for ClockFilter {
    fn default() -> ClockFilter {
        ClockFilter {
            exchanges: [None; WINDOW],
            next: 0,
            count: 0,
            target: None,
            applied: 0,
            applied_at: 0,
            locked: false,
            steps: 0,
        }
    }
}

impl ClockFilter {
    /// Takes one exchange in; `received` is t4. An exchange that contradicts itself is ignored and `false` is returned.
    pub fn update(&mut self, response: &TimeResponse, received: u64) -> bool {
        let (Some(t1), Some(t2), Some(t3), Some(t4)) = (
            plausible(response.client_sent),
            plausible(response.server_received),
            plausible(response.server_sent),
            plausible(received),
        ) else {
            return false;
        };
        let round_trip = (t4 - t1) - (t3 - t2);
        if t4 < t1 || t3 < t2 || round_trip < 0 {
            return false;
        }
        let exchange = Exchange {
            at: t4,
            offset: ((t2 - t1) + (t3 - t4)) / 2,
            round_trip,
        };

        // A disagreement that no error explains: the clocks were stepped, what was known is void.
        if self.locked
            && (exchange.offset - self.applied).abs() - round_trip / 2 > STEP_THRESHOLD_NS
        {
            *self = ClockFilter {
                steps: self.steps + 1,
                ..ClockFilter::default()
            };
        }

        let now = self.offset_at(t4);
        self.exchanges[self.next] = Some(exchange);
        self.next = (self.next + 1) % WINDOW;
        self.count = (self.count + 1).min(WINDOW);
        self.target = self.best(t4);
        if self.locked {
            self.applied = now;
        } else if let Some(target) = self.target {
            self.applied = target.offset;
            self.locked = self.count >= EXCHANGES_TO_LOCK;
        }
        self.applied_at = t4;
        true
    }

    /// Session time at client time `now`; `None` until locked.
    pub fn session_time(&self, now: u64) -> Option<SessionTime> {
        let now = plausible(now).filter(|_| self.locked)?;
        let offset = self.offset_at(now);
        let target = self.target?;
        let error = target.error_at(now) + (target.offset - offset).abs();
        Some(SessionTime {
            ns: u64::try_from(now + offset).unwrap_or(0),
            uncertainty_ns: error.unsigned_abs(),
        })
    }

    /// Session time − client time as given out now, ns; `None` until locked.
    pub fn offset_ns(&self, now: u64) -> Option<i64> {
        plausible(now)
            .filter(|_| self.locked)
            .map(|now| self.offset_at(now))
    }

    /// Smallest round trip in the window, ns.
    pub fn round_trip_ns(&self) -> Option<u64> {
        self.exchanges
            .iter()
            .flatten()
            .map(|exchange| exchange.round_trip.unsigned_abs())
            .min()
    }

    /// How often the filter had to start again.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    fn best(&self, now: i64) -> Option<Exchange> {
        self.exchanges
            .iter()
            .flatten()
            .min_by_key(|exchange| exchange.error_at(now))
            .copied()
    }

    /// The offset, slewed from what was last given out towards the target.
    fn offset_at(&self, now: i64) -> i64 {
        let Some(target) = self.target else {
            return self.applied;
        };
        let most = (now - self.applied_at).max(0) / 1_000 * SLEW_PPM / 1_000;
        self.applied + (target.offset - self.applied).clamp(-most, most)
    }
}

/// Times beyond 146 years are nonsense; below, no sum or difference overflows.
fn plausible(ns: u64) -> Option<i64> {
    i64::try_from(ns).ok().filter(|ns| *ns < i64::MAX / 2)
}
