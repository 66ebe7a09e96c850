//! The rate at which one client gets states: all of them, or 250 per second while its way is full.
//!
//! A full way is seen at the sender: the system or QUIC does not take a datagram at once. Less is sent then for a while that grows with every relapse, so
//! that a way which is too narrow for the full rate is tried ever more rarely, and a hiccup costs a quarter of a second.

/// Distance of states at the lowered rate, ns: 250 Hz.
pub const LOWERED_PERIOD_NS: u64 = 4_000_000;
/// How long the rate stays lowered after the way was full, ns; doubles with every relapse.
pub const FIRST_HOLD_NS: u64 = 250_000_000;
/// Longest of these, ns.
pub const LONGEST_HOLD_NS: u64 = 8_000_000_000;
/// Time at the full rate after which the way counts as mended, ns: the next hold is the first one again.
pub const MENDED_NS: u64 = 10_000_000_000;

/// The pace of one client.
#[derive(Clone, Debug)]
pub struct Pace {
    /// Until when the rate is lowered, ns.
    lowered_until_ns: u64,
    hold_ns: u64,
}

impl Default for Pace {
    fn default() -> Pace {
        Pace {
            lowered_until_ns: 0,
            hold_ns: FIRST_HOLD_NS,
        }
    }
}

impl Pace {
    /// The way was full.
    pub fn blocked(&mut self, now_ns: u64) {
        let lowered = self.is_lowered(now_ns);
        if !lowered && self.lowered_until_ns > 0 {
            let well_for_ns = now_ns.saturating_sub(self.lowered_until_ns);
            self.hold_ns = match well_for_ns >= MENDED_NS {
                true => FIRST_HOLD_NS,
                false => (self.hold_ns * 2).min(LONGEST_HOLD_NS),
            };
        }
        self.lowered_until_ns = now_ns.saturating_add(self.hold_ns);
    }

    /// Whether the rate is lowered.
    pub fn is_lowered(&self, now_ns: u64) -> bool {
        now_ns < self.lowered_until_ns
    }

    /// Shortest distance of states now, ns; 0 for all.
    pub fn period_ns(&self, now_ns: u64) -> u64 {
        match self.is_lowered(now_ns) {
            true => LOWERED_PERIOD_NS,
            false => 0,
        }
    }
}
