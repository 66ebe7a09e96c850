//! Rows held, removed and settled.

use nalgebra::Matrix3;

use super::half_space::HalfSpace;
use super::least_distance::LeastDistance;
use super::metric::Metric;
use super::working_set::*;
use crate::spatial::Vector6;

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
    LeastDistance::of(&metric, &Vector6::zeros(), &rows)
}

fn hold(problem: &LeastDistance, rows: &[u32]) -> WorkingSet {
    let mut set = WorkingSet::new();
    set.hold(problem, rows);
    assert_eq!(set.rows(), rows, "all are independent");
    set
}

#[test]
fn rows_held_are_met_exactly_whatever_was_removed_before() {
    let problem = problem();
    for removed in 0..6 {
        let mut set = hold(&problem, &[0, 1, 2, 3, 4, 5]);
        set.remove(removed);
        let y = set.solve_equalities(Refinement::None);
        assert_eq!(set.rows().len(), 5);
        let mut force = Vector6::zeros();
        for (row, multiplier) in set.rows().iter().zip(set.multipliers()) {
            let row = *row as usize;
            let violation = problem.offset(row) - problem.normal(row).dot(&y);
            assert!(violation.abs() < 1e-13);
            force += problem.normal(row) * *multiplier;
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
    let y = set.settle(Refinement::Once);
    assert!(set.multipliers().iter().all(|m| *m > 0.0));
    for row in set.rows() {
        let row = *row as usize;
        let violation = problem.offset(row) - problem.normal(row).dot(&y);
        assert!(violation.abs() < 1e-13);
    }
}
