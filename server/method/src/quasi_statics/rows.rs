//! The rows of a constraint set, prepared once for as many projections as the set serves.
//!
//! | symbol | name in code | meaning                                                                               |
//! |--------|--------------|---------------------------------------------------------------------------------------|
//! | `|c_k|`| `length`     | `|L^-1 j_k|`, length of row k in the metric                                           |
//! |        | `jacobian`   | `j_k / |c_k|`: its product with an acceleration is a length in the metric             |
//! |        | `bound`      | `b_k / |c_k|`                                                                         |
//!
//! Rows lie in blocks of [`LANES`], one array per component, so that preparing and scanning them is a few vector
//! instructions per row. The rows keep the coordinates they were given in: a scan measures the acceleration that is answered,
//! not its picture in other coordinates.

use super::half_space::HalfSpace;
use super::metric::{Metric, scaled_norm};
use crate::spatial::Vector6;

/// Rows per block: one AVX register, or two SSE2 registers, per component.
pub(crate) const LANES: usize = 4;

/// One component of the rows of a block.
pub(crate) type Lanes = [f64; LANES];

/// A row of length below this is a zero row: its direction is noise. Smallest normal double.
const ZERO_ROW: f64 = f64::MIN_POSITIVE;

/// The bound of rows that can never be violated: padding, and zero rows that hold.
const NEVER_VIOLATED: f64 = f64::MIN;

/// Fills the last block.
const PADDING: HalfSpace = HalfSpace {
    jacobian: Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    bound: NEVER_VIOLATED,
};

/// Squared lengths between these neither overflowed nor lost digits.
const SAFE_SQUARES: (f64, f64) = (1e-240, 1e240);

#[derive(Clone, Copy, Debug)]
struct Block {
    jacobian: [Lanes; 6],
    bound: Lanes,
    length: Lanes,
}

/// What [`Rows::prepare`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Prepared {
    Ready,
    NotFinite,
    TooManyRows,
}

/// The rows; storage is reserved once.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    blocks: Vec<Block>,
    len: usize,
    max_rows: usize,
    has_positive_bound: bool,
    has_impossible_row: bool,
}

impl Rows {
    pub(crate) fn with_capacity(max_rows: usize) -> Rows {
        Rows {
            blocks: Vec::with_capacity(max_rows.div_ceil(LANES)),
            len: 0,
            max_rows,
            has_positive_bound: false,
            has_impossible_row: false,
        }
    }

    /// Takes rows in. No allocation: more rows than the capacity are refused.
    pub(crate) fn prepare(&mut self, metric: &Metric, rows: &[HalfSpace]) -> Prepared {
        self.blocks.clear();
        self.len = 0;
        self.has_positive_bound = false;
        self.has_impossible_row = false;
        if rows.len() > self.max_rows {
            return Prepared::TooManyRows;
        }
        let mut finite = true;
        let (whole, rest) = rows.as_chunks::<LANES>();
        for chunk in whole {
            finite &= self.push_block(metric, chunk);
        }
        if !rest.is_empty() {
            let mut last = [PADDING; LANES];
            last[..rest.len()].copy_from_slice(rest);
            finite &= self.push_block(metric, &last);
        }
        if !finite {
            self.blocks.clear();
            return Prepared::NotFinite;
        }
        self.len = rows.len();
        Prepared::Ready
    }

    /// Appends four rows; says whether all their numbers are finite.
    #[inline]
    fn push_block(&mut self, metric: &Metric, rows: &[HalfSpace; LANES]) -> bool {
        let mut block = Block {
            jacobian: std::array::from_fn(|i| std::array::from_fn(|k| rows[k].jacobian[i])),
            bound: std::array::from_fn(|k| rows[k].bound),
            length: [1.0; LANES],
        };
        // 0 x is NaN for an infinite or undefined x; one comparison for a whole row.
        let mut probe = [0.0; LANES];
        for values in block.jacobian.iter().chain([&block.bound]) {
            for k in 0..LANES {
                probe[k] += values[k] * 0.0;
            }
        }
        let squares = metric.squared_row_lengths(&block.jacobian);
        let mut safe = true;
        let mut finite = true;
        for k in 0..LANES {
            finite &= probe[k] == 0.0;
            safe &= (squares[k] > SAFE_SQUARES.0) & (squares[k] < SAFE_SQUARES.1);
            self.has_positive_bound |= block.bound[k] > 0.0;
            block.length[k] = squares[k].sqrt();
        }
        if !safe {
            self.measure_extreme_rows(metric, &mut block);
        }
        let mut scale = [0.0; LANES];
        for k in 0..LANES {
            scale[k] = 1.0 / block.length[k];
            block.bound[k] *= scale[k];
        }
        for component in &mut block.jacobian {
            for k in 0..LANES {
                component[k] *= scale[k];
            }
        }
        self.blocks.push(block);
        finite
    }

    /// Lengths near the ends of the number range, and rows without any.
    #[cold]
    #[inline(never)]
    fn measure_extreme_rows(&mut self, metric: &Metric, block: &mut Block) {
        for k in 0..LANES {
            let row = Vector6::from_fn(|i, _| block.jacobian[i][k]);
            let length = scaled_norm(&metric.whiten_row(&row));
            if length >= ZERO_ROW {
                block.length[k] = length;
            } else {
                self.has_impossible_row |= block.bound[k] > 0.0;
                for component in &mut block.jacobian {
                    component[k] = 0.0;
                }
                block.bound[k] = NEVER_VIOLATED;
                block.length[k] = 1.0;
            }
        }
    }

    /// Number of rows, ignored ones included: row k here is row k of the call.
    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Whether some row forbids to stay; only then may the problem be infeasible.
    #[inline]
    pub(crate) fn has_positive_bound(&self) -> bool {
        self.has_positive_bound
    }

    /// Whether a zero row demands more than zero.
    #[inline]
    pub(crate) fn has_impossible_row(&self) -> bool {
        self.has_impossible_row
    }

    /// The row made unit in the metric, still in coordinates of accelerations.
    #[inline]
    pub(crate) fn jacobian(&self, row: usize) -> Vector6 {
        let block = &self.blocks[row / LANES];
        Vector6::from_fn(|i, _| block.jacobian[i][row % LANES])
    }

    /// The bound of that unit row.
    #[inline]
    pub(crate) fn bound(&self, row: usize) -> f64 {
        self.blocks[row / LANES].bound[row % LANES]
    }

    /// The length that the row was given with.
    #[inline]
    pub(crate) fn length(&self, row: usize) -> f64 {
        self.blocks[row / LANES].length[row % LANES]
    }

    /// Whether row k can bind at all; zero rows cannot.
    #[inline]
    pub(crate) fn can_bind(&self, row: usize) -> bool {
        row < self.len && self.bound(row) > NEVER_VIOLATED
    }

    /// Replaces the bound of one row, in the unit that the row was given in. Ignored for zero rows and rows out of range.
    #[inline]
    pub(crate) fn set_bound(&mut self, row: usize, bound: f64) {
        if self.can_bind(row) {
            let block = &mut self.blocks[row / LANES];
            block.bound[row % LANES] = bound / block.length[row % LANES];
            self.has_positive_bound |= bound > 0.0;
        }
    }

    /// The row that `acceleration` violates most and its violation, a length in the metric; (0, -infinity) without rows.
    /// Bounds above `ceiling` count as `ceiling`.
    #[inline]
    pub(crate) fn most_violated(&self, acceleration: &Vector6, ceiling: f64) -> (usize, f64) {
        let mut worst = [f64::NEG_INFINITY; LANES];
        // The block's index as a double: comparison and selection stay in one kind of register.
        let mut at = [0.0_f64; LANES];
        let mut index = 0.0;
        for block in &self.blocks {
            let violation = block.violations(acceleration, ceiling);
            for lane in 0..LANES {
                let deeper = violation[lane] > worst[lane];
                worst[lane] = if deeper { violation[lane] } else { worst[lane] };
                at[lane] = if deeper { index } else { at[lane] };
            }
            index += 1.0;
        }
        let mut best = (0, f64::NEG_INFINITY);
        for lane in 0..LANES {
            if worst[lane] > best.1 {
                best = (at[lane] as usize * LANES + lane, worst[lane]);
            }
        }
        best
    }

    /// The first row violated by more than `tolerance`, and its violation; else (0, -infinity).
    pub(crate) fn first_violated(
        &self,
        acceleration: &Vector6,
        ceiling: f64,
        tolerance: f64,
    ) -> (usize, f64) {
        for (index, block) in self.blocks.iter().enumerate() {
            let violation = block.violations(acceleration, ceiling);
            if let Some(lane) = violation.iter().position(|v| *v > tolerance) {
                return (index * LANES + lane, violation[lane]);
            }
        }
        (0, f64::NEG_INFINITY)
    }
}

impl Block {
    #[inline]
    fn violations(&self, acceleration: &Vector6, ceiling: f64) -> Lanes {
        let mut violation = self.bound;
        for bound in &mut violation {
            *bound = if *bound < ceiling { *bound } else { ceiling };
        }
        for (component, a) in self.jacobian.iter().zip(acceleration.iter()) {
            for lane in 0..LANES {
                violation[lane] -= component[lane] * a;
            }
        }
        violation
    }
}
