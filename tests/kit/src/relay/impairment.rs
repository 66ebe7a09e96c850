//! What a relay does to datagrams.

use std::ops::Range;
use std::time::Duration;

/// Datagrams that are lost one after the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Burst {
    /// Probability that a burst begins at a datagram.
    pub chance: f64,
    /// Datagrams that are lost, the first included.
    pub length: u32,
}

/// A time on the way that grows from datagram to datagram, as a queue's does that fills.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Number of the datagram from which on it grows.
    pub from: u64,
    /// By how much at each.
    pub step: Duration,
    /// Most that it grows to.
    pub most: Duration,
}

impl Growth {
    /// What the datagram of this number waits.
    pub(super) fn of(&self, number: u64) -> Duration {
        let steps = u32::try_from(number.saturating_sub(self.from)).unwrap_or(u32::MAX);
        self.step.saturating_mul(steps).min(self.most)
    }
}

/// What a relay does to the datagrams of one direction. Probabilities are per datagram, in [0, 1]; the default does nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Impairment {
    /// Probability that a datagram is lost, each for itself.
    pub lost: f64,
    /// Losses in a row.
    pub bursts: Option<Burst>,
    /// Time on the way.
    pub delay: Duration,
    /// Further time on the way, which grows.
    pub growth: Option<Growth>,
    /// Largest further time on the way, uniform from zero. Order is kept, as a queue keeps it.
    pub jitter: Duration,
    /// Probability that a datagram is held back until the next one has passed, at most 20 ms.
    pub swapped: f64,
    /// Probability that a datagram passes twice.
    pub doubled: f64,
    /// Probability that one bit is not what it was.
    pub flipped: f64,
    /// Most bytes that pass; longer datagrams are lost, as where fragments are not forwarded.
    pub longest: Option<usize>,
    /// Numbers of the datagrams that nothing is heard of again.
    pub black_holes: Vec<Range<u64>>,
}

impl Impairment {
    /// Loses this share, each datagram for itself.
    pub fn losing(share: f64) -> Impairment {
        Impairment {
            lost: share,
            ..Impairment::default()
        }
    }
}

/// Which way a datagram goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Client to server.
    Up,
    /// Server to client.
    Down,
}

/// What one client's flow is treated to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Treatment {
    /// Client to server.
    pub up: Impairment,
    /// Server to client.
    pub down: Impairment,
}

impl Treatment {
    /// The same both ways.
    pub fn both_ways(impairment: Impairment) -> Treatment {
        Treatment {
            up: impairment.clone(),
            down: impairment,
        }
    }
}
