//! The gaps of a search: below which the bodies never come, and at which an advance ends.

/// Bodies nearer than the minimum gap at the start may come down to this share of their distance there: they are free to
/// leave and to slide, and never touch.
const KEPT_SHARE_OF_START_GAP: f64 = 0.9;
/// Bodies at the minimum gap to rounding may lose this many units of slack: a push that never eases loses 0.1 pm in each search.
const KEPT_SLACKS: f64 = 4.0;
/// Share of the gap tolerance, above the minimum gap, at which an advance ends: rounding does not bring the next start below the minimum.
const STOP_SHARE_OF_TOLERANCE: f64 = 0.5;

/// Distances that a search keeps, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gaps {
    /// The gap that nothing may go below, m.
    pub(crate) minimum: f64,
    /// The gap at which an advance ends, m: above the minimum.
    pub(crate) stop: f64,
    /// What is this far above `stop` is at it, m.
    pub(crate) tolerance: f64,
    /// Bound on the rounding error of a distance, m.
    pub(crate) slack: f64,
}

impl Gaps {
    /// An advance ends at most `tolerance` above `minimum`; `slack` is added for rounding.
    pub(crate) fn new(minimum: f64, tolerance: f64, slack: f64) -> Self {
        Self {
            minimum,
            stop: minimum + slack + STOP_SHARE_OF_TOLERANCE * tolerance,
            tolerance: (1.0 - STOP_SHARE_OF_TOLERANCE) * tolerance,
            slack,
        }
    }

    /// For bodies whose distance at the start is `gap`, at the gap to stop at or nearer; `None` when nothing is left to keep.
    pub(crate) fn keeping(&self, gap: f64) -> Option<Self> {
        let above = gap - KEPT_SLACKS * self.slack;
        let kept = if above >= self.minimum {
            above
        } else {
            KEPT_SHARE_OF_START_GAP * gap
        };
        let stop = kept.min(self.stop);
        let tolerance = self.tolerance.min(STOP_SHARE_OF_TOLERANCE * (gap - stop));
        (kept > self.slack).then_some(Self {
            stop,
            tolerance,
            ..*self
        }) // None for NaN
    }
}
