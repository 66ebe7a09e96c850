//! Shared datum: fingerprints of the states sent lately, to compare with what clients say they drew.
//!
//! Writer: the broadcaster, before it sends. Readers: the sessions' control tasks, once per report, and the receiving thread, which confirms to each client
//! what went to the group. Wait-free; a slot being rewritten reads as unknown.

use std::sync::atomic::{AtomicU64, Ordering};
use taut_proto::{Confirmation, confirmation::SentState};

/// States remembered: four seconds at 1 kHz, where clients report once per second.
const REMEMBERED: usize = 4096;
/// Tick of a slot that holds nothing.
const EMPTY: u64 = u64::MAX;

pub(crate) struct SentStates {
    slots: Box<[Slot]>,
    newest: AtomicU64,
}

struct Slot {
    tick: AtomicU64,
    hash: AtomicU64,
}

impl SentStates {
    pub(crate) fn new() -> SentStates {
        let slot = || Slot {
            tick: AtomicU64::new(EMPTY),
            hash: AtomicU64::new(0),
        };
        SentStates {
            slots: std::iter::repeat_with(slot).take(REMEMBERED).collect(),
            newest: AtomicU64::new(EMPTY),
        }
    }

    pub(crate) fn remember(&self, tick: u64, hash: u64) {
        let slot = self.slot(tick);
        slot.tick.store(EMPTY, Ordering::SeqCst);
        slot.hash.store(hash, Ordering::SeqCst);
        slot.tick.store(tick, Ordering::SeqCst);
        self.newest.store(tick, Ordering::SeqCst);
    }

    /// The newest states, for a client that asked at `asked_ns` of its clock. Some microseconds, no allocation.
    pub(crate) fn lately(&self, asked_ns: u64) -> Confirmation {
        let mut lately = Confirmation {
            asked_ns,
            ..Confirmation::default()
        };
        let newest = self.newest.load(Ordering::SeqCst);
        if newest == EMPTY {
            return lately;
        }
        let oldest = newest.saturating_sub(REMEMBERED as u64 - 1);
        for tick in (oldest..=newest).rev() {
            let slot = self.slot(tick);
            if slot.tick.load(Ordering::SeqCst) != tick {
                continue;
            }
            let state_hash = slot.hash.load(Ordering::SeqCst);
            let is_whole = slot.tick.load(Ordering::SeqCst) == tick;
            if is_whole && !lately.add(SentState { tick, state_hash }) {
                break;
            }
        }
        lately
    }

    /// Whether `hash` is what was sent at `tick`; `None` if that is not known any more.
    pub(crate) fn agrees(&self, tick: u64, hash: u64) -> Option<bool> {
        let slot = self.slot(tick);
        let known = |slot: &Slot| tick != EMPTY && slot.tick.load(Ordering::SeqCst) == tick;
        if !known(slot) {
            return None;
        }
        let sent = slot.hash.load(Ordering::SeqCst);
        known(slot).then_some(sent == hash)
    }

    fn slot(&self, tick: u64) -> &Slot {
        &self.slots[(tick % REMEMBERED as u64) as usize]
    }
}
