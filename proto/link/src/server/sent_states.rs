//! Shared datum: fingerprints of the states sent lately, to compare with what clients say they drew.
//!
//! Writer: the broadcaster. Readers: the sessions' control tasks, once per report. Wait-free; a slot being rewritten reads as unknown.

use std::sync::atomic::{AtomicU64, Ordering};

/// States remembered: four seconds at 1 kHz, where clients report once per second.
const REMEMBERED: usize = 4096;
/// Tick of a slot that holds nothing.
const EMPTY: u64 = u64::MAX;

pub(crate) struct SentStates {
    slots: Box<[Slot]>,
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
        }
    }

    pub(crate) fn remember(&self, tick: u64, hash: u64) {
        let slot = self.slot(tick);
        slot.tick.store(EMPTY, Ordering::SeqCst);
        slot.hash.store(hash, Ordering::SeqCst);
        slot.tick.store(tick, Ordering::SeqCst);
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
