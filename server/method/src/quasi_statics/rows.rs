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

mod near;
mod preparation;

use pulp::{Arch, Simd, WithSimd};

use super::half_space::HalfSpace;
use super::metric::Metric;
use crate::spatial::Vector6;
use preparation::{Found, NEVER_VIOLATED, Preparation};

/// Rows per block: one AVX register, or two SSE2 registers, per component.
pub(crate) const LANES: usize = 4;

/// One component of the rows of a block.
pub(crate) type Lanes = [f64; LANES];

/// Aligned to cache lines: a vector that lies across two of them costs twice.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
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
    processor: Arch,
}

impl Rows {
    pub(crate) fn with_capacity(max_rows: usize) -> Rows {
        Rows {
            blocks: Vec::with_capacity(max_rows.div_ceil(LANES)),
            len: 0,
            max_rows,
            has_positive_bound: false,
            has_impossible_row: false,
            processor: Arch::new(),
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
        let mut found = Found::default();
        self.processor.dispatch(Preparation {
            metric,
            rows,
            blocks: &mut self.blocks,
            found: &mut found,
        });
        if !found.all_finite() {
            self.blocks.clear();
            return Prepared::NotFinite;
        }
        self.len = rows.len();
        self.has_positive_bound = found.largest_bound.iter().any(|b| *b > 0.0);
        self.has_impossible_row = found.impossible_row;
        Prepared::Ready
    }

    /// The same rows. No allocation where there is room for them; the capacity grows to that of the source.
    pub(crate) fn copy_from(&mut self, source: &Self) {
        self.blocks.clone_from(&source.blocks);
        self.len = source.len;
        self.max_rows = self.max_rows.max(source.max_rows);
        self.has_positive_bound = source.has_positive_bound;
        self.has_impossible_row = source.has_impossible_row;
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
            block.bound[row % LANES] = bound * (1.0 / block.length[row % LANES]);
            // Never taken back: who says that there is no answer is believed a little longer, and checked all the same.
            self.has_positive_bound |= bound > 0.0;
        }
    }

    /// The row that `acceleration` violates most and its violation, a length in the metric; (0, -infinity) without rows.
    /// Bounds above `ceiling` count as `ceiling`.
    #[inline]
    pub(crate) fn most_violated(&self, acceleration: &Vector6, ceiling: f64) -> (usize, f64) {
        self.processor.dispatch(MostViolated {
            blocks: &self.blocks,
            acceleration,
            ceiling,
        })
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

/// Finds the row that is violated most.
struct MostViolated<'a> {
    blocks: &'a [Block],
    acceleration: &'a Vector6,
    ceiling: f64,
}

impl WithSimd for MostViolated<'_> {
    type Output = (usize, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> (usize, f64) {
        let mut worst = [f64::NEG_INFINITY; LANES];
        // The block's index as a double: comparison and selection stay in one kind of register.
        let mut at = [0.0_f64; LANES];
        let mut index = 0.0;
        for block in self.blocks {
            let violation = block.violations(self.acceleration, self.ceiling);
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
}

impl Block {
    /// Rows of these lengths, made unit.
    #[inline(always)]
    fn new(mut jacobian: [Lanes; 6], mut bound: Lanes, length: Lanes) -> Block {
        let scale = length.map(|length| 1.0 / length);
        for values in jacobian.iter_mut().chain([&mut bound]) {
            for k in 0..LANES {
                values[k] *= scale[k];
            }
        }
        Block {
            jacobian,
            bound,
            length,
        }
    }

    #[inline(always)]
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
