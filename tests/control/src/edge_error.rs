//! How far a force is from the ideal one, in just-noticeable differences.
//!
//! | symbol | name in code  | unit | meaning                                                                          |
//! |--------|---------------|------|----------------------------------------------------------------------------------|
//! | J      | [`jnd`]       | –    | largest of: angle over 18.4°, force over 7 %, torque over 12.7 %                    |
//!
//! Percentages are of the ideal's magnitude where that was measured, and of the smallest such magnitude below it: 0.1 N stands
//! for 7 % of forces below 1.4 N, 7.6 mN m for 12.7 % of torques below 60 mN m. So a force where there should be none counts, too.
//! Sources: direction, Barbagli et al. (congruent vision); force, Pang, Tan and Durlach 1991; torque, Jandura and Srinivasan 1994.

use god_object::spatial::{angular, linear};
use nalgebra::Vector6;

/// Just-noticeable change of a force's direction, rad.
const DIRECTION: f64 = 18.4 / 180.0 * std::f64::consts::PI;
/// Just-noticeable change of a force's magnitude, as a share of it.
const FORCE: f64 = 0.07;
/// The least change of a force that counts, N.
const LEAST_FORCE: f64 = 0.1;
/// Just-noticeable change of a torque, as a share of it.
const TORQUE: f64 = 0.127;
/// The torque at which that was measured, N m.
const MEASURED_TORQUE: f64 = 0.06;
/// A force below this has no direction that is felt, N.
const DIRECTED: f64 = 0.1;

/// The error of `wrench` against `ideal` in just-noticeable differences.
pub fn jnd(wrench: &Vector6<f64>, ideal: &Vector6<f64>) -> f64 {
    let (force, right) = (linear(wrench), linear(ideal));
    let (torque, right_torque) = (angular(wrench), angular(ideal));
    let by_force = (force.norm() - right.norm()).abs() / (FORCE * right.norm()).max(LEAST_FORCE);
    let by_torque =
        (torque - right_torque).norm() / (TORQUE * right_torque.norm().max(MEASURED_TORQUE));
    let directed = force.norm() > DIRECTED && right.norm() > DIRECTED;
    let by_direction = if directed {
        force.angle(&right) / DIRECTION
    } else {
        0.0
    };
    by_force.max(by_torque).max(by_direction)
}

/// How something was distributed over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantiles {
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

impl Quantiles {
    /// Of `values`, which are put in order; zeros for none.
    pub fn of(values: &mut [f64]) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| {
            let last = values.len().saturating_sub(1);
            let place = (share * last as f64).round() as usize;
            values.get(place).copied().unwrap_or(0.0)
        };
        Self {
            p50: at(0.5),
            p95: at(0.95),
            p99: at(0.99),
            max: at(1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_just_noticeable_difference_is_one() {
        let force =
            |f: f64, angle: f64| Vector6::new(f * angle.cos(), f * angle.sin(), 0.0, 0.0, 0.0, 0.0);
        assert!((jnd(&force(5.0, DIRECTION), &force(5.0, 0.0)) - 1.0).abs() < 1e-9);
        assert!((jnd(&force(5.35, 0.0), &force(5.0, 0.0)) - 1.0).abs() < 1e-9);
        assert!((jnd(&force(0.1, 0.0), &Vector6::zeros()) - 1.0).abs() < 1e-9);
        let torque = |t: f64| Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, t);
        assert!((jnd(&torque(0.1127), &torque(0.1)) - 1.0).abs() < 1e-9);
        assert_eq!(jnd(&force(3.0, 1.0), &force(3.0, 1.0)), 0.0);
    }

    #[test]
    fn quantiles_are_those_of_the_values() {
        let mut values: Vec<f64> = (0..=100).rev().map(f64::from).collect();
        let q = Quantiles::of(&mut values);
        assert_eq!((q.p50, q.p95, q.p99, q.max), (50.0, 95.0, 99.0, 100.0));
        assert_eq!(Quantiles::of(&mut []), Quantiles::default());
    }
}
