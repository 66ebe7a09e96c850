//! Rows of a hollow's facets that a ball cannot touch where it is, and can before the next update: the nearest, since there are many in a fine hollow.

use arrayvec::ArrayVec;

use super::element::Row;

/// Most of them; each direction of a bore has half.
const MAX_IMPLIED: usize = 64;

/// The nearest of those that were offered, each with its triangle.
pub(super) struct ImpliedRows {
    rows: ArrayVec<(Row, u32), MAX_IMPLIED>,
    activation_distance: f64,
}

impl ImpliedRows {
    pub(super) fn new(activation_distance: f64) -> Self {
        Self {
            rows: ArrayVec::new(),
            activation_distance,
        }
    }

    /// What is farther than this is not taken, m.
    pub(super) fn within(&self) -> f64 {
        if self.rows.is_full() {
            self.farthest().map_or(0.0, |(_, gap)| gap)
        } else {
            self.activation_distance
        }
    }

    pub(super) fn offer(&mut self, row: Row, t: u32) {
        if let Err(full) = self.rows.try_push((row, t))
            && let Some((farthest, gap)) = self.farthest()
            && row.gap < gap
        {
            self.rows[farthest] = full.element();
        }
    }

    pub(super) fn rows(&self) -> impl Iterator<Item = &(Row, u32)> {
        self.rows.iter()
    }

    fn farthest(&self) -> Option<(usize, f64)> {
        let gaps = self.rows.iter().map(|(row, _)| row.gap).enumerate();
        gaps.max_by(|(_, a), (_, b)| a.total_cmp(b))
    }
}
