//! Shared datum: the barrier as this node sees it, with the state of the newest RELEASE.
//!
//! Writers: the receiver of datagrams, and the thread that draws; one lock between them, never held across a system call but for waiting on it.

use std::{
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
    time::Duration,
};
use taut_proto::{
    HotState,
    barrier::{Node, Release},
};

pub(crate) struct Frames {
    inner: Mutex<Option<Part>>,
    released: Condvar,
}

/// This node's part in the barrier.
pub(crate) struct Part {
    pub(crate) node: Node,
    /// Of the newest RELEASE, with its fingerprint.
    pub(crate) state: Option<(HotState, u64)>,
}

impl Frames {
    pub(crate) fn new() -> Frames {
        Frames {
            inner: Mutex::new(None),
            released: Condvar::new(),
        }
    }

    /// From now on RELEASEs count.
    pub(crate) fn take_part(&self, node: Node) {
        *self.lock() = Some(Part { node, state: None });
    }

    /// From now on they do not.
    pub(crate) fn take_leave(&self) {
        *self.lock() = None;
    }

    /// Takes a RELEASE in; older ones and copies have no effect. No allocation.
    pub(crate) fn release(&self, release: Release, state_hash: u64, local_ns: u64) {
        let mut inner = self.lock();
        if let Some(part) = &mut *inner
            && part.node.release(local_ns, &release.head)
        {
            part.state = Some((release.state, state_hash));
            drop(inner);
            self.released.notify_one();
        }
    }

    /// Looks at the part; `None` if there is none.
    pub(crate) fn with<T>(&self, look: impl FnOnce(&mut Part) -> T) -> Option<T> {
        self.lock().as_mut().map(look)
    }

    /// Looks at the part, and waits for a RELEASE, for at most the time that `look` returns; a RELEASE that comes between the two is not missed.
    pub(crate) fn wait<T>(&self, look: impl FnOnce(&mut Part) -> Result<T, Duration>) -> Option<T> {
        let mut inner = self.lock();
        match look(inner.as_mut()?) {
            Ok(found) => Some(found),
            Err(longest) => {
                drop(
                    self.released
                        .wait_timeout(inner, longest)
                        .unwrap_or_else(PoisonError::into_inner),
                );
                None
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Option<Part>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
