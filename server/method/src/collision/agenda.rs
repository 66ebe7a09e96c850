//! Pairs of volumes in the order of the times at which they come near: earliest first, to a share of the search.
//!
//! A pair's children come near no earlier than it does. So what is looked at last is what would have to be looked at in any case: everything that
//! comes near before the first impact.

use super::windows::Window;
use crate::geometry::wide_tree::Child;

/// Equal parts of the time that is searched: pairs of one part come last in, first out.
const PARTS: usize = 1024;
/// Pairs that wait at a time. The descent does one that finds no room at once.
const CAPACITY: usize = 1 << 14;
/// Marks the end of a list.
const NONE: u32 = u32::MAX;

/// A pair of volumes, (body, obstacle), that a search is to look at in a window of an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    pub(super) pair: (Child, Child),
    pub(super) interval: u32,
    pub(super) window: Window,
}

/// Pairs that wait, by the part of time in which they come near. No allocation after `new`.
#[derive(Clone, Debug)]
pub(crate) struct Agenda {
    /// First of each list; without meaning where the part is empty.
    heads: [u32; PARTS],
    /// Which parts are not empty, a bit each.
    filled: [u64; PARTS / 64],
    waiting: Vec<(Waiting, u32)>,
    free: u32,
    parts_per_time: f64,
}

impl Agenda {
    pub(super) fn new() -> Self {
        Self {
            heads: [NONE; PARTS],
            filled: [0; PARTS / 64],
            waiting: Vec::with_capacity(CAPACITY),
            free: NONE,
            parts_per_time: 0.0,
        }
    }

    /// Forgets all, for a search over `[0, end]`.
    pub(super) fn restart(&mut self, end: f64) {
        self.filled = [0; PARTS / 64];
        self.waiting.clear();
        self.free = NONE;
        self.parts_per_time = PARTS as f64 / end;
    }

    /// Later times have no earlier parts, rounded as they are.
    #[inline]
    fn part(&self, time: f64) -> usize {
        // A cast keeps to the range and makes 0 of NaN.
        ((time * self.parts_per_time) as usize).min(PARTS - 1)
    }

    /// False when there is no room.
    #[inline]
    pub(super) fn push(&mut self, time: f64, waiting: Waiting) -> bool {
        let part = self.part(time);
        let (word, bit) = (part / 64, 1 << (part % 64));
        let next = if self.filled[word] & bit == 0 {
            NONE
        } else {
            self.heads[part]
        };
        let place = if self.free != NONE {
            let place = self.free;
            self.free = self.waiting[place as usize].1;
            self.waiting[place as usize] = (waiting, next);
            place
        } else if self.waiting.len() < CAPACITY {
            self.waiting.push((waiting, next));
            self.waiting.len() as u32 - 1
        } else {
            return false;
        };
        self.heads[part] = place;
        self.filled[word] |= bit;
        true
    }

    /// The next pair; none when all that wait come near after `end`.
    #[inline]
    pub(super) fn pop(&mut self, end: f64) -> Option<Waiting> {
        let (word, bits) = self
            .filled
            .iter()
            .enumerate()
            .find(|(_, bits)| **bits != 0)?;
        let bit = bits.trailing_zeros();
        let part = 64 * word + bit as usize;
        if part > self.part(end) {
            return None;
        }
        let place = self.heads[part];
        let (waiting, next) = self.waiting[place as usize];
        self.heads[part] = next;
        if next == NONE {
            self.filled[word] &= !(1 << bit);
        }
        self.waiting[place as usize].1 = self.free;
        self.free = place;
        Some(waiting)
    }
}
