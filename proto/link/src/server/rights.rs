//! What the gate remembers of one session: how much it sends, and what it tried without being allowed to.

use crate::lock::{Mutex, lock};
use std::sync::atomic::{AtomicU16, Ordering};
use taut_proto::{Act, Role, limits::TokenBucket};

pub(crate) struct Rights {
    role: Role,
    datagrams: Mutex<TokenBucket>,
    /// Bits of the acts that were tried and told.
    forbidden: AtomicU16,
}

impl Rights {
    pub(crate) fn new(role: Role) -> Rights {
        Rights {
            role,
            datagrams: Mutex::default(),
            forbidden: AtomicU16::new(0),
        }
    }

    /// Whether another datagram may be looked at now.
    pub(crate) fn take_datagram(&self, now_ns: u64) -> bool {
        lock(&self.datagrams).take(self.role.datagram_rate(), now_ns)
    }

    /// Notes a forbidden act; whether it is the first of its kind.
    pub(crate) fn note_forbidden(&self, act: Act) -> bool {
        self.forbidden.fetch_or(act.bit(), Ordering::Relaxed) & act.bit() == 0
    }
}
