//! Takes rows in: their lengths in the metric, and what is wrong with them.

use pulp::{Simd, WithSimd};

use super::{Block, LANES, Lanes};
use crate::quasi_statics::half_space::HalfSpace;
use crate::quasi_statics::metric::{Metric, scaled_norm};
use crate::spatial::Vector6;

/// A row of length below this is a zero row: its direction is noise. Smallest normal double.
const ZERO_ROW: f64 = f64::MIN_POSITIVE;

/// The bound of rows that can never be violated: padding, and zero rows that hold.
pub(super) const NEVER_VIOLATED: f64 = f64::MIN;

/// Fills the last block.
const PADDING: HalfSpace = HalfSpace {
    jacobian: Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    bound: NEVER_VIOLATED,
};

/// Squared lengths between these neither overflowed nor lost digits.
const SAFE_SQUARES: (f64, f64) = (1e-240, 1e240);

/// Makes blocks of rows.
pub(super) struct Preparation<'a> {
    pub(super) metric: &'a Metric,
    pub(super) rows: &'a [HalfSpace],
    pub(super) blocks: &'a mut Vec<Block>,
    pub(super) found: &'a mut Found,
}

impl WithSimd for Preparation<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (metric, found) = (self.metric, self.found);
        let (whole, rest) = self.rows.as_chunks::<LANES>();
        for rows in whole {
            self.blocks.push(found.block_of(metric, rows));
        }
        if !rest.is_empty() {
            let mut last = [PADDING; LANES];
            last[..rest.len()].copy_from_slice(rest);
            self.blocks.push(found.block_of(metric, &last));
        }
    }
}

/// What is seen of the rows while they are prepared.
#[derive(Default)]
pub(super) struct Found {
    /// 0 x is NaN for an infinite or undefined x: a sum stands for one comparison each.
    probe: Lanes,
    pub(super) largest_bound: Lanes,
    pub(super) impossible_row: bool,
}

impl Found {
    #[inline(always)]
    fn block_of(&mut self, metric: &Metric, rows: &[HalfSpace; LANES]) -> Block {
        let bound: Lanes = std::array::from_fn(|k| rows[k].bound);
        let jacobian: [Lanes; 6] =
            std::array::from_fn(|i| std::array::from_fn(|k| rows[k].jacobian[i]));
        for (probe, bound) in self.probe.iter_mut().zip(&bound) {
            *probe += bound * 0.0;
        }
        for (largest, bound) in self.largest_bound.iter_mut().zip(&bound) {
            *largest = if *bound > *largest { *bound } else { *largest };
        }
        let squares = metric.squared_row_lengths(&jacobian);
        let mut safe = true;
        for square in squares {
            // False for a row that is not finite.
            safe &= (square > SAFE_SQUARES.0) & (square < SAFE_SQUARES.1);
        }
        if safe {
            Block::new(jacobian, bound, squares.map(f64::sqrt))
        } else {
            // Nothing of the above is handed on: it stays in registers.
            self.extreme_block(metric, rows)
        }
    }

    /// Lengths near the ends of the number range, rows without any, and broken ones.
    #[cold]
    #[inline(never)]
    fn extreme_block(&mut self, metric: &Metric, rows: &[HalfSpace; LANES]) -> Block {
        let mut rows = *rows;
        let mut lengths = [1.0; LANES];
        for (k, row) in rows.iter_mut().enumerate() {
            self.probe[k] += row.jacobian.iter().map(|x| x * 0.0).sum::<f64>();
            let length = scaled_norm(&metric.whiten_row(&row.jacobian));
            if length >= ZERO_ROW {
                lengths[k] = length;
            } else {
                self.impossible_row |= row.bound > 0.0;
                row.jacobian = Vector6::zeros();
                row.bound = NEVER_VIOLATED;
            }
        }
        let jacobian = std::array::from_fn(|i| std::array::from_fn(|k| rows[k].jacobian[i]));
        Block::new(jacobian, rows.map(|row| row.bound), lengths)
    }

    pub(super) fn all_finite(&self) -> bool {
        self.probe.iter().all(|x| *x == 0.0)
    }
}
