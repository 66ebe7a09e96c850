//! The three solvers against each other, against non-negative least squares and against all active sets tried in turn.

use crate::projection_support;

use crate::projection_support::{
    FAMILIES, Random, hand_motion, hand_sized_metric, oracle, project, rows_of,
};
use god_object::quasi_statics::{HalfSpace, Metric, ProjectionStatus, Projector, SolverKind};
use god_object::spatial::Vector6;
use nalgebra::{DMatrix, DVector};

/// The nearest feasible point among those that hold some subset of at most six rows at equality.
fn brute_force(metric: &Metric, a_u: &Vector6, rows: &[HalfSpace]) -> Option<Vector6> {
    let whitened: Vec<Vector6> = rows
        .iter()
        .map(|row| metric.whiten_row(&row.jacobian))
        .collect();
    let size = metric.norm(a_u);
    let mut best: Option<(f64, Vector6)> = None;
    for subset in 0_u32..1 << rows.len() {
        if subset.count_ones() > 6 {
            continue;
        }
        let held: Vec<usize> = (0..rows.len()).filter(|k| subset >> k & 1 == 1).collect();
        let y = if held.is_empty() {
            Vector6::zeros()
        } else {
            let n = DMatrix::from_fn(held.len(), 6, |i, j| whitened[held[i]][j]);
            let h = DVector::from_fn(held.len(), |i, _| -rows[held[i]].slack(a_u));
            let y = n
                .svd(true, true)
                .solve(&h, 1e-12)
                .expect("both factors were asked for");
            Vector6::from_fn(|k, _| y[k])
        };
        let a = a_u + metric.unwhiten(&y);
        let feasible = rows
            .iter()
            .zip(&whitened)
            .all(|(row, w)| row.slack(&a) >= -1e-11 * size * w.norm());
        if feasible && best.is_none_or(|(length, _)| y.norm() < length) {
            best = Some((y.norm(), a));
        }
    }
    best.map(|(_, a)| a)
}

/// Rows that some random point satisfies, with bounds of either sign.
fn around_a_feasible_point(count: usize, random: &mut Random) -> Vec<HalfSpace> {
    let inside = hand_motion(random);
    let mut rows = rows_of(random.below(2) * 7, count, false, random);
    for row in &mut rows {
        row.bound =
            row.jacobian.dot(&inside) - 5e-3 * random.unit() * f64::from(random.below(3) > 0);
    }
    rows
}

#[test]
fn the_active_set_finds_what_trying_every_active_set_finds() {
    let metric = hand_sized_metric();
    let random = &mut Random(11);
    for case in 0..300 {
        let rows = around_a_feasible_point(case % 9, random);
        let a_u = hand_motion(random);
        let answer = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
        assert_eq!(answer.status, ProjectionStatus::Solved, "case {case}");
        let expected = brute_force(&metric, &a_u, &rows).expect("a point inside is known");
        let error = metric.norm(&(answer.acceleration - expected)) / metric.norm(&a_u);
        assert!(error <= 1e-9, "case {case}: {error:e}");
    }
}

#[test]
fn bounds_of_either_sign_agree_with_non_negative_least_squares() {
    let metric = hand_sized_metric();
    let random = &mut Random(12);
    for case in 0..400 {
        let rows = around_a_feasible_point(1 + case % 60, random);
        let a_u = hand_motion(random);
        let answer = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
        assert_eq!(answer.status, ProjectionStatus::Solved, "case {case}");
        let expected = oracle(&metric, &a_u, &rows).expect("a point inside is known");
        let error = metric.norm(&(answer.acceleration - expected)) / metric.norm(&a_u);
        assert!(error <= 1e-8, "case {case}: {error:e}");
    }
}

#[test]
fn clarabel_agrees_with_the_active_set() {
    let metric = hand_sized_metric();
    let random = &mut Random(13);
    let mut certified = 0;
    let mut worst = 0.0_f64;
    for case in 0..400 {
        let family = case % FAMILIES.len();
        let rows = rows_of(family, 1 + case % 61, case % 2 == 0, random);
        let a_u = hand_motion(random);
        let fast = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
        let reference = project(SolverKind::Clarabel, &metric, &a_u, &rows);
        assert_eq!(reference.producer, SolverKind::Clarabel);
        let error = metric.norm(&(fast.acceleration - reference.acceleration)) / metric.norm(&a_u);
        assert!(
            error <= 1e-6,
            "{} case {case}: {error:e} {reference:?}",
            FAMILIES[family]
        );
        if reference.status == ProjectionStatus::Solved {
            certified += 1;
            worst = worst.max(error);
        }
    }
    println!("Clarabel: {certified} of 400 certified, largest difference of these {worst:e}");
    assert!(certified >= 380, "{certified}");
    assert!(worst <= 1e-8, "{worst:e}");
}

#[test]
fn contradicting_walls_are_seen_by_both_exact_solvers() {
    let metric = hand_sized_metric();
    let random = &mut Random(15);
    for kind in [SolverKind::ActiveSet, SolverKind::Clarabel] {
        for _ in 0..50 {
            let normal = random.direction();
            let mut rows = rows_of(1, random.below(20), true, random);
            let arm = random.vector3() * 0.05;
            rows.push(projection_support::contact(&arm, &normal, 1e-4));
            rows.push(projection_support::contact(&arm, &-normal, 1e-4));
            random.shuffle(&mut rows);
            let a_u = hand_motion(random);
            assert!(oracle(&metric, &a_u, &rows).is_none());
            let answer = Projector::new(kind, rows.len()).project(&metric, &a_u, &rows, &[]);
            assert_eq!(answer.status, ProjectionStatus::Infeasible, "{answer:?}");
            for row in &rows {
                let clipped = HalfSpace {
                    bound: row.bound.min(0.0),
                    ..*row
                };
                assert!(clipped.slack(&answer.acceleration) >= -1e-10);
            }
            assert!(metric.norm(&(answer.acceleration - a_u)) <= metric.norm(&a_u) * (1.0 + 1e-9));
        }
    }
}
