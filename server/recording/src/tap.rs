//! The loops' ends of the queues: pushing never waits and never allocates.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use god_object::constraint::{ConstraintSet, NonPenetrationConstraint};
use rtrb::{Consumer, Producer, RingBuffer};

use crate::records::{ConstraintRecord, ForceRecord, HapticsRecord, UpdateRecord};

/// Two seconds of a 1 kHz loop.
const TICKS: usize = 2048;
/// Rows wait here for the writer: 2 seconds of 32 rows at 1 kHz, or one second of 64.
const ROWS: usize = 65_536;

/// Where one loop puts its records.
#[derive(Debug)]
pub struct Tap<T> {
    queue: Producer<T>,
    lost: Arc<AtomicU64>,
}

/// The other end of a [`Tap`].
#[derive(Debug)]
pub(crate) struct Drain<T> {
    pub(crate) queue: Consumer<T>,
    lost: Arc<AtomicU64>,
}

impl<T> Drain<T> {
    /// How many records found the queue full.
    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

fn tap<T>(capacity: usize) -> (Tap<T>, Drain<T>) {
    let (producer, consumer) = RingBuffer::new(capacity);
    let lost = Arc::new(AtomicU64::new(0));
    let end = Tap {
        queue: producer,
        lost: Arc::clone(&lost),
    };
    (
        end,
        Drain {
            queue: consumer,
            lost,
        },
    )
}

impl<T: Copy> Tap<T> {
    /// Puts a record into the queue, or counts it as lost when the writer is that far behind.
    pub fn push(&mut self, record: T) {
        if self.queue.push(record).is_err() {
            self.lost_more(1);
        }
    }

    fn lost_more(&self, count: u64) {
        let lost = self.lost.load(Ordering::Relaxed);
        self.lost.store(lost + count, Ordering::Relaxed);
    }
}

impl Tap<ConstraintRecord> {
    /// Puts the rows of a set into the queue: all of them, or none where there is no room for all.
    pub fn push_set(&mut self, set: &ConstraintSet) {
        let rows: &[NonPenetrationConstraint] = &set.constraints;
        if self.queue.slots() < rows.len() {
            self.lost_more(rows.len() as u64);
            return;
        }
        for row in rows {
            self.push(ConstraintRecord {
                set: set.sequence,
                row: *row,
            });
        }
    }
}

/// The taps of the three loops.
#[derive(Debug)]
pub struct Taps {
    /// Of the haptics loop.
    pub haptics: Tap<HapticsRecord>,
    /// Of the god-object loop.
    pub updates: Tap<UpdateRecord>,
    /// Of the god-object loop, for the rows of its sets.
    pub constraints: Tap<ConstraintRecord>,
    /// Of the coupling.
    pub forces: Tap<ForceRecord>,
}

/// The writer's ends.
#[derive(Debug)]
pub(crate) struct Drains {
    pub(crate) haptics: Drain<HapticsRecord>,
    pub(crate) updates: Drain<UpdateRecord>,
    pub(crate) constraints: Drain<ConstraintRecord>,
    pub(crate) forces: Drain<ForceRecord>,
}

pub(crate) fn taps() -> (Taps, Drains) {
    let (haptics, haptics_drain) = tap(TICKS);
    let (updates, updates_drain) = tap(TICKS);
    let (constraints, constraints_drain) = tap(ROWS);
    // A force per device sample and per constraint set.
    let (forces, forces_drain) = tap(2 * TICKS);
    (
        Taps {
            haptics,
            updates,
            constraints,
            forces,
        },
        Drains {
            haptics: haptics_drain,
            updates: updates_drain,
            constraints: constraints_drain,
            forces: forces_drain,
        },
    )
}
