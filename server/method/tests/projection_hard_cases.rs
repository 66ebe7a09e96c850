//! Inputs that break solvers, each by name.

mod projection_support;

use god_object::quasi_statics::{HalfSpace, Metric, ProjectionStatus, Projector, SolverKind};
use god_object::spatial::Vector6;
use nalgebra::{Matrix3, Vector3};
use projection_support::{Random, contact, hand_motion, hand_sized_metric, oracle, project};

const ALL: [SolverKind; 3] = [
    SolverKind::ActiveSet,
    SolverKind::Clarabel,
    SolverKind::ProjectedGaussSeidel,
];

fn floor(bound: f64) -> HalfSpace {
    contact(&Vector3::zeros(), &Vector3::z(), bound)
}

#[test]
fn without_rows_the_wish_is_granted() {
    for kind in ALL {
        let a_u = Vector6::repeat(0.1);
        let answer = project(kind, &hand_sized_metric(), &a_u, &[]);
        assert_eq!(answer.acceleration, a_u);
        assert_eq!(answer.status, ProjectionStatus::Solved);
        assert_eq!(answer.kkt_residual, 0.0);
    }
}

#[test]
fn broken_numbers_stop_the_motion() {
    let metric = hand_sized_metric();
    for kind in ALL {
        for broken in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for place in 0..13 {
                let mut a_u = Vector6::repeat(-0.1);
                let mut row = floor(0.0);
                match place {
                    0..6 => a_u[place] = broken,
                    6..12 => row.jacobian[place - 6] = broken,
                    _ => row.bound = broken,
                }
                let rows = [floor(-1.0), floor(0.0), row];
                let answer = project(kind, &metric, &a_u, &rows);
                assert_eq!(answer.status, ProjectionStatus::NotFinite);
                assert_eq!(answer.acceleration, Vector6::zeros());
            }
        }
    }
}

#[test]
fn zero_rows_are_ignored_or_impossible_by_their_bound() {
    let metric = hand_sized_metric();
    let a_u = Vector6::new(0.01, 0.0, -0.01, 0.0, 0.0, 0.0);
    let zero = |bound| HalfSpace {
        jacobian: Vector6::zeros(),
        bound,
    };
    for kind in ALL {
        for bound in [0.0, -1.0] {
            let with = project(kind, &metric, &a_u, &[zero(bound), floor(0.0), zero(bound)]);
            let without = project(kind, &metric, &a_u, &[floor(0.0)]);
            assert_eq!(with.status, ProjectionStatus::Solved);
            assert_eq!(with.acceleration, without.acceleration);
        }
        let answer = project(kind, &metric, &a_u, &[floor(0.0), zero(1e-9)]);
        assert_eq!(answer.status, ProjectionStatus::Infeasible);
        assert!(answer.acceleration[2].abs() < 1e-15);
    }
}

#[test]
fn more_rows_than_reserved_stop_the_motion() {
    let metric = hand_sized_metric();
    for kind in ALL {
        let mut projector = Projector::new(kind, 2);
        let a_u = Vector6::repeat(-0.1);
        let answer = projector.project(&metric, &a_u, &[floor(0.0); 3], &[0, 1, 2]);
        assert_eq!(answer.status, ProjectionStatus::IterationLimit);
        assert_eq!(answer.acceleration, Vector6::zeros());
        assert_eq!(answer.kkt_residual, f64::INFINITY);
        let answer = projector.project(&metric, &a_u, &[floor(0.0); 2], &[0, 1, 2]);
        assert_eq!(
            answer.status,
            ProjectionStatus::Solved,
            "the projector is usable afterwards"
        );
    }
}

#[test]
fn a_wall_on_both_sides_nearer_than_the_rest_distance_holds_the_body_in_place() {
    let metric = hand_sized_metric();
    let down = contact(&Vector3::zeros(), &-Vector3::z(), 1e-5);
    let rows = [floor(1e-5), down];
    let a_u = Vector6::new(0.01, 0.0, -0.01, 0.0, 0.0, 0.0);
    for warm_start in [&[][..], &[0], &[1], &[0, 1]] {
        let answer =
            Projector::new(SolverKind::ActiveSet, 2).project(&metric, &a_u, &rows, warm_start);
        assert_eq!(answer.status, ProjectionStatus::Infeasible);
        let expected = Vector6::new(0.01, 0.0, 0.0, 0.0, 0.0, 0.0);
        assert!((answer.acceleration - expected).norm() < 1e-15);
        assert!(
            answer.kkt_residual < 1e-12,
            "certified for the clipped bounds"
        );
    }
}

#[test]
fn a_body_inside_the_rest_distance_is_eased_out() {
    let metric = hand_sized_metric();
    for kind in ALL {
        for a_u in [
            Vector6::zeros(),
            Vector6::new(0.0, 0.0, -0.01, 0.0, 0.0, 0.0),
        ] {
            let answer = project(kind, &metric, &a_u, &[floor(1e-5)]);
            assert_eq!(answer.status, ProjectionStatus::Solved, "{answer:?}");
            assert!((answer.acceleration[2] - 1e-5).abs() < 1e-15);
        }
    }
}

#[test]
fn ten_thousand_copies_of_a_row_are_one() {
    let metric = hand_sized_metric();
    let row = contact(&Vector3::new(0.03, -0.01, 0.02), &Vector3::z(), 0.0);
    let a_u = Vector6::new(0.01, 0.02, -0.03, 0.1, 0.2, -0.1);
    let one = project(SolverKind::ActiveSet, &metric, &a_u, &[row]);
    let many = project(SolverKind::ActiveSet, &metric, &a_u, &vec![row; 10_000]);
    assert_eq!(one.acceleration, many.acceleration);
    assert_eq!(many.active.len(), 1);
}

#[test]
fn duplicates_that_differ_in_the_thirteenth_digit_change_nothing_that_counts() {
    let metric = hand_sized_metric();
    let random = &mut Random(21);
    for case in 0..300 {
        let base: Vec<HalfSpace> = (0..6)
            .map(|_| contact(&(random.vector3() * 0.05), &random.direction(), 0.0))
            .collect();
        let mut rows = base.clone();
        for _ in 0..10 {
            for row in &base {
                let mut near = *row;
                near.jacobian += random.vector6() * 1e-13;
                rows.push(near);
            }
        }
        let a_u = hand_motion(random);
        let plain = project(SolverKind::ActiveSet, &metric, &a_u, &base);
        let dense = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
        assert_eq!(dense.status, ProjectionStatus::Solved);
        assert_eq!(dense.restarts, 0);
        let difference = metric.norm(&(plain.acceleration - dense.acceleration));
        assert!(
            difference <= 1e-9 * metric.norm(&a_u),
            "case {case}: {difference:e}"
        );
    }
}

#[test]
fn a_fully_locked_body_does_not_move() {
    let metric = hand_sized_metric();
    let mut rows = Vec::new();
    for axis in 0..6 {
        for sign in [1.0, -1.0] {
            let mut jacobian = Vector6::zeros();
            jacobian[axis] = sign;
            rows.push(HalfSpace {
                jacobian,
                bound: 0.0,
            });
        }
    }
    let random = &mut Random(22);
    for _ in 0..1000 {
        let a_u = hand_motion(random);
        let answer = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
        assert_eq!(answer.status, ProjectionStatus::Solved);
        assert!(metric.norm(&answer.acceleration) <= 1e-15, "{answer:?}");
    }
}

#[test]
fn scenes_of_any_size_are_solved_alike() {
    let random = &mut Random(23);
    for size in [1e-100, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e100] {
        for _ in 0..50 {
            let inertia =
                Matrix3::from_diagonal(&Vector3::new(2.0, 3.0, 4.0)) * (1e-3 * size * size);
            let metric = Metric::new(1.0, &inertia).expect("the tensor is positive definite");
            let rows: Vec<HalfSpace> = (0..20)
                .map(|_| {
                    contact(
                        &(random.vector3() * 0.05 * size),
                        &random.direction(),
                        -1e-3 * size * random.unit(),
                    )
                })
                .collect();
            let mut a_u = hand_motion(random);
            for k in 0..3 {
                a_u[k] *= size;
            }
            let answer = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
            assert_eq!(answer.status, ProjectionStatus::Solved, "size {size}");
            let expected = oracle(&metric, &a_u, &rows).expect("0 is feasible");
            let error = metric.norm(&(answer.acceleration - expected)) / metric.norm(&a_u);
            assert!(error <= 1e-9, "size {size:e}: {error:e}");
        }
    }
}

#[test]
fn a_needle_with_a_flat_inertia_is_solved() {
    let inertia = Matrix3::from_diagonal(&Vector3::new(1e-12, 1.0, 1.0));
    let metric = Metric::new(1.0, &inertia).expect("the tensor is positive definite");
    let random = &mut Random(24);
    for case in 0..300 {
        let rows: Vec<HalfSpace> = (0..30)
            .map(|_| {
                contact(
                    &random.vector3(),
                    &random.direction(),
                    -1e-3 * random.unit(),
                )
            })
            .collect();
        let a_u = hand_motion(random);
        let answer = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
        assert_eq!(
            answer.status,
            ProjectionStatus::Solved,
            "case {case}: {answer:?}"
        );
    }
}

#[test]
fn the_same_call_twice_gives_the_same_bits() {
    let metric = hand_sized_metric();
    let random = &mut Random(25);
    let mut projector = Projector::new(SolverKind::ActiveSet, 64);
    for _ in 0..200 {
        let rows = projection_support::rows_of(random.below(8), random.below(60), true, random);
        let a_u = hand_motion(random);
        let first = projector.project(&metric, &a_u, &rows, &[]);
        let second = projector.project(&metric, &a_u, &rows, &[]);
        assert_eq!(first, second);
    }
}

#[test]
fn numbers_at_the_ends_of_their_range_never_give_a_broken_answer() {
    let metric = hand_sized_metric();
    let random = &mut Random(26);
    for _ in 0..2000 {
        let wild = |random: &mut Random| random.signed() * 10_f64.powf(300.0 * random.signed());
        let rows: Vec<HalfSpace> = (0..random.below(12))
            .map(|_| HalfSpace {
                jacobian: Vector6::from_fn(|_, _| wild(random)),
                bound: wild(random),
            })
            .collect();
        let a_u = Vector6::from_fn(|_, _| wild(random));
        let answer = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
        assert!(answer.acceleration.iter().all(|x| x.is_finite()));
        if answer.status == ProjectionStatus::Solved {
            assert!(answer.kkt_residual <= 1e-9);
        }
    }
}
