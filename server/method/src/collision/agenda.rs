//! Pairs of volumes in the order of the times at which they come near: earliest first, to a share of the search.
//!
//! A pair's children come near no earlier than it does. So a search that takes the earliest pair first, and ends at the first impact, looks at
//! hardly more than it must: at what comes near before that. Any order is safe; this one is short.

use super::windows::Window;
use crate::geometry::wide_tree::Child;

/// Equal parts of the time that is searched: pairs of one part come out last in, first out.
const PARTS: usize = 1024;
/// Pairs that wait at a time. One that finds no room is looked at at once.
const CAPACITY: usize = 1 << 13;
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
    /// Which parts are not empty, a bit each; none before word `first`.
    filled: [u64; PARTS / 64],
    first: usize,
    waiting: Vec<(Waiting, u32)>,
    free: u32,
}

impl Agenda {
    pub(super) fn new() -> Self {
        let unused = Waiting {
            pair: (NONE, NONE),
            interval: NONE,
            window: Window::WHOLE,
        };
        // Written to, so that no search is the first to touch its pages.
        let mut waiting = vec![(unused, NONE); CAPACITY];
        waiting.clear();
        Self {
            heads: [NONE; PARTS],
            filled: [0; PARTS / 64],
            first: 0,
            waiting,
            free: NONE,
        }
    }

    pub(super) fn clear(&mut self) {
        self.filled = [0; PARTS / 64];
        self.first = 0;
        self.waiting.clear();
        self.free = NONE;
    }

    /// False when there is no room.
    #[inline]
    pub(super) fn push(&mut self, part: Part, waiting: Waiting) -> bool {
        let part = part.0 as usize % PARTS;
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
        self.first = self.first.min(word);
        true
    }

    /// One of the earliest pairs and its part; none when all that wait come later than in part `last`.
    #[inline]
    pub(super) fn pop(&mut self, last: Part) -> Option<(Part, Waiting)> {
        while self.filled.get(self.first)? == &0 {
            self.first += 1;
        }
        let word = self.first;
        let bit = self.filled[word].trailing_zeros();
        let part = 64 * word + bit as usize;
        if part as u32 > last.0 {
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
        Some((Part(part as u32), waiting))
    }
}

/// A part of the time that is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Part(u32);

impl Part {
    pub(super) const FIRST: Self = Self(0);

    /// The part in which a share of the search lies; what is outside counts as the first or the last, NaN as the first.
    #[inline(always)]
    pub(super) fn of(share: f32) -> Self {
        // A cast keeps to the range.
        Self(((share * PARTS as f32) as i32).clamp(0, PARTS as i32 - 1) as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(number: u32) -> Waiting {
        Waiting {
            pair: (number, number),
            interval: 1,
            window: Window::WHOLE,
        }
    }

    #[test]
    fn what_waits_comes_out_by_part_and_places_are_used_again() {
        let mut agenda = Agenda::new();
        for _ in 0..3 {
            agenda.clear();
            let part = |k: usize| Part((k * 7919 % PARTS) as u32);
            for k in 0..CAPACITY {
                assert!(agenda.push(part(k), numbered(k as u32)));
            }
            assert!(!agenda.push(Part::FIRST, numbered(0)), "full");
            let mut seen = vec![false; CAPACITY];
            let mut before = Part::FIRST;
            for k in 0..CAPACITY {
                let (now, next) = agenda.pop(part(0).max(Part::of(1.0))).expect("one more");
                assert!(now >= before && now == part(next.pair.0 as usize), "{k}");
                assert!(!std::mem::replace(&mut seen[next.pair.0 as usize], true));
                before = now;
            }
            assert!(agenda.pop(Part::of(1.0)).is_none());
            // An earlier one than the last that came out.
            assert!(agenda.push(Part::FIRST, numbered(5)));
            assert_eq!(agenda.pop(Part::FIRST).map(|(_, w)| w.pair.0), Some(5));
            assert!(agenda.push(Part::of(0.5), numbered(6)));
            assert!(agenda.pop(Part::of(0.4)).is_none());
        }
    }

    #[test]
    fn later_shares_have_no_earlier_parts() {
        assert_eq!(Part::of(-0.1), Part::FIRST);
        assert_eq!(Part::of(f32::NAN), Part::FIRST);
        assert_eq!(Part::of(2.0), Part::of(1.0));
        let parts = (0..5000).map(|k| Part::of(k as f32 / 5000.0));
        assert!(parts.is_sorted());
    }
}
