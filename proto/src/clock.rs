//! Clock filter: session time from the four-timestamp exchange, with a bound of its error that no delay can break.
//!
//! | symbol   | name in code        | unit | meaning                                                     |
//! |----------|---------------------|------|-------------------------------------------------------------|
//! | θ        |                     | ns   | session time − client time: what is wanted                  |
//! | l, h     | `lowest`, `highest` | ns   | bounds: θ ≥ t3 − t4 when a response arrives, θ ≤ t2 − t1 when a request leaves |
//! | θ̂        | `applied`           | ns   | what is given out; goes to (l + h)/2                        |
//! | δ        | `round_trip`        | ns   | time on the way, (t4 − t1) − (t3 − t2); h − l of one exchange |
//! | φ        | `DRIFT_PPM`         | 10⁻⁶ | most that two clocks drift apart                            |
//!
//! Nothing arrives before it was sent: each exchange bounds θ by itself, however unequal its two ways. Bounds from before
//! hold on, each wider by φ times its age, and all are intersected. So a delay that grows, on one way or on both, never moves the bounds
//! beyond θ: what was known before it is lost by drift alone, and the uncertainty says so. The midpoint of the newest exchange
//! would follow such a delay by half of it.
//!
//! The offset given out moves to the middle of the bounds by at most [`SLEW_PPM`], so that session time never jumps and never runs
//! backwards. Bounds that contradict each other say that a clock was stepped, or drifts by more than φ: those from before are void.
//! Source: Marzullo and Owicki 1983 (intersection of intervals); RFC 5905 (NTP version 4), sections 10 and 11 (dispersion).

use crate::time::TimeResponse;

/// Exchanges whose round trips are remembered.
pub const WINDOW: usize = 64;
/// Exchanges before session time is given out.
pub const EXCHANGES_TO_LOCK: usize = 8;
/// Most that the given session time is sped up or slowed down: invisible in motion, mends 1 ms in 5 s.
pub const SLEW_PPM: i64 = 200;
/// Most that two quartz clocks drift apart: each is off by up to 50 ppm over its range of temperature.
pub const DRIFT_PPM: i64 = 100;
/// Disagreement beyond which slewing is hopeless (a suspended machine, a restarted server): the filter starts again, ns.
pub const STEP_THRESHOLD_NS: i64 = 500_000_000;
/// Time stamps are whole nanoseconds, and the offset's middle is rounded.
const ROUNDING_NS: i64 = 2;

/// A moment of the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SessionTime {
    /// Nanoseconds since the server started.
    pub ns: u64,
    /// Largest error that the exchanges allow, ns; holds for any delays, as long as the clocks drift by at most [`DRIFT_PPM`].
    pub uncertainty_ns: u64,
}

/// Where the offset lies, as of one moment of the client's clock, ns.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    lowest: i64,
    highest: i64,
    at: i64,
}

impl Bounds {
    /// What these bounds say at a later moment.
    fn at(&self, now: i64) -> Bounds {
        let drift = drift(now - self.at);
        Bounds {
            lowest: self.lowest - drift,
            highest: self.highest + drift,
            at: self.at.max(now),
        }
    }

    /// What both say, of the same moment; `None` where they contradict each other.
    fn and(&self, other: &Bounds) -> Option<Bounds> {
        let both = Bounds {
            lowest: self.lowest.max(other.lowest),
            highest: self.highest.min(other.highest),
            at: self.at,
        };
        (both.lowest <= both.highest + ROUNDING_NS).then_some(both)
    }

    fn middle(&self) -> i64 {
        self.lowest + (self.highest - self.lowest) / 2
    }

    /// Largest distance of `offset` from anywhere within.
    fn error_of(&self, offset: i64) -> i64 {
        (self.highest - offset).max(offset - self.lowest) + ROUNDING_NS
    }
}

/// The most that clocks drift apart in `elapsed` ns, rounded up.
fn drift(elapsed: i64) -> i64 {
    const MILLION: i64 = 1_000_000;
    let elapsed = elapsed.max(0);
    elapsed / MILLION * DRIFT_PPM + elapsed % MILLION * DRIFT_PPM / MILLION + 1
}

/// The filter. Times are arguments: ns since any fixed moment of the client's monotonic clock.
#[derive(Clone, Debug)]
pub struct ClockFilter {
    /// All that is known of the offset.
    bounds: Option<Bounds>,
    round_trips: [i64; WINDOW],
    count: usize,
    /// Offset given out at `applied_at`.
    applied: i64,
    applied_at: i64,
    locked: bool,
    steps: u32,
}

impl Default for ClockFilter {
    fn default() -> ClockFilter {
        ClockFilter {
            bounds: None,
            round_trips: [i64::MAX; WINDOW],
            count: 0,
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
        let exchange = Bounds {
            lowest: t3 - t4,
            highest: t2 - t1 + drift(t4 - t1), // known at t1
            at: t4,
        };
        let known = self.bounds.map(|bounds| bounds.at(t4));
        let applied = self.offset_at(t4);
        let off = (exchange.lowest - applied).max(applied - exchange.highest);
        if self.locked && off > STEP_THRESHOLD_NS {
            *self = ClockFilter {
                steps: self.steps + 1,
                ..ClockFilter::default()
            };
            self.bounds = Some(exchange);
        } else {
            self.bounds = known
                .and_then(|known| known.and(&exchange))
                .or(Some(exchange));
        }

        self.round_trips[self.count % WINDOW] = round_trip;
        self.count += 1;
        if self.locked {
            self.applied = applied;
        } else if let Some(bounds) = &self.bounds {
            self.applied = bounds.middle();
            self.locked = self.count >= EXCHANGES_TO_LOCK;
        }
        self.applied_at = t4;
        true
    }

    /// Session time at client time `now`; `None` until locked.
    pub fn session_time(&self, now: u64) -> Option<SessionTime> {
        let now = plausible(now).filter(|_| self.locked)?;
        let offset = self.offset_at(now);
        let error = self.bounds?.at(now).error_of(offset);
        Some(SessionTime {
            ns: u64::try_from(now + offset).unwrap_or(0),
            uncertainty_ns: error.unsigned_abs(),
        })
    }

    /// Smallest round trip of the last [`WINDOW`] exchanges, ns.
    pub fn round_trip_ns(&self) -> Option<u64> {
        let measured = self.count.min(WINDOW);
        let smallest = self.round_trips[..measured].iter().min();
        smallest.map(|round_trip| round_trip.unsigned_abs())
    }

    /// How often the filter had to start again.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// The offset, slewed from what was last given out towards the middle of the bounds.
    fn offset_at(&self, now: i64) -> i64 {
        let Some(bounds) = &self.bounds else {
            return self.applied;
        };
        let most = (now - self.applied_at).max(0) / 1_000 * SLEW_PPM / 1_000;
        self.applied + (bounds.middle() - self.applied).clamp(-most, most)
    }
}

/// Times beyond 146 years are nonsense; below, no sum or difference overflows.
fn plausible(ns: u64) -> Option<i64> {
    i64::try_from(ns).ok().filter(|ns| *ns < i64::MAX / 2)
}
