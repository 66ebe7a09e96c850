//! At most six rows held at equality, their orthogonal factorisation and their multipliers.
//!
//! | symbol | name in code | meaning                                                                        |
//! |--------|--------------|--------------------------------------------------------------------------------|
//! | N      | `normals`    | 6 x k, columns are the unit normals of the rows held                            |
//! | Q, R   | `q`, `r`     | `N = Q R`, Q has orthonormal columns, R is upper triangular                     |
//! | lambda | `multiplier` | `y = N lambda`; a row pushes only if lambda > 0                                 |
//!
//! Rows are added by Gram-Schmidt done twice and removed by Givens rotations: N is never factorised anew.
//!
//! Source: Goldfarb, Idnani 1983, "A numerically stable dual method for solving strictly convex quadratic programs";
//! Daniel, Gragg, Kaufman, Stewart 1976, for the updates.

use super::least_distance::LeastDistance;
use super::projection::MAX_ACTIVE;
use crate::spatial::Vector6;

/// A row whose normal lies nearer than this to the span of the rows held (sine of the angle) is dependent on them.
/// The vertex of a slit narrower than this is 1e10 times farther away than it is wide: not a place, but rounding of the normals.
pub(crate) const DEPENDENT_SINE: f64 = 1e-10;

/// A coefficient of a dependent row is noise below this, relative to the largest one. Only its sign matters: a row that
/// noise made blocking would hand an arbitrary force to the others.
const COEFFICIENT_TOLERANCE: f64 = 1e-9;

/// A normal seen from the working set: `normal = N coefficients + perpendicular`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decomposed {
    /// `Q^T normal`.
    in_basis: [f64; MAX_ACTIVE],
    /// `R^-1 Q^T normal`.
    coefficients: [f64; MAX_ACTIVE],
    pub(crate) perpendicular: Vector6,
    pub(crate) squared: f64,
}

impl Decomposed {
    /// Whether the normal is a combination of the rows held, as far as doubles can tell.
    #[inline]
    pub(crate) fn is_dependent(&self) -> bool {
        self.squared <= DEPENDENT_SINE * DEPENDENT_SINE
    }
}

/// The rows held at equality.
#[derive(Clone, Debug)]
pub(crate) struct WorkingSet {
    len: usize,
    rows: [u32; MAX_ACTIVE],
    multiplier: [f64; MAX_ACTIVE],
    normals: [Vector6; MAX_ACTIVE],
    /// Column k is `q[k]`.
    q: [Vector6; MAX_ACTIVE],
    /// Column k is `r[k]`, of which the first k + 1 entries count.
    r: [[f64; MAX_ACTIVE]; MAX_ACTIVE],
}

impl WorkingSet {
    pub(crate) fn new() -> WorkingSet {
        WorkingSet {
            len: 0,
            rows: [0; MAX_ACTIVE],
            multiplier: [0.0; MAX_ACTIVE],
            normals: [Vector6::zeros(); MAX_ACTIVE],
            q: [Vector6::zeros(); MAX_ACTIVE],
            r: [[0.0; MAX_ACTIVE]; MAX_ACTIVE],
        }
    }

    #[inline]
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    #[inline]
    pub(crate) fn rows(&self) -> &[u32] {
        &self.rows[..self.len]
    }

    #[inline]
    pub(crate) fn multipliers(&self) -> &[f64] {
        &self.multiplier[..self.len]
    }

    /// Splits `normal` into a combination of the rows held and a rest perpendicular to them.
    #[inline]
    pub(crate) fn decompose(&self, normal: &Vector6) -> Decomposed {
        let mut in_basis = [0.0; MAX_ACTIVE];
        let mut perpendicular = *normal;
        if self.len > 0 {
            // Twice is enough: the second pass removes what the first left by rounding.
            for _ in 0..2 {
                for (k, q) in self.q[..self.len].iter().enumerate() {
                    let along = q.dot(&perpendicular);
                    in_basis[k] += along;
                    perpendicular -= q * along;
                }
            }
        }
        let squared = if self.len < MAX_ACTIVE {
            perpendicular.norm_squared()
        } else {
            0.0 // six rows span everything
        };
        Decomposed {
            in_basis,
            coefficients: self.solve_upper(&in_basis),
            perpendicular,
            squared,
        }
    }

    /// Adds an independent row with its multiplier.
    pub(crate) fn push(&mut self, row: u32, normal: &Vector6, seen: &Decomposed, multiplier: f64) {
        debug_assert!(self.len < MAX_ACTIVE && !seen.is_dependent());
        if self.len == MAX_ACTIVE {
            return;
        }
        let k = self.len;
        let height = seen.squared.sqrt();
        self.rows[k] = row;
        self.multiplier[k] = multiplier;
        self.normals[k] = *normal;
        self.q[k] = seen.perpendicular / height;
        self.r[k] = seen.in_basis;
        self.r[k][k] = height;
        self.len = k + 1;
    }

    /// Drops the row at `position` of the working set.
    pub(crate) fn remove(&mut self, position: usize) {
        for k in position + 1..self.len {
            self.rows[k - 1] = self.rows[k];
            self.multiplier[k - 1] = self.multiplier[k];
            self.normals[k - 1] = self.normals[k];
            self.r[k - 1] = self.r[k];
        }
        self.len -= 1;
        // R lost a column and is upper Hessenberg from there on: rotate each subdiagonal entry away.
        for k in position..self.len {
            let (a, b) = (self.r[k][k], self.r[k][k + 1]);
            let h = a.hypot(b);
            let (cosine, sine) = if h > 0.0 { (a / h, b / h) } else { (1.0, 0.0) };
            for column in &mut self.r[k..self.len] {
                let (x, y) = (column[k], column[k + 1]);
                column[k] = cosine * x + sine * y;
                column[k + 1] = cosine * y - sine * x;
            }
            let (x, y) = (self.q[k], self.q[k + 1]);
            self.q[k] = x * cosine + y * sine;
            self.q[k + 1] = y * cosine - x * sine;
        }
    }

    /// How far the new row's multiplier may grow before one of the rows held stops pushing, and which one that is.
    #[inline]
    pub(crate) fn longest_dual_step(&self, seen: &Decomposed) -> (f64, Option<usize>) {
        // Noise in the coefficients of a dependent row must not make a row block.
        let threshold = if seen.is_dependent() {
            self.coefficient_noise(seen)
        } else {
            0.0
        };
        let mut step = (f64::INFINITY, None);
        for k in 0..self.len {
            let coefficient = seen.coefficients[k];
            if coefficient > threshold && self.multiplier[k] < step.0 * coefficient {
                step = (self.multiplier[k] / coefficient, Some(k));
            }
        }
        step
    }

    #[inline]
    fn coefficient_noise(&self, seen: &Decomposed) -> f64 {
        let largest = seen.coefficients[..self.len]
            .iter()
            .fold(0.0_f64, |l, c| l.max(c.abs()));
        COEFFICIENT_TOLERANCE * largest
    }

    /// Moves the multipliers of the rows held while that of the new row grows by `step`.
    #[inline]
    pub(crate) fn take_dual_step(&mut self, seen: &Decomposed, step: f64) {
        for k in 0..self.len {
            let moved = self.multiplier[k] - step * seen.coefficients[k];
            self.multiplier[k] = moved.max(0.0);
        }
    }

    /// Gives the force `force` of a dependent row to the rows held, as much of it as leaves none of them pulling.
    /// `None` if they took all; else what they took, and the position of the row that has no force left.
    pub(crate) fn take_over(&mut self, seen: &Decomposed, force: f64) -> Option<(f64, usize)> {
        let noise = self.coefficient_noise(seen);
        let mut taken = (force, None);
        for k in 0..self.len {
            let coefficient = seen.coefficients[k];
            if coefficient < -noise && self.multiplier[k] < -coefficient * taken.0 {
                taken = (self.multiplier[k] / -coefficient, Some(k));
            }
        }
        self.take_dual_step(seen, -taken.0);
        taken.1.map(|position| (taken.0, position))
    }

    /// The shortest y that holds every row of the set at equality; sets the multipliers, of either sign.
    ///
    /// Computed from the problem, not from the path there, and refined once: rounding of the steps does not pile up.
    pub(crate) fn solve_equalities(&mut self, problem: &LeastDistance) -> Vector6 {
        let k = self.len;
        let mut target = [0.0; MAX_ACTIVE];
        for (t, row) in target.iter_mut().zip(self.rows()) {
            *t = problem.offset(*row as usize);
        }
        // R^T w = h, y = Q w, R lambda = w.
        let mut w = self.solve_transposed(&target);
        let mut y = self.combine_basis(&w);
        let mut rest = [0.0; MAX_ACTIVE];
        for i in 0..k {
            rest[i] = target[i] - self.normals[i].dot(&y);
        }
        let correction = self.solve_transposed(&rest);
        for (w, correction) in w.iter_mut().zip(&correction) {
            *w += correction;
        }
        y = self.combine_basis(&w);

        self.multiplier = self.solve_upper(&w);
        let mut unexplained = y;
        for i in 0..k {
            unexplained -= self.normals[i] * self.multiplier[i];
        }
        let mut in_basis = [0.0; MAX_ACTIVE];
        for (x, q) in in_basis.iter_mut().zip(&self.q[..k]) {
            *x = q.dot(&unexplained);
        }
        let correction = self.solve_upper(&in_basis);
        for (multiplier, correction) in self.multiplier.iter_mut().zip(&correction) {
            *multiplier += correction;
        }
        y
    }

    /// [`WorkingSet::solve_equalities`], dropping rows that pull until every one left pushes. Returns y.
    pub(crate) fn settle(&mut self, problem: &LeastDistance) -> Vector6 {
        // Each round drops a row: at most six.
        while self.len > 0 {
            let y = self.solve_equalities(problem);
            let mut weakest = (0.0, None);
            for (k, multiplier) in self.multipliers().iter().enumerate() {
                let pushes = *multiplier > 0.0; // false for NaN
                if !pushes && (*multiplier < weakest.0 || weakest.1.is_none()) {
                    weakest = (*multiplier, Some(k));
                }
            }
            match weakest.1 {
                Some(k) => self.remove(k),
                None => return y,
            }
        }
        Vector6::zeros()
    }

    /// `R x = b`.
    #[inline]
    fn solve_upper(&self, b: &[f64; MAX_ACTIVE]) -> [f64; MAX_ACTIVE] {
        let mut x = *b;
        for k in (0..self.len).rev() {
            x[k] /= self.r[k][k];
            for i in 0..k {
                x[i] -= self.r[k][i] * x[k];
            }
        }
        x
    }

    /// `R^T x = b`.
    #[inline]
    fn solve_transposed(&self, b: &[f64; MAX_ACTIVE]) -> [f64; MAX_ACTIVE] {
        let mut x = *b;
        for k in 0..self.len {
            for i in 0..k {
                x[k] -= self.r[k][i] * x[i];
            }
            x[k] /= self.r[k][k];
        }
        x
    }

    #[inline]
    fn combine_basis(&self, w: &[f64; MAX_ACTIVE]) -> Vector6 {
        let mut y = Vector6::zeros();
        for (q, w) in self.q[..self.len].iter().zip(w) {
            y += q * *w;
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quasi_statics::half_space::HalfSpace;
    use crate::quasi_statics::least_distance::{Bounds, Loaded};
    use crate::quasi_statics::metric::Metric;
    use nalgebra::Matrix3;

    /// Six skew rows, each violated by zero acceleration.
    fn problem() -> LeastDistance {
        let rows: Vec<HalfSpace> = (0..6_u32)
            .map(|i| HalfSpace {
                jacobian: Vector6::from_fn(|k, _| {
                    f64::from(i * i + 1).sin() + f64::from(u8::from(k == i as usize))
                }),
                bound: 1.0 + 0.1 * f64::from(i),
            })
            .collect();
        let metric = Metric::new(1.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let mut problem = LeastDistance::with_capacity(6);
        let loaded = problem.load(&metric, &Vector6::zeros(), &rows, Bounds::AsGiven);
        assert_eq!(loaded, Loaded::Ready);
        problem
    }

    fn hold(problem: &LeastDistance, rows: &[u32]) -> WorkingSet {
        let mut set = WorkingSet::new();
        for row in rows {
            let normal = problem.normal(*row as usize);
            let seen = set.decompose(&normal);
            assert!(!seen.is_dependent());
            set.push(*row, &normal, &seen, 0.0);
        }
        set
    }

    #[test]
    fn rows_held_are_met_exactly_whatever_was_removed_before() {
        let problem = problem();
        for removed in 0..6 {
            let mut set = hold(&problem, &[0, 1, 2, 3, 4, 5]);
            set.remove(removed);
            let y = set.solve_equalities(&problem);
            assert_eq!(set.len(), 5);
            let mut force = Vector6::zeros();
            for (row, multiplier) in set.rows().iter().zip(set.multipliers()) {
                assert!(problem.violation(*row as usize, &y).abs() < 1e-13);
                force += problem.normal(*row as usize) * *multiplier;
            }
            assert!((force - y).norm() < 1e-12, "removed {removed}");
        }
    }

    #[test]
    fn a_row_held_already_is_dependent_and_the_seventh_always() {
        let problem = problem();
        let set = hold(&problem, &[0, 1, 2]);
        assert!(set.decompose(&problem.normal(1)).is_dependent());
        assert!(!set.decompose(&problem.normal(3)).is_dependent());
        let full = hold(&problem, &[0, 1, 2, 3, 4, 5]);
        assert!(full.decompose(&Vector6::x()).is_dependent());
    }

    #[test]
    fn settling_leaves_only_rows_that_push() {
        let problem = problem();
        let mut set = hold(&problem, &[5, 4, 3, 2, 1, 0]);
        let y = set.settle(&problem);
        assert!(set.multipliers().iter().all(|m| *m > 0.0));
        for row in set.rows() {
            assert!(problem.violation(*row as usize, &y).abs() < 1e-13);
        }
    }
}
