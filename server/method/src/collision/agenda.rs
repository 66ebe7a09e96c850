//! Pairs of volumes in the order of the times at which they come near: earliest first, to a share of the search.
//!
//! A pair's children come near no earlier than it does. So a search that takes the earliest pair first, and ends at the first impact, looks at
//! hardly more than it must: at what comes near before that. Any order is safe; this one is short.

use super::buckets::Buckets;
use super::windows::Window;
use crate::geometry::wide_tree::Child;

/// Equal parts of the time that is searched: pairs of one part come out last in, first out.
const PARTS: usize = 1024;
/// Pairs that wait at a time. One that finds no room is looked at at once.
const CAPACITY: usize = 1 << 13;

/// A pair of volumes, (body, obstacle), that a search is to look at in a window of an interval.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    pub(super) pair: (Child, Child),
    pub(super) interval: u32,
    pub(super) window: Window,
}

/// Pairs that wait, by the part of time in which they come near.
pub(crate) type Agenda = Buckets<Waiting, { PARTS / 64 }, CAPACITY>;

impl Waiting {
    /// None that waits.
    pub(super) const UNUSED: Self = Self {
        pair: (u32::MAX, u32::MAX),
        interval: u32::MAX,
        window: Window::WHOLE,
    };
}

/// A part of the time that is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Part(pub(super) u32);

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

    #[test]
    fn later_shares_have_no_earlier_parts() {
        assert_eq!(Part::of(-0.1), Part::FIRST);
        assert_eq!(Part::of(f32::NAN), Part::FIRST);
        assert_eq!(Part::of(2.0), Part::of(1.0));
        let parts = (0..5000).map(|k| Part::of(k as f32 / 5000.0));
        assert!(parts.is_sorted());
    }
}
