//! Constraint sets into datagrams and back: divided by the sender, assembled by the receiver, used only when whole.
//!
//! What is lost is not asked for again: sets are sent at a fixed rate, and the next one is newer. Network jitter mixes the parts of neighbouring
//! sets, so the receiver keeps the newest [`SLOTS`] that are on their way and gives out the newest that is whole. All memory is taken
//! in `new`; a part costs the copy of its rows.

use crate::{
    constraints::{ConstraintPart, ConstraintSet, MAX_PARTS, PART_HEAD_BYTES, SET_PAUSED, SetHead},
    header::MAX_PAYLOAD_BYTES,
};
use arrayvec::ArrayVec;
use std::cmp::Ordering;

/// Sets that may be on their way at once: jitter of 8 ms at 1 kHz.
pub const SLOTS: usize = 8;

/// Where a set is cut into parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Division {
    /// First row of each part, then the number of rows.
    cuts: ArrayVec<u16, { MAX_PARTS + 1 }>,
}

impl Division {
    /// Cuts `set` so that every part fits a datagram. Rows beyond [`MAX_SET_ROWS`](crate::constraints::MAX_SET_ROWS) are left out: a
    /// sender keeps to that.
    pub fn of(set: &ConstraintSet) -> Division {
        let rows = &set.rows[..set.rows.len().min(crate::constraints::MAX_SET_ROWS)];
        let mut cuts = ArrayVec::new();
        cuts.push(0);
        let mut used = PART_HEAD_BYTES;
        for (row, of_row) in rows.iter().enumerate() {
            let bytes = of_row.bytes();
            if used + bytes > MAX_PAYLOAD_BYTES {
                cuts.push(row as u16); // MAX_PARTS holds the largest rows
                used = PART_HEAD_BYTES;
            }
            used += bytes;
        }
        cuts.push(rows.len() as u16);
        Division { cuts }
    }

    /// Datagrams that the set takes: at least one, also for a set without rows.
    pub fn parts(&self) -> usize {
        self.cuts.len() - 1
    }

    /// Part number `part`, below [`Self::parts`], of the set that was divided.
    pub fn part(&self, set: &ConstraintSet, part: usize) -> ConstraintPart {
        let (first, end) = (self.cuts[part], self.cuts[part + 1]);
        let rows = &set.rows[usize::from(first)..usize::from(end)];
        ConstraintPart {
            head: set.head,
            rows_in_set: self.cuts[self.parts()],
            part: part as u8, // MAX_PARTS is below 256
            parts: self.parts() as u8,
            first_row: first,
            rows: rows.iter().copied().collect(),
        }
    }
}

/// What became of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartTaken {
    /// Its set is whole now, and the newest.
    Whole,
    /// More parts are to come.
    Waiting,
    /// It is of the set that was given out last: its head says for which reading that is true.
    Repeated,
    /// A newer set is whole already, or too many newer ones are on their way.
    Overtaken,
    /// It contradicts other parts of its set.
    Refused,
}

/// A set that is on its way.
#[derive(Clone, Debug)]
struct Slot {
    set: ConstraintSet,
    /// 0 in a slot that is free.
    parts: u8,
    /// Bit k: part k is here.
    here: u128,
    /// First row and number of rows of each part.
    runs: [(u16, u8); MAX_PARTS],
}

/// Puts parts together. Bounded memory, no allocation after `new`.
#[derive(Clone, Debug)]
pub struct Assembler {
    slots: Vec<Slot>,
    /// The newest whole set.
    whole: ConstraintSet,
    /// Sequence number of `whole`.
    newest: Option<u64>,
}

impl Default for Assembler {
    fn default() -> Assembler {
        Assembler::new()
    }
}

impl Assembler {
    /// With room for [`SLOTS`] full sets.
    pub fn new() -> Assembler {
        let slot = Slot {
            set: ConstraintSet::new(),
            parts: 0,
            here: 0,
            runs: [(0, 0); MAX_PARTS],
        };
        Assembler {
            slots: vec![slot; SLOTS],
            whole: ConstraintSet::new(),
            newest: None,
        }
    }

    /// The newest whole set; `None` before the first.
    pub fn newest(&self) -> Option<&ConstraintSet> {
        self.newest.map(|_| &self.whole)
    }

    /// Takes one part in.
    pub fn take(&mut self, part: &ConstraintPart) -> PartTaken {
        let sequence = part.head.sequence;
        match self.newest {
            Some(newest) if sequence < newest => return PartTaken::Overtaken,
            Some(newest) if sequence == newest => {
                self.whole.head.renew(&part.head);
                return PartTaken::Repeated;
            }
            _ => {}
        }
        let Some(place) = self.slot_for(sequence) else {
            return PartTaken::Overtaken;
        };
        let slot = &mut self.slots[place];
        if !slot.fits(part) {
            return PartTaken::Refused;
        }
        slot.add(part);
        if !slot.has_every_part() {
            return PartTaken::Waiting;
        }
        if !slot.runs_follow_each_other() {
            slot.parts = 0;
            return PartTaken::Refused;
        }
        std::mem::swap(&mut self.whole, &mut slot.set);
        slot.parts = 0;
        self.newest = Some(sequence);
        for slot in &mut self.slots {
            if slot.set.head.sequence <= sequence {
                slot.parts = 0;
            }
        }
        PartTaken::Whole
    }

    /// The slot of set `sequence`: its own, a free one, or that of the oldest set if that is older.
    fn slot_for(&mut self, sequence: u64) -> Option<usize> {
        let rank = |slot: &Slot| match slot.parts {
            0 => (1, 0),
            _ if slot.set.head.sequence == sequence => (0, 0),
            _ => (2, slot.set.head.sequence),
        };
        let place = (0..SLOTS).min_by_key(|place| rank(&self.slots[*place]))?;
        let slot = &mut self.slots[place];
        let (kind, oldest) = rank(slot);
        if kind == 2 {
            if oldest > sequence {
                return None;
            }
            slot.parts = 0;
        }
        Some(place)
    }
}

impl SetHead {
    /// Takes another head of the same set: the same rows for a newer reading, or other flags, which no rows depend on. Of two that change places on
    /// the way the newer one counts, and of two for the same reading the one that gives no force.
    fn renew(&mut self, other: &SetHead) {
        let paused = match other.device_ns.cmp(&self.device_ns) {
            Ordering::Less => return,
            Ordering::Equal => self.flags & SET_PAUSED,
            Ordering::Greater => 0,
        };
        *self = *other;
        self.flags |= paused;
    }
}

impl Slot {
    /// Whether `part` is of the set that is here; a free slot fits any.
    fn fits(&self, part: &ConstraintPart) -> bool {
        let of_same_size =
            self.parts == part.parts && self.set.rows.len() == usize::from(part.rows_in_set);
        let same_pose = self.set.head.pose == part.head.pose;
        self.parts == 0 || of_same_size && same_pose
    }

    fn add(&mut self, part: &ConstraintPart) {
        if self.parts == 0 {
            self.parts = part.parts;
            self.here = 0;
            self.set.rows.clear();
            let rows = usize::from(part.rows_in_set);
            self.set.rows.resize(rows, Default::default());
            self.set.head = part.head;
        }
        self.set.head.renew(&part.head);
        let first = usize::from(part.first_row);
        // Within: the decoder has compared the run with the number of rows.
        self.set.rows[first..first + part.rows.len()].copy_from_slice(&part.rows);
        self.runs[usize::from(part.part)] = (part.first_row, part.rows.len() as u8);
        self.here |= 1 << part.part;
    }

    fn has_every_part(&self) -> bool {
        self.here == u128::MAX >> (MAX_PARTS - usize::from(self.parts))
    }

    /// Every row came with exactly one part.
    fn runs_follow_each_other(&self) -> bool {
        let mut next = 0;
        for (first, rows) in &self.runs[..usize::from(self.parts)] {
            if usize::from(*first) != next {
                return false;
            }
            next += usize::from(*rows);
        }
        next == self.set.rows.len()
    }
}
