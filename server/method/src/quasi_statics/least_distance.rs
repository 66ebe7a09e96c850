//! The projection as a least-distance problem, with rows of unit length.
//!
//! | symbol | name in code              | meaning                                                                  |
//! |--------|---------------------------|--------------------------------------------------------------------------|
//! | y      | `correction`              | `L^T (a - a_u)`, the correction in coordinates where the metric is one    |
//! | n_k    | [`LeastDistance::normal`] | `L^-1 j_k / |L^-1 j_k|`, unit                                             |
//! | h_k    | [`LeastDistance::offset`] | `(b_k - j_k . a_u) / |L^-1 j_k|`, how deep `a_u` violates row k           |
//!
//! `min |y|^2 / 2` subject to `n_k . y >= h_k`. All lengths share one unit, that of the metric.
//! The rows are prepared once; the normals of the few that come to be held are computed when they are.

use super::half_space::HalfSpace;
use super::metric::Metric;
use super::rows::{Prepared, Rows};
use crate::spatial::Vector6;

/// How the bounds are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bounds {
    AsGiven,
    /// `min(b, 0)`: zero satisfies them all, so that there is an answer.
    Clipped,
}

/// The problem; storage is reserved once.
#[derive(Clone, Debug)]
pub(crate) struct LeastDistance {
    pub(crate) rows: Rows,
    prepared: Prepared,
    metric: Metric,
    unconstrained: Vector6,
    scale: f64,
    /// Bounds count as no more than this.
    ceiling: f64,
}

/// What was measured at a correction. Only [`LeastDistance::scan`] makes one, so that a certificate may rely on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scan {
    acceleration: Vector6,
    row: usize,
    violation: f64,
}

impl Scan {
    /// `a_u + L^-T y`; `a_u` itself, bit for bit, without correction: no force in free space.
    #[inline]
    pub(crate) fn acceleration(&self) -> &Vector6 {
        &self.acceleration
    }

    /// The most violated row.
    #[inline]
    pub(crate) fn row(&self) -> usize {
        self.row
    }

    /// Its violation; negative where every row holds, -infinity without rows.
    #[inline]
    pub(crate) fn violation(&self) -> f64 {
        self.violation
    }
}

impl LeastDistance {
    pub(crate) fn with_capacity(max_rows: usize) -> LeastDistance {
        LeastDistance {
            rows: Rows::with_capacity(max_rows),
            prepared: Prepared::Ready,
            metric: Metric::unit(),
            unconstrained: Vector6::zeros(),
            scale: 0.0,
            ceiling: f64::INFINITY,
        }
    }

    /// Takes metric and rows in; they serve until the next call. No allocation.
    pub(crate) fn prepare(&mut self, metric: &Metric, rows: &[HalfSpace]) -> Prepared {
        self.metric = *metric;
        self.prepared = self.rows.prepare(metric, rows);
        self.prepared
    }

    /// Takes over metric and rows that were prepared elsewhere. No allocation where there is room for them.
    pub(crate) fn copy_from(&mut self, source: &LeastDistance) {
        self.metric = source.metric;
        self.prepared = source.prepared;
        self.rows.copy_from(&source.rows);
    }

    /// Replaces the bound of one row, in the unit that the row was given in.
    #[inline]
    pub(crate) fn set_bound(&mut self, row: usize, bound: f64) {
        if !bound.is_finite() {
            self.prepared = Prepared::NotFinite;
        }
        self.rows.set_bound(row, bound);
    }

    /// How the last preparation ended.
    #[inline]
    pub(crate) fn prepared(&self) -> Prepared {
        self.prepared
    }

    /// Sets what is wished for, and how the bounds are taken.
    #[inline]
    pub(crate) fn aim(&mut self, unconstrained: &Vector6, bounds: Bounds) {
        self.unconstrained = *unconstrained;
        self.scale = self.metric.norm(unconstrained);
        self.ceiling = match bounds {
            Bounds::AsGiven => f64::INFINITY,
            Bounds::Clipped => 0.0,
        };
    }

    #[inline]
    pub(crate) fn metric(&self) -> &Metric {
        &self.metric
    }

    #[inline]
    pub(crate) fn unconstrained(&self) -> &Vector6 {
        &self.unconstrained
    }

    /// `|a_u|_M`.
    #[inline]
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    /// Whether some row forbids to stay; only then may the problem be infeasible.
    #[inline]
    pub(crate) fn has_positive_bound(&self) -> bool {
        self.ceiling > 0.0 && self.rows.has_positive_bound()
    }

    #[inline]
    pub(crate) fn normal(&self, row: usize) -> Vector6 {
        self.metric.whiten_row(&self.rows.jacobian(row))
    }

    #[inline]
    pub(crate) fn offset(&self, row: usize) -> f64 {
        self.violation_at(row, &self.unconstrained)
    }

    /// Whether row k can bind at all; zero rows cannot.
    #[inline]
    pub(crate) fn can_bind(&self, row: usize) -> bool {
        self.rows.can_bind(row)
    }

    /// The length that row k was given with; multipliers are divided by it on the way out.
    #[inline]
    pub(crate) fn length(&self, row: usize) -> f64 {
        self.rows.length(row)
    }

    /// How deep `acceleration` violates row k.
    #[inline]
    pub(crate) fn violation_at(&self, row: usize, acceleration: &Vector6) -> f64 {
        let bound = self.rows.bound(row).min(self.ceiling);
        bound - self.rows.jacobian(row).dot(acceleration)
    }

    /// `a_u + L^-T y`.
    #[inline]
    fn acceleration(&self, y: &Vector6) -> Vector6 {
        if *y == Vector6::zeros() {
            self.unconstrained
        } else {
            self.unconstrained + self.metric.unwhiten(y)
        }
    }

    /// One pass over all rows at `y`: the most violated one.
    #[inline]
    pub(crate) fn scan(&self, y: &Vector6) -> Scan {
        let acceleration = self.acceleration(y);
        let (row, violation) = self.rows.most_violated(&acceleration, self.ceiling);
        Scan {
            acceleration,
            row,
            violation,
        }
    }

    /// The first row that the scanned correction violates by more than `tolerance`, and its violation; else (0, -infinity).
    pub(crate) fn first_violated(&self, scan: &Scan, tolerance: f64) -> (usize, f64) {
        self.rows
            .first_violated(&scan.acceleration, self.ceiling, tolerance)
    }
}

#[cfg(test)]
impl LeastDistance {
    /// A problem of its own, for tests.
    pub(crate) fn of(
        metric: &Metric,
        unconstrained: &Vector6,
        rows: &[HalfSpace],
    ) -> LeastDistance {
        let mut problem = LeastDistance::with_capacity(rows.len());
        assert_eq!(problem.prepare(metric, rows), Prepared::Ready);
        problem.aim(unconstrained, Bounds::AsGiven);
        problem
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
        let unconstrained = Vector6::new(0.0, 0.0, -1.0, 0.0, 0.0, 0.0);
        let problem = LeastDistance::of(&metric, &unconstrained, &rows);
        assert!(!problem.can_bind(0) && (1..5).all(|k| problem.can_bind(k)));
        assert!(!problem.can_bind(5), "padding is no row");
        for k in 1..5 {
            assert!((problem.normal(k).norm() - 1.0).abs() < 1e-15, "row {k}");
        }
        // Row 2 asks z >= 1 of a_u = -z: two metres, times the root of the mass.
        let scan = problem.scan(&Vector6::zeros());
        assert_eq!((scan.row(), scan.violation()), (2, 4.0));
        assert_eq!(scan.acceleration(), &unconstrained);
        assert_eq!(problem.first_violated(&scan, 3.0), (2, 4.0));
        assert_eq!(problem.first_violated(&scan, 1.0).0, 2);
        assert!(problem.has_positive_bound());
    }

    #[test]
    fn clipped_bounds_let_the_body_stay() {
        let metric = Metric::new(1.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let mut problem = LeastDistance::of(&metric, &Vector6::zeros(), &[row(0.0, 1.0, 1.0)]);
        assert_eq!(problem.scan(&Vector6::zeros()).violation(), 1.0);
        problem.aim(&Vector6::zeros(), Bounds::Clipped);
        assert_eq!(problem.scan(&Vector6::zeros()).violation(), 0.0);
        assert!(!problem.has_positive_bound());
    }

    #[test]
    fn a_bound_replaced_is_the_bound_given() {
        let metric = Metric::new(1.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let a_u = Vector6::new(0.0, 0.0, -1.0, 0.0, 0.0, 0.0);
        let given = LeastDistance::of(&metric, &a_u, &[row(0.0, 3.0, -2.0), row(0.0, 0.0, 0.0)]);
        let mut replaced =
            LeastDistance::of(&metric, &a_u, &[row(0.0, 3.0, 0.0), row(0.0, 0.0, 0.0)]);
        for k in 0..5 {
            replaced.rows.set_bound(k, -2.0);
        }
        assert_eq!(given.offset(0), replaced.offset(0));
        assert!(!replaced.can_bind(1));
    }

    #[test]
    fn unusable_rows_are_named() {
        let metric = Metric::new(1.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let mut problem = LeastDistance::with_capacity(1);
        let mut prepare = |rows: &[HalfSpace]| problem.prepare(&metric, rows);
        assert_eq!(prepare(&[row(f64::NAN, 0.0, 0.0)]), Prepared::NotFinite);
        assert_eq!(prepare(&[row(1.0, 0.0, 0.0); 2]), Prepared::TooManyRows);
        assert_eq!(prepare(&[row(0.0, 0.0, 0.0)]), Prepared::Ready);
        assert!(!problem.rows.has_impossible_row());
        assert_eq!(
            problem.prepare(&metric, &[row(0.0, 0.0, 1.0)]),
            Prepared::Ready
        );
        assert!(problem.rows.has_impossible_row());
    }
}
