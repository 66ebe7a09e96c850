//! What a search for the time of impact is asked, and what it has found.

use super::advancement::{Directions, PairOutcome};

/// What the search found. A failure is a value, never a panic: the caller is a real-time loop.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub enum TimeOfImpact {
    /// The surfaces stay apart over the whole motion.
    Separated,
    /// First contact; the surfaces are apart at every earlier time, and at this one.
    Impact {
        /// Fraction of the motion, in [0, 1].
        time: f64,
    },
    /// The surfaces intersect at `time = 0`.
    Overlapping,
    /// `max_iterations` ran out for some pair. Moving up to `time` is still safe.
    IterationLimit {
        /// Fraction of the motion, in [0, 1].
        time: f64,
    },
}

/// Tolerances and limits of [`time_of_impact`](super::time_of_impact()).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdvancementSettings {
    /// Gap at which surfaces count as touching, m. They never come nearer, unless they are nearer at the start: then
    /// they keep nine tenths of their distance there.
    pub minimum_gap: f64,
    /// The search ends this far above `minimum_gap`, m. Smaller is more accurate, slower.
    pub gap_tolerance: f64,
    /// Most evaluations of the closest points of one pair of triangles in one interval. Bounds the worst-case time of the loop.
    pub max_iterations: u32,
    /// A pair of volumes, down to single triangles, is looked at in intervals in which no point of the body's strays from the straight path of its
    /// centre by more than this share of the larger one's radius, as far as `max_intervals` allows.
    pub interval_edges: f64,
    /// Most intervals of a motion: the next lower power of two, up to 256.
    pub max_intervals: u32,
}

impl Default for AdvancementSettings {
    /// For a body of 0.1 m: 1 um, 0.1 um; motions of any length, cut finely.
    fn default() -> Self {
        Self {
            minimum_gap: 1e-6,
            gap_tolerance: 1e-7,
            max_iterations: 200,
            interval_edges: 0.0625,
            max_intervals: 256,
        }
    }
}

/// The earliest outcome so far.
pub(super) struct First {
    pub(super) time: f64,
    /// The pair, and whether its iterations ran out.
    pub(super) hit: Option<((u32, u32), bool)>,
    /// Least distance of the pairs that were where an advance ends, or nearer, when the interval began, m.
    pub(super) near: f64,
    /// Some pair intersects.
    pub(super) overlapping: bool,
    pub(super) lately: Directions,
}

impl Default for First {
    fn default() -> Self {
        Self {
            time: 1.0,
            hit: None,
            near: f64::INFINITY,
            overlapping: false,
            lately: Directions::default(),
        }
    }
}

impl First {
    /// Takes the outcome of an interval that begins at `from` into account.
    pub(super) fn take(&mut self, outcome: PairOutcome, pair: (u32, u32), from: f64) {
        let (time, limit) = match outcome {
            PairOutcome::Free => return,
            // It came there before, and some pair that faced each other with it.
            PairOutcome::Near(_) | PairOutcome::Overlap if from > 0.0 => (from, false),
            PairOutcome::Near(gap) => {
                self.near = self.near.min(if gap.is_nan() { 0.0 } else { gap });
                return;
            }
            PairOutcome::Overlap => {
                self.overlapping = true;
                return;
            }
            PairOutcome::Hit(time) => (time, false),
            PairOutcome::Limit(time) => (time, true),
        };
        let later = time >= self.time && self.hit.is_some(); // false for NaN
        if !later {
            self.time = time.clamp(0.0, 1.0);
            self.hit = Some((pair, limit));
        }
    }

    pub(super) fn is_near(&self) -> bool {
        self.near < f64::INFINITY
    }

    pub(super) fn answer(&self) -> TimeOfImpact {
        match self.hit {
            None => TimeOfImpact::Separated,
            Some((_, false)) => TimeOfImpact::Impact { time: self.time },
            Some((_, true)) => TimeOfImpact::IterationLimit { time: self.time },
        }
    }
}
