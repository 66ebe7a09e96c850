//! Intervals of a motion, halved and halved again: made when they are asked for.

use super::agenda::Part;
use super::facing_volumes::FacingVolumes;
use super::motion::{Placement, RelativeMotion};
use super::turned::TurnedNodes;
use super::windows::Window;
use crate::geometry::wide_tree::WideTree;

/// Most halvings of a motion.
pub(super) const MAX_HALVINGS: u32 = 8;
/// Number of the whole motion; the halves of interval i are `2 i` and `2 i + 1`.
pub(crate) const WHOLE: u32 = 1;

/// What the halvings leave of a motion, down to the middles of the shortest intervals: exact, and without a division.
const SHARES: [f64; MAX_HALVINGS as usize + 2] = {
    let mut shares = [1.0; MAX_HALVINGS as usize + 2];
    let mut k = 1;
    while k < shares.len() {
        shares[k] = 0.5 * shares[k - 1];
        k += 1;
    }
    shares
};

/// One interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) from: f64,
    pub(super) to: f64,
    /// The body at `from`.
    pub(super) start: Placement,
    pub(super) volumes: FacingVolumes,
    /// Its middle and half of it, as shares of the search.
    middle_share: f32,
    half_share: f32,
}

impl Interval {
    /// The part of the search in which a time of the interval lies, `share` of its half from the middle.
    #[inline(always)]
    pub(super) fn part(&self, share: f32) -> Part {
        Part::of(share * self.half_share + self.middle_share)
    }

    /// When a window of it begins and ends.
    #[inline]
    pub(super) fn times(&self, window: Window) -> [f64; 2] {
        let (middle, half) = (0.5 * (self.from + self.to), 0.5 * (self.to - self.from));
        let time = |share: f32| middle + half * f64::from(share);
        let whole_from = window.enter <= -1.0;
        let whole_to = window.leave >= 1.0;
        [
            if whole_from {
                self.from
            } else {
                time(window.enter)
            },
            if whole_to {
                self.to
            } else {
                time(window.leave)
            },
        ]
    }
}

/// The intervals of one search.
#[derive(Clone, Debug)]
pub(crate) struct Intervals {
    made: Vec<Option<Interval>>,
    /// Numbers of those made.
    numbers: Vec<u32>,
    end: f64,
    margin: f64,
}

impl Intervals {
    pub(crate) fn new() -> Self {
        let count = 2 << MAX_HALVINGS;
        Self {
            made: vec![None; count],
            numbers: Vec::with_capacity(count),
            end: 1.0,
            margin: 0.0,
        }
    }

    /// Forgets all, for a search over `[0, end]` with this margin, m.
    pub(super) fn restart(&mut self, end: f64, margin: f64) {
        for number in self.numbers.drain(..) {
            self.made[number as usize] = None;
        }
        (self.end, self.margin) = (end, margin);
    }

    /// Interval `number`, at most `MAX_HALVINGS` deep.
    #[inline]
    pub(super) fn get(
        &mut self,
        number: u32,
        motion: &RelativeMotion,
        trees: (&WideTree, &WideTree),
        turned: &mut TurnedNodes,
    ) -> &Interval {
        let place = &mut self.made[number as usize];
        if place.is_none() {
            self.numbers.push(number);
        }
        let (end, margin) = (self.end, self.margin);
        place.get_or_insert_with(|| make(number, end, margin, motion, trees, turned))
    }
}

#[cold]
fn make(
    number: u32,
    end: f64,
    margin: f64,
    motion: &RelativeMotion,
    trees: (&WideTree, &WideTree),
    turned: &mut TurnedNodes,
) -> Interval {
    let [from, to] = ends(number, end);
    let half_share = 0.5 / (1_u32 << number.ilog2()) as f32;
    let place = number - (1 << number.ilog2());
    Interval {
        middle_share: (2 * place + 1) as f32 * half_share,
        half_share,
        from,
        to,
        start: motion.at(from),
        volumes: FacingVolumes::over(trees, motion, [from, to], margin, turned),
    }
}

/// Neighbours share their ends to the bit.
#[inline]
fn ends(number: u32, end: f64) -> [f64; 2] {
    let halvings = number.ilog2();
    let (k, share) = (number - (1 << halvings), SHARES[halvings as usize]);
    [
        end * (f64::from(k) * share),
        end * (f64::from(k + 1) * share),
    ]
}

/// Cuts of a motion into at most `count` intervals.
pub(super) fn halvings(count: u32) -> u32 {
    count.max(1).ilog2().min(MAX_HALVINGS)
}
