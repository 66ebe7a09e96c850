//! What must hold of every answer of the projection, without any oracle.
//!
//! Source: Ortega et al. 2007, Sections 4.2, 5 (footnote 3) and 7.3.1 (footnote 4).

use crate::projection_support::{FAMILIES, Random, hand_motion, hand_sized_metric, rows_of};
use god_object::quasi_statics::{
    ActiveRow, HalfSpace, KKT_TOLERANCE, Metric, ProjectionStatus, Projector, SolverKind,
    kkt_residual,
};
use god_object::spatial::Vector6;
use proptest::prelude::*;

/// Error of an answer relative to |a_u|_M: rounding, amplified by nearly parallel rows.
const TOLERANCE: f64 = 1e-9;

/// Largest KKT residual that is met in practice, of the largest multiplier where that is more than the wish; answers up to `KKT_TOLERANCE` count as
/// certified.
const ACCURACY: f64 = 1e-12;

/// Two measurements of one residual differ by some roundings.
const MEASUREMENT: f64 = 1e-14;

fn solve(metric: &Metric, a_u: &Vector6, rows: &[HalfSpace]) -> Vector6 {
    let projection =
        Projector::new(SolverKind::ActiveSet, rows.len()).project(metric, a_u, rows, &[]);
    assert_eq!(
        projection.status,
        ProjectionStatus::Solved,
        "{projection:?}"
    );
    projection.acceleration
}

fn case() -> impl Strategy<Value = (u64, usize, usize, bool)> {
    (any::<u64>(), 0..FAMILIES.len(), 0..60_usize, any::<bool>())
}

/// 1500 cases, or as many as `PROPTEST_CASES` asks for beyond that.
fn config() -> ProptestConfig {
    let default = ProptestConfig::default();
    ProptestConfig {
        cases: default.cases.max(1500),
        failure_persistence: None,
        ..default
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn every_answer_is_certified_feasible_dissipative_and_bounded((seed, family, count, gaps) in case()) {
        let random = &mut Random(seed);
        let metric = hand_sized_metric();
        let rows = rows_of(family, count, gaps, random);
        let a_u = hand_motion(random);
        let mut projector = Projector::new(SolverKind::ActiveSet, rows.len());
        let answer = projector.project(&metric, &a_u, &rows, &[]);
        let (a_c, size) = (answer.acceleration, metric.norm(&a_u));
        prop_assert_eq!(answer.status, ProjectionStatus::Solved, "{}", FAMILIES[family]);
        prop_assert_eq!(answer.producer, SolverKind::ActiveSet);

        // KKT, measured here once more, by other means: the same number, up to the roundings of the measurement, which grow with what it sums.
        let residual = kkt_residual(&metric, &a_u, &rows, &a_c, &answer.active);
        let unit = |row: &ActiveRow| row.multiplier * metric.whiten_row(&rows[row.row as usize].jacobian).norm();
        let summed = answer.active.iter().map(unit).fold(size, f64::max) / size.max(f64::MIN_POSITIVE);
        let apart = (residual.largest() - answer.kkt_residual).abs();
        prop_assert!(apart <= MEASUREMENT * summed, "{:?} {:e}", residual, answer.kkt_residual);
        let accurate = residual.largest() <= (ACCURACY * summed).min(KKT_TOLERANCE);
        prop_assert!(accurate, "{} {:?}", FAMILIES[family], residual);
        prop_assert!(answer.active.iter().all(|row| row.multiplier > 0.0));

        // Dissipation, and the force is bounded: 0 is feasible.
        let change = a_u - a_c;
        prop_assert!(metric.inner(&a_u, &a_c) <= metric.inner(&a_u, &a_u) * (1.0 + TOLERANCE));
        prop_assert!(metric.inner(&change, &a_c) >= -TOLERANCE * size * size);
        prop_assert!(metric.norm(&change) <= size * (1.0 + TOLERANCE));
        prop_assert!(metric.norm(&a_c) <= size * (1.0 + TOLERANCE));
    }

    #[test]
    fn touching_contacts_give_a_force_orthogonal_to_the_motion((seed, family, count, _) in case()) {
        let random = &mut Random(seed);
        let metric = hand_sized_metric();
        let rows = rows_of(family, count, false, random);
        let a_u = hand_motion(random);
        let a_c = solve(&metric, &a_u, &rows);
        let work = metric.inner(&(a_c - a_u), &a_c);
        prop_assert!(work.abs() <= TOLERANCE * metric.norm(&a_u).powi(2), "{}", FAMILIES[family]);
    }

    #[test]
    fn the_projection_is_1_lipschitz((seed, family, count, gaps) in case(), nearness in -9..0_i32) {
        let random = &mut Random(seed);
        let metric = hand_sized_metric();
        let rows = rows_of(family, count, gaps, random);
        let a_u = hand_motion(random);
        let b_u = a_u + hand_motion(random) * 10_f64.powi(nearness);
        let moved = metric.norm(&(solve(&metric, &a_u, &rows) - solve(&metric, &b_u, &rows)));
        let size = metric.norm(&a_u);
        prop_assert!(moved <= metric.norm(&(a_u - b_u)) + TOLERANCE * size, "{}", FAMILIES[family]);
    }

    #[test]
    fn order_duplication_and_scaling_of_rows_change_nothing((seed, family, count, gaps) in case()) {
        let random = &mut Random(seed);
        let metric = hand_sized_metric();
        let rows = rows_of(family, count, gaps, random);
        let a_u = hand_motion(random);
        let a_c = solve(&metric, &a_u, &rows);
        let mut other: Vec<HalfSpace> = rows.iter().chain(rows.iter().take(count / 2)).copied().collect();
        random.shuffle(&mut other);
        for row in &mut other {
            let scale = 10_f64.powf(4.0 * random.signed());
            row.jacobian *= scale;
            row.bound *= scale;
        }
        let difference = metric.norm(&(solve(&metric, &a_u, &other) - a_c));
        prop_assert!(difference <= TOLERANCE * metric.norm(&a_u), "{} {difference:e}", FAMILIES[family]);
    }

    #[test]
    fn a_feasible_wish_is_granted_bit_for_bit((seed, family, count, gaps) in case()) {
        let random = &mut Random(seed);
        let metric = hand_sized_metric();
        let a_u = hand_motion(random);
        let mut rows = rows_of(family, count, gaps, random);
        rows.retain(|row| row.slack(&a_u) >= 0.0);
        let mut projector = Projector::new(SolverKind::ActiveSet, rows.len());
        let every: Vec<u32> = (0..rows.len() as u32).collect();
        for warm_start in [&[][..], &every] {
            let answer = projector.project(&metric, &a_u, &rows, warm_start);
            prop_assert_eq!(answer.acceleration, a_u);
            prop_assert!(answer.active.is_empty());
            prop_assert_eq!(answer.status, ProjectionStatus::Solved);
        }
    }

    #[test]
    fn a_warm_start_changes_the_effort_only((seed, family, count, gaps) in case(), wild in any::<[u32; 4]>()) {
        let random = &mut Random(seed);
        let metric = hand_sized_metric();
        let rows = rows_of(family, count, gaps, random);
        let a_u = hand_motion(random);
        let mut projector = Projector::new(SolverKind::ActiveSet, rows.len());
        let cold = projector.project(&metric, &a_u, &rows, &[]);
        let own: Vec<u32> = cold.active.iter().map(|row| row.row).collect();
        let foreign: Vec<u32> = (0..10).map(|_| random.below(60) as u32).collect();
        for warm_start in [&own[..], &foreign, &wild] {
            let warm = projector.project(&metric, &a_u, &rows, warm_start);
            prop_assert_eq!(warm.status, ProjectionStatus::Solved);
            let difference = metric.norm(&(warm.acceleration - cold.acceleration));
            prop_assert!(difference <= TOLERANCE * metric.norm(&a_u), "{} {difference:e}", FAMILIES[family]);
        }
    }
}
