//! Discrete events at the server: from the broadcaster into the states and onto the control streams.
//!
//! Written by the broadcaster, read by the writers of the streams; both hold the lock for a copy of a few records and across no system call.

use crate::lock::{Mutex, lock};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use taut_proto::{EventBatch, EventOutbox, HotState, events::is_newer};
use tokio::sync::watch;

#[derive(Default)]
pub(crate) struct EventHub {
    outbox: Mutex<EventOutbox>,
    /// Whether states repeat anything: saves the lock where nothing happens.
    repeats: AtomicBool,
    /// Number of the newest event; written by the broadcaster, which takes no lock of the runtime's.
    newest: AtomicU32,
    /// The same for those who follow, a moment later.
    newest_sent: watch::Sender<u32>,
}

impl EventHub {
    /// Takes the new events of `state`, and returns the state with those that are to be repeated; `None` if it goes as it is. No allocation.
    pub(crate) fn exchange(
        &self,
        state: &HotState,
        by_all: Option<u32>,
        now_ns: u64,
    ) -> Option<HotState> {
        if state.events.is_empty() && !self.repeats.load(Ordering::Relaxed) {
            return None;
        }
        let mut sent = state.clone();
        sent.events.clear();
        let newest = {
            let mut outbox = lock(&self.outbox);
            let mut pushed = false;
            for record in &state.events {
                pushed |= outbox.push(*record, now_ns);
            }
            sent.events.extend(outbox.trail(now_ns, by_all));
            self.repeats.store(outbox.repeats(), Ordering::Relaxed);
            pushed.then(|| outbox.newest())
        };
        if let Some(newest) = newest {
            self.newest.store(newest, Ordering::Release);
        }
        Some(sent)
    }

    /// Changes when there are new events.
    pub(crate) fn follow(&self) -> watch::Receiver<u32> {
        self.newest_sent.subscribe()
    }

    /// Tells those who follow; called by a task of the runtime, again and again.
    pub(crate) fn publish(&self) {
        let newest = self.newest.load(Ordering::Acquire);
        self.newest_sent
            .send_if_modified(|newest_sent| std::mem::replace(newest_sent, newest) != newest);
    }

    /// Number of the newest event.
    pub(crate) fn newest(&self) -> u32 {
        lock(&self.outbox).newest()
    }

    /// Whether there was an event of this number, or none since; where it is asked for often, no lock.
    pub(crate) fn has_told(&self, number: u32) -> bool {
        !is_newer(number, self.newest.load(Ordering::Acquire))
    }

    /// What a client that has all up to `after` is to be told.
    pub(crate) fn batch_after(&self, after: u32) -> EventBatch {
        lock(&self.outbox).batch_after(after)
    }
}
