//! Whether a client takes its states from multicast or by itself: decided at the client, by what it hears.
//!
//! A client begins with unicast, and listens. When it hears the group steadily it tells the server to leave the unicast away; when the group falls silent while the
//! server lives, it asks for unicast again, and tries multicast later: a switch that drops groups costs [`SILENCE_NS`], once. What it hears is believed for
//! a moment only: see [`crate::confirmation`].

/// Silence on the group after which a client goes back to unicast, ns. The server says something at least every 50 ms.
pub const SILENCE_NS: u64 = 100_000_000;
/// Datagrams to be heard, each within [`SILENCE_NS`] of the one before, until the group counts as steady.
pub const PROOF: u32 = 20;
/// A sign of life of the server's own path that is older says nothing, ns: two time exchanges.
pub const ALIVE_NS: u64 = 250_000_000;
/// Time after the first failure before multicast is tried again, ns; doubles up to [`LONGEST_RETRY_NS`].
pub const FIRST_RETRY_NS: u64 = 1_000_000_000;
/// Longest time before multicast is tried again, ns. A group that was heard for so long counts as mended.
pub const LONGEST_RETRY_NS: u64 = 60_000_000_000;

/// How states come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StatePath {
    /// To this client alone.
    Unicast,
    /// To the group.
    Multicast,
}

/// Watches the group.
#[derive(Clone, Debug)]
pub struct MulticastWatch {
    path: StatePath,
    /// Datagrams heard without a silence between.
    steady: u32,
    heard_ns: Option<u64>,
    /// When the path changed last, ns.
    since_ns: u64,
    not_before_ns: u64,
    retry_ns: u64,
    /// A member forges the server's states.
    is_forged: bool,
}

impl Default for MulticastWatch {
    fn default() -> MulticastWatch {
        MulticastWatch {
            path: StatePath::Unicast,
            steady: 0,
            heard_ns: None,
            since_ns: 0,
            not_before_ns: 0,
            retry_ns: FIRST_RETRY_NS,
            is_forged: false,
        }
    }
}

impl MulticastWatch {
    /// An authentic datagram of the server came to the group.
    pub fn heard(&mut self, now_ns: u64) {
        self.steady = match self.is_silent(now_ns) {
            true => 1,
            false => self.steady.saturating_add(1),
        };
        self.heard_ns = Some(now_ns);
    }

    /// What the server is to be asked for now, if anything; `alive_ns` is when the server was last heard on the client's own path. The same until
    /// [`MulticastWatch::asked`].
    pub fn wish(&self, now_ns: u64, alive_ns: Option<u64>) -> Option<StatePath> {
        let alive = alive_ns.is_some_and(|heard| now_ns.saturating_sub(heard) < ALIVE_NS);
        match self.path {
            StatePath::Multicast if self.is_silent(now_ns) && alive => Some(StatePath::Unicast),
            StatePath::Unicast
                if !self.is_forged
                    && self.steady >= PROOF
                    && !self.is_silent(now_ns)
                    && now_ns >= self.not_before_ns =>
            {
                Some(StatePath::Multicast)
            }
            _ => None,
        }
    }

    /// The server was asked for `path`.
    pub fn asked(&mut self, path: StatePath, now_ns: u64) {
        if path == StatePath::Unicast {
            let held_ns = now_ns.saturating_sub(self.since_ns);
            if held_ns >= LONGEST_RETRY_NS {
                self.retry_ns = FIRST_RETRY_NS;
            }
            self.not_before_ns = now_ns.saturating_add(self.retry_ns);
            self.retry_ns = (self.retry_ns * 2).min(LONGEST_RETRY_NS);
            self.steady = 0;
        }
        self.path = path;
        self.since_ns = now_ns;
    }

    /// A member sealed a state in the server's name: the group is not tried again before its keys change.
    pub fn forged(&mut self) {
        self.is_forged = true;
    }

    /// The group has other keys, and perhaps other members.
    pub fn rekeyed(&mut self) {
        self.is_forged = false;
    }

    /// How states come, as asked last.
    pub fn path(&self) -> StatePath {
        self.path
    }

    fn is_silent(&self, now_ns: u64) -> bool {
        self.heard_ns
            .is_none_or(|heard| now_ns.saturating_sub(heard) >= SILENCE_NS)
    }
}
