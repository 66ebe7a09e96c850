//! How optimal an answer is: the Karush-Kuhn-Tucker residuals, from the problem as given.
//!
//! Shares nothing with the projector but the metric: the yardstick for its certificates, and for other solvers.
//!
//! | symbol | meaning                                                                                          |
//! |--------|--------------------------------------------------------------------------------------------------|
//! | c_k    | `L^-1 j_k`, the row in coordinates where the metric is Euclidean                                 |
//! | s_k    | `(j_k . a - b_k) / |c_k|`, slack of row k, a length in the metric                                |
//! | l_k    | `lambda_k |c_k|`, multiplier of row k made unit, in the same unit                                |
//! | scale  | `max(|a_u|_M, |a|_M)`, the problem's size                                                        |
//!
//! With rows of unit length, slacks and multipliers have one unit, and all residuals are divided by `scale`:
//! primal `max(-s_k)`, dual `max(-l_k)`, complementarity `max min(|s_k|, |l_k|)`, stationarity
//! `|L^T (a - a_u) - sum l_k c_k / |c_k||`. That is the force which the rows do not explain, beside the whole: multipliers in a narrow slit are
//! far larger than their sum, and excuse nothing of it.

use super::half_space::HalfSpace;
use super::metric::{Metric, scaled_norm};
use super::projection::ActiveRow;
use crate::spatial::Vector6;

/// The four residuals of an answer, relative to the problem's scale. All are 0 for an exact optimum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KktResidual {
    /// Deepest violation of a row.
    pub primal: f64,
    /// Most negative multiplier.
    pub dual: f64,
    /// Largest force of a row that does not touch.
    pub complementarity: f64,
    /// Part of `M (a - a_u)` that the multipliers do not explain.
    pub stationarity: f64,
}

impl KktResidual {
    /// The largest of the four; infinite if one is not a number.
    pub fn largest(&self) -> f64 {
        let all = [
            self.primal,
            self.dual,
            self.complementarity,
            self.stationarity,
        ];
        if all.iter().any(|x| x.is_nan()) {
            return f64::INFINITY;
        }
        all.into_iter().fold(0.0, f64::max)
    }
}

/// The residuals of the answer `acceleration` with the multipliers `active` (zero for every other row).
///
/// No allocation; one pass over the rows. A zero row counts by its bound, relative to `scale`.
pub fn kkt_residual(
    metric: &Metric,
    unconstrained: &Vector6,
    rows: &[HalfSpace],
    acceleration: &Vector6,
    active: &[ActiveRow],
) -> KktResidual {
    let scale = metric.norm(unconstrained).max(metric.norm(acceleration));

    let mut primal = 0.0_f64;
    for row in rows {
        let slack = row.jacobian.dot(acceleration) - row.bound;
        let inside = slack >= 0.0; // false for NaN
        if !inside {
            // Only a violated row needs its length: most rows cost six multiplications.
            primal = larger(primal, -slack / length(metric, row));
        }
    }

    let mut dual = 0.0_f64;
    let mut complementarity = 0.0_f64;
    let mut unexplained = metric.whiten(&(acceleration - unconstrained));
    for entry in active {
        let Some(row) = rows.get(entry.row as usize) else {
            primal = f64::NAN;
            continue;
        };
        let length = length(metric, row);
        let slack = (row.jacobian.dot(acceleration) - row.bound) / length;
        let multiplier = entry.multiplier * length;
        dual = larger(dual, -multiplier);
        complementarity = larger(complementarity, slack.abs().min(multiplier.abs()));
        unexplained -= metric.whiten_row(&row.jacobian) * entry.multiplier;
    }

    KktResidual {
        primal: ratio(primal, scale),
        dual: ratio(dual, scale),
        complementarity: ratio(complementarity, scale),
        stationarity: ratio(scaled_norm(&unexplained), scale),
    }
}

/// Length of the row in the metric; 1 for a zero row, whose violation is then its bound.
#[inline]
fn length(metric: &Metric, row: &HalfSpace) -> f64 {
    let length = scaled_norm(&metric.whiten_row(&row.jacobian));
    if length > 0.0 { length } else { 1.0 }
}

/// The larger one, but NaN if either is: a broken number must not be lost.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// `residual / scale`, 0 for 0 / 0.
#[inline]
fn ratio(residual: f64, scale: f64) -> f64 {
    if residual == 0.0 {
        0.0
    } else {
        residual / scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    fn floor() -> [HalfSpace; 1] {
        [HalfSpace {
            jacobian: Vector6::new(0.0, 0.0, 2.0, 0.0, 0.0, 0.0),
            bound: 0.0,
        }]
    }

    fn metric() -> Metric {
        Metric::new(4.0, &Matrix3::identity()).expect("a unit tensor is an inertia")
    }

    const PUSH: Vector6 = Vector6::new(1.0, 0.0, -1.0, 0.0, 0.0, 0.0);

    #[test]
    fn the_optimum_has_no_residual() {
        let answer = Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        // J^T lambda = M (a - a_u): 2 lambda = 4.
        let active = [ActiveRow {
            row: 0,
            multiplier: 2.0,
        }];
        let found = kkt_residual(&metric(), &PUSH, &floor(), &answer, &active);
        assert_eq!(found.largest(), 0.0, "{found:?}");
    }

    #[test]
    fn each_kind_of_error_is_seen() {
        let m = metric();
        let answer = Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let one = |multiplier| [ActiveRow { row: 0, multiplier }];
        let violated = kkt_residual(&m, &PUSH, &floor(), &PUSH, &[]);
        assert!(violated.primal > 0.5 && violated.stationarity == 0.0);
        let forgotten = kkt_residual(&m, &PUSH, &floor(), &answer, &[]);
        assert!(forgotten.stationarity > 0.5 && forgotten.primal == 0.0);
        let pulled = kkt_residual(&m, &PUSH, &floor(), &answer, &one(-2.0));
        assert!(pulled.dual > 0.5);
        let lifted = Vector6::new(1.0, 0.0, 1.0, 0.0, 0.0, 0.0);
        let remote = kkt_residual(&m, &PUSH, &floor(), &lifted, &one(4.0));
        assert!(remote.complementarity > 0.5 && remote.stationarity == 0.0);
    }

    /// Two walls that nearly face each other hold by multipliers of ten million: a thousandth of the wish that they do not explain is one of the force.
    #[test]
    fn a_force_that_is_off_between_walls_that_nearly_face_each_other_is_seen() {
        let m = Metric::new(1.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let tilt = 1e-7;
        let wall = |x: f64, z: f64| HalfSpace {
            jacobian: Vector6::new(x, 0.0, z, 0.0, 0.0, 0.0),
            bound: 0.0,
        };
        let walls = [wall(0.0, 1.0), wall(tilt, -1.0)];
        let active = [0, 1].map(|row| ActiveRow {
            row,
            multiplier: 1.0 / tilt,
        });
        let residual = |push: f64| {
            let unconstrained = Vector6::new(-push, 0.0, 0.0, 0.0, 0.0, 0.0);
            kkt_residual(&m, &unconstrained, &walls, &Vector6::zeros(), &active).largest()
        };
        assert!(residual(1.0) < 1e-8, "{}", residual(1.0));
        assert!(residual(1.001) > 9e-4, "{}", residual(1.001));
    }

    #[test]
    fn a_broken_number_or_index_is_an_infinite_residual() {
        let m = metric();
        let broken = kkt_residual(&m, &PUSH, &floor(), &Vector6::repeat(f64::NAN), &[]);
        assert_eq!(broken.largest(), f64::INFINITY);
        let beyond = [ActiveRow {
            row: 7,
            multiplier: 1.0,
        }];
        let found = kkt_residual(&m, &PUSH, &floor(), &Vector6::zeros(), &beyond);
        assert_eq!(found.largest(), f64::INFINITY);
    }
}
