//! Attempts to join, under the limits of `taut_proto::limits`: before TLS, and with the outcome noted whatever ends it.

use super::shared::Shared;
use crate::lock::lock;
use std::{net::IpAddr, sync::Arc};
use taut_proto::{
    limits::{Attempt, JoinGuard, JoinLimits, Rate, UnknownSources},
    waiting::Ticket,
};
use tokio::sync::oneshot;

/// Limits against floods. The defaults are generous for a workbench; see `docs/security.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FloodLimits {
    /// Of joining, per address.
    pub joins: JoinLimits,
    /// Datagrams that are opened for a source that is not yet known as a client's, per source.
    pub unknown_source: Rate,
    /// The same of all such sources together.
    pub unknown_sources: Rate,
}

impl Default for FloodLimits {
    /// A client that joins sends 16 datagrams at once and 10 a second from then on; a known address is not counted here.
    fn default() -> FloodLimits {
        FloodLimits {
            joins: JoinLimits::default(),
            unknown_source: Rate {
                per_second: 64,
                burst: 64,
            },
            unknown_sources: Rate {
                per_second: 4000,
                burst: 4000,
            },
        }
    }
}

impl FloodLimits {
    pub(crate) fn guard(&self) -> JoinGuard {
        JoinGuard::new(self.joins)
    }

    pub(crate) fn unknown(&self) -> UnknownSources {
        UnknownSources::new(self.unknown_source, self.unknown_sources)
    }
}

/// Attempts under way at once. Who comes beyond it takes the place of the oldest of the address that has the most: see [`taut_proto::waiting`].
pub(crate) const MAX_JOINING: usize = 64;

/// One attempt; dropping it ends it, so that a task that is given up leaves no trace.
pub(crate) struct Joining {
    shared: Arc<Shared>,
    address: IpAddr,
    outcome: Attempt,
    /// Its place among those who have not proven anything.
    ticket: Ticket,
}

/// Held among those who wait; dropped by whoever takes the place.
pub(crate) type Place = oneshot::Sender<()>;
/// Fails when the place is lost.
pub(crate) type Lost = oneshot::Receiver<()>;

impl Joining {
    /// `None` if `address` may not try now.
    pub(crate) fn begin(shared: &Arc<Shared>, address: IpAddr) -> Option<(Joining, Lost)> {
        if !lock(&shared.joins).begin(address, shared.clock.now_ns()) {
            return None;
        }
        let (place, lost) = oneshot::channel();
        let (ticket, loser) = lock(&shared.waiting).enter(address, place);
        if loser.is_some() {
            shared.counters.crowded_out.one();
        }
        let attempt = Joining {
            shared: shared.clone(),
            address,
            outcome: Attempt::Ended,
            ticket,
        };
        Some((attempt, lost))
    }

    /// It proved its secret; `false` if it had lost its place before.
    pub(crate) fn proven(&mut self) -> bool {
        self.outcome = Attempt::Proven;
        self.leave()
    }

    /// Gives its place back; `false` if somebody else has taken it.
    fn leave(&self) -> bool {
        let place = lock(&self.shared.waiting).leave(self.ticket);
        // Said, not dropped: it is over, but not lost.
        place.is_some_and(|place| place.send(()).is_ok())
    }

    pub(crate) fn wrong_proof(&mut self) {
        self.outcome = Attempt::WrongProof;
    }
}

impl Drop for Joining {
    fn drop(&mut self) {
        self.leave();
        let now_ns = self.shared.clock.now_ns();
        lock(&self.shared.joins).end(self.address, self.outcome, now_ns);
    }
}
