//! The projection as a least-distance problem, with rows of unit length.
//!
//! | symbol | name in code              | meaning                                                                  |
//! |--------|---------------------------|--------------------------------------------------------------------------|
//! | y      | (the unknown)             | `L^T (a - a_u)`, the correction in coordinates where the metric is one    |
//! | n_k    | [`LeastDistance::normal`] | `L^-1 j_k / |L^-1 j_k|`, unit                                             |
//! | h_k    | [`LeastDistance::offset`] | `(b_k - j_k . a_u) / |L^-1 j_k|`, how deep `a_u` violates row k           |
//!
//! `min |y|^2 / 2` subject to `n_k . y >= h_k`. All lengths share one unit, that of the metric.
//! Rows lie in blocks of [`LANES`], one array per component, so that one scan is a few vector instructions per row.

use super::half_space::HalfSpace;
use super::metric::{Metric, scaled_norm};
use crate::spatial::Vector6;

/// Rows per block: one AVX register, or two SSE2 registers, per component.
const LANES: usize = 4;

/// A row of length below this is a zero row: its direction is noise. Smallest normal double.
const ZERO_ROW: f64 = f64::MIN_POSITIVE;

#[derive(Clone, Copy, Debug)]
struct Block {
    normal: [[f64; LANES]; 6],
    offset: [f64; LANES],
    /// Length of the row before normalisation; multipliers are divided by it on the way out.
    length: [f64; LANES],
}

/// Rows that can never be violated: padding, and zero rows that hold.
const NEVER_VIOLATED: Block = Block {
    normal: [[0.0; LANES]; 6],
    offset: [f64::NEG_INFINITY; LANES],
    length: [1.0; LANES],
};

/// How [`LeastDistance::load`] takes the bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bounds {
    AsGiven,
    /// `min(b, 0)`: zero satisfies them all, so that there is an answer.
    Clipped,
}

impl Bounds {
    #[inline]
    pub(crate) fn apply(self, bound: f64) -> f64 {
        match self {
            Bounds::AsGiven => bound,
            Bounds::Clipped => bound.min(0.0),
        }
    }
}

/// What [`LeastDistance::load`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Loaded {
    Ready,
    NotFinite,
    TooManyRows,
    /// A zero row demands more than zero.
    Infeasible,
}

/// The problem in its own coordinates; storage is reserved once.
#[derive(Clone, Debug)]
pub(crate) struct LeastDistance {
    blocks: Vec<Block>,
    rows: usize,
    max_rows: usize,
    scale: f64,
    has_positive_bound: bool,
}

impl LeastDistance {
    pub(crate) fn with_capacity(max_rows: usize) -> LeastDistance {
        LeastDistance {
            blocks: Vec::with_capacity(max_rows.div_ceil(LANES)),
            rows: 0,
            max_rows,
            scale: 0.0,
            has_positive_bound: false,
        }
    }

    /// Takes a problem in. No allocation: more rows than the capacity are refused.
    pub(crate) fn load(
        &mut self,
        metric: &Metric,
        unconstrained: &Vector6,
        rows: &[HalfSpace],
        bounds: Bounds,
    ) -> Loaded {
        self.blocks.clear();
        self.rows = 0;
        self.has_positive_bound = false;
        if !unconstrained.iter().all(|x| x.is_finite()) {
            return Loaded::NotFinite;
        }
        if rows.len() > self.max_rows {
            return Loaded::TooManyRows;
        }
        self.scale = metric.norm(unconstrained);
        self.rows = rows.len();

        let mut feasible = true;
        for chunk in rows.chunks(LANES) {
            let mut block = NEVER_VIOLATED;
            for (lane, row) in chunk.iter().enumerate() {
                if !row.is_finite() {
                    return Loaded::NotFinite;
                }
                let bound = bounds.apply(row.bound);
                self.has_positive_bound |= bound > 0.0;
                let whitened = metric.whiten_row(&row.jacobian);
                let length = scaled_norm(&whitened);
                if length < ZERO_ROW {
                    feasible &= bound <= 0.0;
                    continue;
                }
                for (component, x) in block.normal.iter_mut().zip(whitened.iter()) {
                    component[lane] = x / length;
                }
                block.offset[lane] = (bound - row.jacobian.dot(unconstrained)) / length;
                block.length[lane] = length;
            }
            self.blocks.push(block);
        }
        if feasible {
            Loaded::Ready
        } else {
            Loaded::Infeasible
        }
    }

    /// Number of rows, ignored ones included: row k here is row k of the call.
    #[inline]
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// `|a_u|_M`.
    #[inline]
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    /// Whether some row forbids to stay; only then may the problem be infeasible.
    #[inline]
    pub(crate) fn has_positive_bound(&self) -> bool {
        self.has_positive_bound
    }

    #[inline]
    pub(crate) fn normal(&self, row: usize) -> Vector6 {
        let block = &self.blocks[row / LANES];
        Vector6::from_fn(|i, _| block.normal[i][row % LANES])
    }

    #[inline]
    pub(crate) fn offset(&self, row: usize) -> f64 {
        self.blocks[row / LANES].offset[row % LANES]
    }

    #[inline]
    pub(crate) fn length(&self, row: usize) -> f64 {
        self.blocks[row / LANES].length[row % LANES]
    }

    /// Whether row k can bind at all; zero rows cannot.
    #[inline]
    pub(crate) fn can_bind(&self, row: usize) -> bool {
        row < self.rows && self.offset(row) > f64::NEG_INFINITY
    }

    /// `h_k - n_k . y`, how deep `y` violates row k.
    #[inline]
    pub(crate) fn violation(&self, row: usize, y: &Vector6) -> f64 {
        self.offset(row) - self.normal(row).dot(y)
    }

    /// The most violated row and its violation; (0, -infinity) without rows.
    #[inline]
    pub(crate) fn most_violated(&self, y: &Vector6) -> (usize, f64) {
        let mut worst = [f64::NEG_INFINITY; LANES];
        // The block's index as a double: comparison and selection stay in one kind of register.
        let mut at = [0.0_f64; LANES];
        let mut index = 0.0;
        for block in &self.blocks {
            let violation = block.violations(y);
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
    pub(crate) fn first_violated(&self, y: &Vector6, tolerance: f64) -> (usize, f64) {
        for (index, block) in self.blocks.iter().enumerate() {
            let violation = block.violations(y);
            if let Some(lane) = violation.iter().position(|v| *v > tolerance) {
                return (index * LANES + lane, violation[lane]);
            }
        }
        (0, f64::NEG_INFINITY)
    }
}

impl Block {
    #[inline]
    fn violations(&self, y: &Vector6) -> [f64; LANES] {
        let mut violation = self.offset;
        for (component, y) in self.normal.iter().zip(y.iter()) {
            for lane in 0..LANES {
                violation[lane] -= component[lane] * y;
            }
        }
        violation
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    fn row(x: f64, z: f64, bound: f64) -> HalfSpace {
        HalfSpace {
            jacobian: Vector6::new(x, 0.0, z, 0.0, 0.0, 0.0),
            bound,
        }
    }

    #[test]
    fn rows_become_unit_and_keep_their_index() {
        let metric = Metric::new(4.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let rows = [
            row(0.0, 0.0, -1.0),
            row(1e-200, 0.0, 0.0),
            row(0.0, 3.0, 3.0),
            row(3.0, 4.0, 0.0),
            row(0.0, 1e200, 0.0),
        ];
        let mut problem = LeastDistance::with_capacity(5);
        let unconstrained = Vector6::new(0.0, 0.0, -1.0, 0.0, 0.0, 0.0);
        let loaded = problem.load(&metric, &unconstrained, &rows, Bounds::AsGiven);
        assert_eq!(loaded, Loaded::Ready);
        assert!(!problem.can_bind(0) && (1..5).all(|k| problem.can_bind(k)));
        for k in 1..5 {
            assert!((problem.normal(k).norm() - 1.0).abs() < 1e-15, "row {k}");
        }
        // Row 2 asks z >= 1 of a_u = -z: two metres, times the root of the mass.
        assert_eq!(problem.most_violated(&Vector6::zeros()), (2, 4.0));
        assert_eq!(problem.first_violated(&Vector6::zeros(), 3.0), (2, 4.0));
        assert_eq!(problem.first_violated(&Vector6::zeros(), 1.0).0, 2);
        assert!(problem.has_positive_bound());
    }

    #[test]
    fn unusable_problems_are_named() {
        let metric = Metric::new(1.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let mut problem = LeastDistance::with_capacity(1);
        let mut load = |a: f64, rows: &[HalfSpace]| {
            problem.load(&metric, &Vector6::repeat(a), rows, Bounds::AsGiven)
        };
        assert_eq!(load(f64::NAN, &[]), Loaded::NotFinite);
        assert_eq!(load(0.0, &[row(f64::NAN, 0.0, 0.0)]), Loaded::NotFinite);
        assert_eq!(load(0.0, &[row(0.0, 0.0, 1.0)]), Loaded::Infeasible);
        assert_eq!(load(0.0, &[row(0.0, 0.0, 0.0)]), Loaded::Ready);
        assert_eq!(load(0.0, &[row(1.0, 0.0, 0.0); 2]), Loaded::TooManyRows);
    }
}
