//! Discrete events that lose nothing: each reaches each client exactly once, in order.
//!
//! An event goes two ways. In HOT it is repeated in every state until all clients have acknowledged it, [`REPEAT_NS`] at most: fast. On the
//! control stream it is told once: sure. The client takes it from whichever comes first.
//!
//! Numbers count up from any start and wrap. The stream says between which numbers it tells all there is, so it alone may leave numbers out; from HOT
//! the client takes only the very next one.

use crate::{
    codec::wire_struct,
    range::WRAPS,
    state::{EventRecord, MAX_EVENTS},
};
use arrayvec::ArrayVec;
use std::collections::VecDeque;

/// How long an event is repeated in HOT, ns: beyond it the stream is as fast.
pub const REPEAT_NS: u64 = 32_000_000;
/// Events kept for the streams of slow clients. At ten events a second a client may stand still for more than a minute.
pub const MAX_KEPT: usize = 1024;
/// Events kept at a client for who takes them; beyond it the oldest go, and are counted.
pub const MAX_QUEUED: usize = 1024;
/// Most events in one message.
pub const MAX_BATCH: usize = 256;

wire_struct! {
    /// All events after a number, on the control stream.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct EventBatch {
        /// Number of the event before the first of these. The first message of a stream tells no event, only where the client comes in.
        pub after: u32 => WRAPS,
        /// The events, in order.
        pub records: Vec<EventRecord>,
    }
}

wire_struct! {
    /// Client to server: all events up to a number have been taken in.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct EventAck {
        /// Number of the newest.
        pub newest: u32 => WRAPS,
    }
}

/// Whether event `a` comes after event `b`.
pub fn is_newer(a: u32, b: u32) -> bool {
    a.wrapping_sub(b) as i32 > 0
}

/// The server's side: what was told lately.
#[derive(Clone, Debug)]
pub struct EventOutbox {
    newest: u32,
    /// Oldest first.
    kept: VecDeque<EventRecord>,
    /// Repeated in HOT, with the time when each came, ns; oldest first.
    trail: ArrayVec<(EventRecord, u64), MAX_EVENTS>,
}

impl Default for EventOutbox {
    fn default() -> EventOutbox {
        EventOutbox {
            newest: 0,
            kept: VecDeque::with_capacity(MAX_KEPT),
            trail: ArrayVec::new(),
        }
    }
}

impl EventOutbox {
    /// Takes an event in; `false` if it is not newer than the newest. No allocation.
    pub fn push(&mut self, record: EventRecord, now_ns: u64) -> bool {
        if !is_newer(record.id, self.newest) {
            return false;
        }
        self.newest = record.id;
        if self.kept.len() == MAX_KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back(record);
        if self.trail.is_full() {
            self.trail.remove(0);
        }
        self.trail.push((record, now_ns));
        true
    }

    /// Number of the newest event; 0 before the first.
    pub fn newest(&self) -> u32 {
        self.newest
    }

    /// Whether HOT repeats anything.
    pub fn repeats(&self) -> bool {
        !self.trail.is_empty()
    }

    /// What HOT repeats now, oldest first: what is neither older than [`REPEAT_NS`] nor acknowledged by all. No allocation.
    pub fn trail(
        &mut self,
        now_ns: u64,
        by_all: Option<u32>,
    ) -> impl Iterator<Item = EventRecord> + '_ {
        self.trail.retain(|(record, came_ns)| {
            let acknowledged = by_all.is_some_and(|newest| !is_newer(record.id, newest));
            !acknowledged && now_ns.saturating_sub(*came_ns) < REPEAT_NS
        });
        self.trail.iter().map(|(record, _)| *record)
    }

    /// What the stream tells a client that was told all up to `after`: at most [`MAX_BATCH`] events. If some of what it lacks is not kept any more, the
    /// message begins after that.
    pub fn batch_after(&self, after: u32) -> EventBatch {
        // From the newest backwards: numbers that wrapped are told apart near their place only.
        let fresh = self
            .kept
            .iter()
            .rev()
            .take_while(|record| is_newer(record.id, after))
            .count();
        let start = self.kept.len() - fresh;
        let full = self.kept.len() == MAX_KEPT;
        let oldest = self.kept.front().filter(|_| start == 0 && full);
        let before = oldest.map(|first| first.id.wrapping_sub(1));
        let after = before
            .filter(|before| is_newer(*before, after))
            .unwrap_or(after);
        EventBatch {
            after,
            records: self.kept.range(start..).take(MAX_BATCH).copied().collect(),
        }
    }
}

/// The client's side: each event once, in order.
#[derive(Clone, Debug)]
pub struct EventInbox {
    /// Number of the newest event taken; `None` until the stream said where this client comes in.
    newest: Option<u32>,
    queue: VecDeque<EventRecord>,
    missed: u64,
    overrun: u64,
}

impl Default for EventInbox {
    fn default() -> EventInbox {
        EventInbox {
            newest: None,
            queue: VecDeque::with_capacity(MAX_QUEUED),
            missed: 0,
            overrun: 0,
        }
    }
}

impl EventInbox {
    /// Takes what a state repeats. No allocation.
    pub fn repeated(&mut self, trail: &[EventRecord]) {
        for record in trail {
            if self
                .newest
                .is_some_and(|newest| record.id == newest.wrapping_add(1))
            {
                self.take(*record);
            }
        }
    }

    /// Takes what the stream tells.
    pub fn receive(&mut self, batch: &EventBatch) {
        match self.newest {
            None => self.newest = Some(batch.after),
            Some(newest) if is_newer(batch.after, newest) => {
                self.missed += u64::from(batch.after.wrapping_sub(newest));
                self.newest = Some(batch.after);
            }
            Some(_) => {}
        }
        for record in &batch.records {
            if self
                .newest
                .is_some_and(|newest| is_newer(record.id, newest))
            {
                self.take(*record);
            }
        }
    }

    fn take(&mut self, record: EventRecord) {
        self.newest = Some(record.id);
        if self.queue.len() == MAX_QUEUED {
            self.queue.pop_front();
            self.overrun += 1;
        }
        self.queue.push_back(record);
    }

    /// Moves the events that wait to the end of `out`.
    pub fn drain(&mut self, out: &mut Vec<EventRecord>) {
        out.extend(self.queue.drain(..));
    }

    /// Number of the newest event taken; `None` until the stream said where this client comes in.
    pub fn newest(&self) -> Option<u32> {
        self.newest
    }

    /// Events that the server did not keep long enough for this client's slow stream.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// Events that nobody took from the queue in time.
    pub fn overrun(&self) -> u64 {
        self.overrun
    }
}
