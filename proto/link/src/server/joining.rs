//! Attempts to join, under the limits of `taut_proto::limits`: before TLS, and with the outcome noted whatever ends it.

use super::shared::Shared;
use std::{net::IpAddr, sync::Arc};
use taut_proto::limits::{Attempt, JoinGuard, JoinLimits, Rate, UnknownSources};

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

/// One attempt; dropping it ends it, so that a task that is given up leaves no trace.
pub(crate) struct Joining {
    shared: Arc<Shared>,
    address: IpAddr,
    outcome: Attempt,
}

impl Joining {
    /// `None` if `address` may not try now.
    pub(crate) fn begin(shared: &Arc<Shared>, address: IpAddr) -> Option<Joining> {
        lock(&shared.joins)
            .begin(address, shared.clock.now_ns())
            .then(|| Joining {
                shared: shared.clone(),
                address,
                outcome: Attempt::Ended,
            })
    }

    pub(crate) fn came_to(&mut self, outcome: Attempt) {
        self.outcome = outcome;
    }
}

impl Drop for Joining {
    fn drop(&mut self) {
        let now_ns = self.shared.clock.now_ns();
        lock(&self.shared.joins).end(self.address, self.outcome, now_ns);
    }
}
