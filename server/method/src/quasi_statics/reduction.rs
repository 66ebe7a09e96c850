//! Six rows instead of many: the same force from an independent subset.
//!
//! An interior-point method spreads a force over all rows that can carry it. Here it is moved onto few rows,
//! without changing it and without letting any row pull.
//!
//! Source: Caratheodory 1907, for cones; the exchange is the dual step of Goldfarb, Idnani 1983.

use super::least_distance::LeastDistance;
use super::projection::MAX_ACTIVE;
use super::working_set::WorkingSet;

/// Collects in `set` at most six independent rows whose non-negative combination is that of `forces` (row, multiplier > 0).
pub(crate) fn reduce(
    problem: &LeastDistance,
    forces: impl Iterator<Item = (u32, f64)>,
    set: &mut WorkingSet,
) {
    set.clear();
    for (row, force) in forces {
        let normal = problem.normal(row as usize);
        let mut left = force;
        // Each round but the last lets a row go.
        for _ in 0..=MAX_ACTIVE {
            let seen = set.decompose(&normal);
            if !seen.is_dependent() {
                let offset = problem.offset(row as usize);
                set.push(row, &normal, offset, &seen, left);
                break;
            }
            // n = N c: the rows held take over, up to the whole force, or until one of them has none left.
            match set.take_over(&seen, left) {
                None => break,
                Some((taken, emptied)) => {
                    left -= taken;
                    set.remove(emptied);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quasi_statics::half_space::HalfSpace;
    use crate::quasi_statics::metric::Metric;
    use crate::spatial::Vector6;
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn forty_contacts_on_a_plane_become_three_with_the_same_wrench() {
        let rows: Vec<HalfSpace> = (0..40)
            .map(|i| {
                let angle = 0.7 * f64::from(i);
                let arm = Vector3::new(angle.cos(), (1.3 * angle).sin(), -0.2);
                HalfSpace {
                    jacobian: crate::spatial::six(&Vector3::z(), &arm.cross(&Vector3::z())),
                    bound: 0.0,
                }
            })
            .collect();
        let metric = Metric::new(1.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let problem = LeastDistance::of(&metric, &Vector6::zeros(), &rows);

        let forces = |i: u32| 0.1 + f64::from(i % 7);
        let whole: Vector6 = (0..40)
            .map(|i| problem.normal(i as usize) * forces(i))
            .sum();
        let mut set = WorkingSet::new();
        reduce(&problem, (0..40).map(|i| (i, forces(i))), &mut set);

        assert!(
            set.rows().len() <= 3,
            "normals on a plane span three dimensions"
        );
        assert!(set.multipliers().iter().all(|m| *m >= 0.0));
        let reduced: Vector6 = set
            .rows()
            .iter()
            .zip(set.multipliers())
            .map(|(row, m)| problem.normal(*row as usize) * *m)
            .sum();
        assert!((whole - reduced).norm() < 1e-12 * whole.norm());
    }
}
