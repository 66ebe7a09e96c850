//! The kinetic metric: the mass matrix of the body, and lengths measured by it.
//!
//! | symbol  | name in code               | unit         | meaning                                           |
//! |---------|----------------------------|--------------|---------------------------------------------------|
//! | M       | [`Metric`]                 | kg, kg m^2   | `diag(m I3, I_G)`, symmetric positive definite    |
//! | L       | (held inside)              |              | Cholesky factor, `M = L L^T`, lower triangular    |
//! | L^T a   | [`Metric::whiten`]         | m kg^(1/2)   | acceleration in coordinates where M is one        |
//! | L^-1 j  | [`Metric::whiten_row`]     |              | row of J in the same coordinates                  |
//! | `|a|_M` | [`Metric::norm`]           | m kg^(1/2)   | `(a^T M a)^(1/2)`                                 |
//!
//! Source: Ortega et al. 2007, Section 4.2; Gauss' principle of least constraint.

use super::rows::{LANES, Lanes};
use crate::spatial::{Vector6, angular, linear, six};
use nalgebra::{Matrix3, Vector3};

/// Largest accepted asymmetry of an inertia tensor, relative to its largest entry: rounding of `R I R^T`, with a margin.
const ASYMMETRY_TOLERANCE: f64 = 1e-9;

/// Smallest accepted pivot of the factorisation of the inertia tensor, relative to its largest entry.
/// A tensor flatter than this is singular in double precision.
const PIVOT_TOLERANCE: f64 = 1e-14;

/// The mass matrix `M = diag(m I3, I_G)` at the reference point, in world axes, with its Cholesky factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metric {
    mass: f64,
    inertia: Matrix3<f64>,
    root_mass: f64,
    inverse_root_mass: f64,
    /// Lower triangular factor of the inertia tensor.
    factor: Matrix3<f64>,
    /// Its inverse, lower triangular as well.
    inverse_factor: Matrix3<f64>,
}

impl Metric {
    /// The metric of a body of `mass` (kg) and inertia tensor about its reference point in world axes (kg m^2).
    ///
    /// `None` unless both are finite, the mass is positive and the tensor is symmetric positive definite.
    pub fn new(mass: f64, inertia_in_world: &Matrix3<f64>) -> Option<Metric> {
        let positive_mass = mass.is_finite() && mass > 0.0; // false for NaN
        if !positive_mass || !inertia_in_world.iter().all(|x| x.is_finite()) {
            return None;
        }
        let largest = inertia_in_world.amax();
        let asymmetry = (inertia_in_world - inertia_in_world.transpose()).amax();
        if asymmetry > ASYMMETRY_TOLERANCE * largest {
            return None;
        }
        let inertia = (inertia_in_world + inertia_in_world.transpose()) * 0.5;
        let factor = cholesky(&inertia, PIVOT_TOLERANCE * largest)?;
        let inverse_factor = inverse_of_lower(&factor);
        let inverse_root_mass = mass.sqrt().recip();
        let usable = inverse_root_mass.is_finite() && inverse_factor.iter().all(|x| x.is_finite());
        usable.then_some(Metric {
            mass,
            inertia,
            root_mass: mass.sqrt(),
            inverse_root_mass,
            factor,
            inverse_factor,
        })
    }

    /// The metric of 1 kg and 1 kg m^2 about every axis: a placeholder before there is a body.
    pub(crate) fn unit() -> Metric {
        Metric {
            mass: 1.0,
            inertia: Matrix3::identity(),
            root_mass: 1.0,
            inverse_root_mass: 1.0,
            factor: Matrix3::identity(),
            inverse_factor: Matrix3::identity(),
        }
    }

    /// How far a motion of length `norm` (m kg^(1/2)) in the metric moves points at most `radius` (m) from the reference point, at most, m.
    pub(crate) fn longest_path(&self, norm: f64, radius: f64) -> f64 {
        norm * self
            .inverse_root_mass
            .hypot(radius * self.inverse_factor.norm())
    }

    /// `M a`: the wrench (N, N m) that gives the acceleration `a`, or the momentum of a twist.
    #[inline]
    pub fn mass_matrix_times(&self, a: &Vector6) -> Vector6 {
        six(&(linear(a) * self.mass), &(self.inertia * angular(a)))
    }

    /// `M^-1 f`: the acceleration that the wrench `f` gives.
    #[inline]
    pub fn inverse_mass_matrix_times(&self, wrench: &Vector6) -> Vector6 {
        self.unwhiten(&self.whiten_row(wrench))
    }

    /// `|a|_M = (a^T M a)^(1/2)`. Neither overflows nor underflows before the result does.
    #[inline]
    pub fn norm(&self, a: &Vector6) -> f64 {
        scaled_norm(&self.whiten(a))
    }

    /// `a^T M b`.
    #[inline]
    pub fn inner(&self, a: &Vector6, b: &Vector6) -> f64 {
        self.whiten(a).dot(&self.whiten(b))
    }

    /// The mass, kg.
    #[inline]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// The inertia tensor about the reference point, world axes, kg m^2.
    #[inline]
    pub fn inertia_in_world(&self) -> &Matrix3<f64> {
        &self.inertia
    }

    /// `L^T a`: the acceleration in coordinates where the metric is Euclidean.
    #[inline]
    pub fn whiten(&self, a: &Vector6) -> Vector6 {
        six(
            &(linear(a) * self.root_mass),
            &transposed_lower_times(&self.factor, &angular(a)),
        )
    }

    /// `L^-T y`: back from those coordinates.
    #[inline]
    pub fn unwhiten(&self, y: &Vector6) -> Vector6 {
        six(
            &(linear(y) * self.inverse_root_mass),
            &transposed_lower_times(&self.inverse_factor, &angular(y)),
        )
    }

    /// `|L^-1 j|^2` for a block of rows, one array per component.
    #[inline(always)]
    pub(crate) fn squared_row_lengths(&self, rows: &[Lanes; 6]) -> Lanes {
        let l = &self.inverse_factor;
        let per_mass = self.inverse_root_mass * self.inverse_root_mass;
        let mut squares = [0.0; LANES];
        for k in 0..LANES {
            let (x, y, z) = (rows[3][k], rows[4][k], rows[5][k]);
            let linear =
                rows[0][k] * rows[0][k] + rows[1][k] * rows[1][k] + rows[2][k] * rows[2][k];
            let first = l.m11 * x;
            let second = l.m21 * x + l.m22 * y;
            let third = l.m31 * x + l.m32 * y + l.m33 * z;
            squares[k] = linear * per_mass + first * first + second * second + third * third;
        }
        squares
    }

    /// `L^-1 j`: a row of J (or a wrench) in the same coordinates, so that `j . a = (L^-1 j) . (L^T a)`.
    #[inline]
    pub fn whiten_row(&self, j: &Vector6) -> Vector6 {
        six(
            &(linear(j) * self.inverse_root_mass),
            &lower_times(&self.inverse_factor, &angular(j)),
        )
    }
}

/// The Euclidean norm, by way of the largest entry where the plain sum of squares leaves the range of doubles.
#[inline]
pub(crate) fn scaled_norm(v: &Vector6) -> f64 {
    let squares = v.norm_squared();
    if squares > SAFE_SQUARES.0 && squares < SAFE_SQUARES.1 {
        return squares.sqrt();
    }
    let largest = v.amax();
    if largest > 0.0 && largest.is_finite() {
        largest * (v / largest).norm()
    } else {
        largest
    }
}

/// Sums of squares between these neither overflowed nor lost digits to underflow.
const SAFE_SQUARES: (f64, f64) = (1e-240, 1e240);

fn cholesky(a: &Matrix3<f64>, smallest_pivot: f64) -> Option<Matrix3<f64>> {
    let mut l = Matrix3::zeros();
    for j in 0..3 {
        let pivot = a[(j, j)] - (0..j).map(|k| l[(j, k)] * l[(j, k)]).sum::<f64>();
        let positive = pivot > smallest_pivot && pivot > 0.0; // false for NaN
        if !positive {
            return None;
        }
        l[(j, j)] = pivot.sqrt();
        for i in j + 1..3 {
            let rest = a[(i, j)] - (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum::<f64>();
            l[(i, j)] = rest / l[(j, j)];
        }
    }
    Some(l)
}

fn inverse_of_lower(l: &Matrix3<f64>) -> Matrix3<f64> {
    let (d0, d1, d2) = (1.0 / l.m11, 1.0 / l.m22, 1.0 / l.m33);
    let below0 = -l.m21 * d0 * d1;
    let below1 = -l.m32 * d1 * d2;
    let corner = -(l.m31 * d0 + l.m32 * below0) * d2;
    Matrix3::new(d0, 0.0, 0.0, below0, d1, 0.0, corner, below1, d2)
}

#[inline]
fn lower_times(l: &Matrix3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(
        l.m11 * v.x,
        l.m21 * v.x + l.m22 * v.y,
        l.m31 * v.x + l.m32 * v.y + l.m33 * v.z,
    )
}

#[inline]
fn transposed_lower_times(l: &Matrix3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(
        l.m11 * v.x + l.m21 * v.y + l.m31 * v.z,
        l.m22 * v.y + l.m32 * v.z,
        l.m33 * v.z,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metric() -> Metric {
        let inertia = Matrix3::new(3e-3, 5e-4, -2e-4, 5e-4, 2e-3, 1e-4, -2e-4, 1e-4, 4e-3);
        Metric::new(1.7, &inertia).expect("the tensor is positive definite")
    }

    #[test]
    fn whitening_turns_the_metric_into_the_euclidean_one() {
        let m = metric();
        let a = Vector6::new(0.3, -0.2, 0.7, 1.1, -0.4, 0.2);
        let b = Vector6::new(-0.1, 0.9, 0.2, 0.3, 0.8, -1.3);
        assert!((m.inner(&a, &b) - a.dot(&m.mass_matrix_times(&b))).abs() < 1e-15);
        assert!((m.norm(&a) - a.dot(&m.mass_matrix_times(&a)).sqrt()).abs() < 1e-15);
        assert!((m.whiten_row(&b).dot(&m.whiten(&a)) - b.dot(&a)).abs() < 1e-14);
        assert!((m.unwhiten(&m.whiten(&a)) - a).norm() < 1e-15);
        let there_and_back = m.inverse_mass_matrix_times(&m.mass_matrix_times(&a));
        assert!((there_and_back - a).norm() < 1e-14);
    }

    #[test]
    fn a_matrix_that_is_no_inertia_is_refused() {
        let good = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0));
        assert!(Metric::new(1.0, &good).is_some());
        for mass in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Metric::new(mass, &good).is_none(), "mass {mass}");
        }
        let mut asymmetric = good;
        asymmetric.m12 = 0.1;
        assert!(Metric::new(1.0, &asymmetric).is_none());
        let mut broken = good;
        broken.m33 = f64::NAN;
        assert!(Metric::new(1.0, &broken).is_none());
        let indefinite = Matrix3::from_diagonal(&Vector3::new(1.0, -2.0, 3.0));
        assert!(Metric::new(1.0, &indefinite).is_none());
        let flat = Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 3.0));
        assert!(Metric::new(1.0, &flat).is_none());
    }

    #[test]
    fn norms_survive_the_ends_of_the_number_range() {
        let v = Vector6::new(3.0, 4.0, 0.0, 0.0, 0.0, 0.0);
        for scale in [1e-300, 1e-170, 1.0, 1e170, 1e300] {
            assert!((scaled_norm(&(v * scale)) / (5.0 * scale) - 1.0).abs() < 1e-15);
        }
        assert_eq!(scaled_norm(&Vector6::zeros()), 0.0);
    }
}
