//! At most six rows held at equality, their orthogonal factorisation and their multipliers.
//!
//! | symbol | name in code | meaning                                                                        |
//! |--------|--------------|--------------------------------------------------------------------------------|
//! | N      | `normals`    | 6 x k, columns are the unit normals of the rows held                            |
//! | h      | `offsets`    | `N^T y = h` holds them                                                          |
//! | Q      | `q`          | `N = Q R`, orthonormal columns                                                  |
//! | V      | `v`          | `R^-1`, upper triangular, so that `V Q^T` is the pseudo-inverse of N            |
//! | lambda | `multiplier` | `y = N lambda`; a row pushes only if lambda > 0                                 |
//!
//! Rows are added by Gram-Schmidt and removed by rotations of the columns of V and Q: N is factorised anew only when rounding of many
//! updates might have piled up. Columns are padded to eight lanes and absent ones are zero, so that every product is a fixed
//! number of vector instructions.
//!
//! Source: Goldfarb, Idnani 1983, "A numerically stable dual method for solving strictly convex quadratic programs";
//! Daniel, Gragg, Kaufman, Stewart 1976, for the updates.

mod dual_step;

use super::lanes::{Lanes8, add_scaled, combine, dot, products, vector6, widened};
use super::least_distance::LeastDistance;
use super::projection::MAX_ACTIVE;
use crate::spatial::Vector6;

/// A row whose normal lies nearer than this to the span of the rows held (sine of the angle) is dependent on them.
/// The vertex of a slit narrower than this is 1e10 times farther away than it is wide: not a place, but rounding of the normals.
pub(crate) const DEPENDENT_SINE: f64 = 1e-10;

/// A second pass of Gram-Schmidt is needed where the first one leaves less than this of a unit normal, squared: what is lost
/// of orthogonality is one rounding over the length that is left.
const SECOND_PASS_BELOW: f64 = 0.1;

/// Rows added and removed before the factorisation is made anew.
const MAX_UPDATES: u32 = 50;

/// A normal seen from the working set: `normal = N coefficients + perpendicular`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decomposed {
    coefficients: Lanes8,
    perpendicular: Lanes8,
    pub(crate) squared: f64,
}

impl Decomposed {
    /// Whether the normal is a combination of the rows held, as far as doubles can tell.
    #[inline]
    pub(crate) fn is_dependent(&self) -> bool {
        self.squared <= DEPENDENT_SINE * DEPENDENT_SINE
    }

    /// The part of the normal that is perpendicular to the rows held.
    #[inline]
    pub(crate) fn perpendicular(&self) -> Vector6 {
        vector6(&self.perpendicular)
    }
}

/// The rows held at equality.
#[derive(Clone, Debug)]
pub(crate) struct WorkingSet {
    len: usize,
    updates: u32,
    rows: [u32; MAX_ACTIVE],
    multiplier: Lanes8,
    offsets: Lanes8,
    normals: [Lanes8; MAX_ACTIVE],
    /// Column k is `q[k]`.
    q: [Lanes8; MAX_ACTIVE],
    /// Column k is `v[k]`, of which the first k + 1 entries count.
    v: [Lanes8; MAX_ACTIVE],
}

const ZERO: Lanes8 = [0.0; 8];

impl WorkingSet {
    pub(crate) fn new() -> WorkingSet {
        WorkingSet {
            len: 0,
            updates: 0,
            rows: [0; MAX_ACTIVE],
            multiplier: ZERO,
            offsets: ZERO,
            normals: [ZERO; MAX_ACTIVE],
            q: [ZERO; MAX_ACTIVE],
            v: [ZERO; MAX_ACTIVE],
        }
    }

    #[inline]
    pub(crate) fn clear(&mut self) {
        *self = WorkingSet::new();
    }

    #[inline]
    pub(crate) fn rows(&self) -> &[u32] {
        &self.rows[..self.len]
    }

    #[inline]
    pub(crate) fn multipliers(&self) -> &[f64] {
        &self.multiplier[..self.len]
    }

    /// Whether some row held is violated by more than `tolerance` without any correction.
    #[inline]
    pub(crate) fn has_offset_above(&self, tolerance: f64) -> bool {
        self.offsets[..self.len].iter().any(|h| *h > tolerance)
    }

    /// Holds `rows`, in this order, as far as they exist and are independent. What is held already is not factorised anew.
    #[inline]
    pub(crate) fn hold(&mut self, problem: &LeastDistance, rows: &[u32]) {
        let mut same = rows == self.rows() && self.updates < MAX_UPDATES;
        if same {
            for k in 0..self.len {
                let row = self.rows[k] as usize;
                same &= problem.can_bind(row);
                if !same {
                    break;
                }
                same &= widened(&problem.normal(row)) == self.normals[k];
                self.offsets[k] = problem.offset(row);
            }
        }
        if same {
            return;
        }
        self.clear();
        for row in rows.iter().filter(|row| problem.can_bind(**row as usize)) {
            let normal = problem.normal(*row as usize);
            let seen = self.decompose(&normal);
            if !seen.is_dependent() {
                self.push(*row, &normal, problem.offset(*row as usize), &seen, 0.0);
            }
        }
        self.updates = 0;
    }

    /// Splits `normal` into a combination of the rows held and a rest perpendicular to them.
    #[inline]
    pub(crate) fn decompose(&self, normal: &Vector6) -> Decomposed {
        let mut perpendicular = widened(normal);
        let mut in_basis = products(&self.q, &perpendicular);
        perpendicular = add_scaled(&perpendicular, &combine(&self.q, &in_basis), -1.0);
        let mut squared = dot(&perpendicular, &perpendicular);
        if squared < SECOND_PASS_BELOW {
            // Twice is enough: the second pass removes what the first left by rounding.
            let again = products(&self.q, &perpendicular);
            perpendicular = add_scaled(&perpendicular, &combine(&self.q, &again), -1.0);
            in_basis = add_scaled(&in_basis, &again, 1.0);
            squared = dot(&perpendicular, &perpendicular);
        }
        Decomposed {
            coefficients: combine(&self.v, &in_basis),
            perpendicular,
            // Six rows span everything.
            squared: if self.len < MAX_ACTIVE { squared } else { 0.0 },
        }
    }

    /// Adds an independent row with its multiplier.
    #[inline]
    pub(crate) fn push(
        &mut self,
        row: u32,
        normal: &Vector6,
        offset: f64,
        seen: &Decomposed,
        multiplier: f64,
    ) {
        debug_assert!(self.len < MAX_ACTIVE && !seen.is_dependent());
        if self.len == MAX_ACTIVE {
            return;
        }
        let k = self.len;
        let inverse_height = 1.0 / seen.squared.sqrt();
        self.rows[k] = row;
        self.multiplier[k] = multiplier;
        self.offsets[k] = offset;
        self.normals[k] = widened(normal);
        // The new column of R is (Q^T n, height); that of its inverse is (-V Q^T n, 1) / height.
        self.q[k] = add_scaled(&ZERO, &seen.perpendicular, inverse_height);
        self.v[k] = add_scaled(&ZERO, &seen.coefficients, -inverse_height);
        self.v[k][k] = inverse_height;
        self.len = k + 1;
        self.updates += 1;
    }

    /// Drops the row at `position` of the working set.
    pub(crate) fn remove(&mut self, position: usize) {
        let last = self.len - 1;
        // Rotate until the dropped row of V is zero but for the last column; then both can go.
        for k in position..last {
            let (a, b) = (self.v[k][position], self.v[k + 1][position]);
            let h = (a * a + b * b).sqrt();
            let (cosine, sine) = if h > 0.0 { (b / h, a / h) } else { (1.0, 0.0) };
            rotate(&mut self.v, k, cosine, sine);
            rotate(&mut self.q, k, cosine, sine);
        }
        for k in position..last {
            self.rows[k] = self.rows[k + 1];
            self.multiplier[k] = self.multiplier[k + 1];
            self.offsets[k] = self.offsets[k + 1];
            self.normals[k] = self.normals[k + 1];
            for column in &mut self.v[..last] {
                column[k] = column[k + 1];
            }
        }
        for column in &mut self.v[..last] {
            column[last] = 0.0;
        }
        self.multiplier[last] = 0.0;
        self.offsets[last] = 0.0;
        self.normals[last] = ZERO;
        self.q[last] = ZERO;
        self.v[last] = ZERO;
        self.len = last;
        self.updates += 1;
    }

    /// The shortest y that holds every row of the set at equality; sets the multipliers, of either sign.
    ///
    /// Computed from the rows, not from the path there: rounding of the steps does not pile up.
    #[inline]
    pub(crate) fn solve_equalities(&mut self, refinement: Refinement) -> Vector6 {
        // R^T w = h, y = Q w, R lambda = w.
        let mut w = products(&self.v, &self.offsets);
        let mut y = combine(&self.q, &w);
        if refinement == Refinement::Once {
            let rest = add_scaled(&self.offsets, &products(&self.normals, &y), -1.0);
            w = add_scaled(&w, &products(&self.v, &rest), 1.0);
            y = combine(&self.q, &w);
        }
        self.multiplier = combine(&self.v, &w);
        if refinement == Refinement::Once {
            let unexplained = add_scaled(&y, &combine(&self.normals, &self.multiplier), -1.0);
            let correction = combine(&self.v, &products(&self.q, &unexplained));
            self.multiplier = add_scaled(&self.multiplier, &correction, 1.0);
        }
        vector6(&y)
    }

    /// [`WorkingSet::solve_equalities`], dropping rows that pull until every one left pushes. Returns y.
    #[inline]
    pub(crate) fn settle(&mut self, refinement: Refinement) -> Vector6 {
        // Each round drops a row: at most six.
        while self.len > 0 {
            let y = self.solve_equalities(refinement);
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
}

/// How exactly the rows held are met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refinement {
    /// To the rounding of the factorisation.
    None,
    /// One step of iterative refinement against the normals themselves.
    Once,
}

/// Turns columns k and k + 1: the first one loses what the second gains.
#[inline]
fn rotate(columns: &mut [Lanes8; MAX_ACTIVE], k: usize, cosine: f64, sine: f64) {
    let (before, after) = columns.split_at_mut(k + 1);
    for (x, y) in before[k].iter_mut().zip(&mut after[0]) {
        (*x, *y) = (cosine * *x - sine * *y, cosine * *y + sine * *x);
    }
}
