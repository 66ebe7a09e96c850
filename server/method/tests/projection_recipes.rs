//! Projections with known answers: one contact, flat on flat, near-parallel walls, groove, corner, thousands of contacts.

use crate::projection_support::{Random, contact, hand_motion, hand_sized_metric, oracle, project};
use god_object::quasi_statics::{HalfSpace, Metric, ProjectionStatus, SolverKind};
use god_object::spatial::{Vector6, six};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

const K_S: f64 = 0.5;
const K_H: f64 = 2000.0;

/// The constraint wrench `k_h M (a_c - a_u)`; asserts that the answer is certified.
fn wrench(metric: &Metric, a_u: &Vector6, rows: &[HalfSpace]) -> Vector6 {
    let answer = project(SolverKind::ActiveSet, metric, a_u, rows);
    assert_eq!(answer.status, ProjectionStatus::Solved, "{answer:?}");
    metric.mass_matrix_times(&(answer.acceleration - a_u)) * K_H
}

fn point_metric() -> Metric {
    Metric::new(1.0, &(Matrix3::identity() * 1e-3)).expect("the tensor is positive definite")
}

fn plane(x: f64, y: f64, z: f64) -> HalfSpace {
    contact(&Vector3::zeros(), &Vector3::new(x, y, z), 0.0)
}

#[test]
fn one_contact_off_centre_has_its_closed_form() {
    let inertia = Matrix3::from_diagonal(&Vector3::new(2e-3, 3e-3, 4e-3));
    let metric = Metric::new(1.0, &inertia).expect("the tensor is positive definite");
    let (arm, normal) = (Vector3::new(0.04, 0.02, -0.03), Vector3::z());
    let rows = [contact(&arm, &normal, 0.0)];
    let j = rows[0].jacobian;
    let inverse_mass = 1.0
        + arm
            .cross(&normal)
            .component_mul(&arm.cross(&normal))
            .component_div(&inertia.diagonal())
            .sum();
    let random = &mut Random(3);
    let mut pushed = 0;
    for _ in 0..10_000 {
        let a_u = hand_motion(random);
        let force = (-j.dot(&a_u) / inverse_mass).max(0.0);
        let expected = j * (K_H * force);
        let found = wrench(&metric, &a_u, &rows);
        let scale = metric.mass_matrix_times(&a_u).norm() * K_H;
        assert!(
            (found - expected).norm() <= 1e-12 * scale,
            "{found} {expected}"
        );
        pushed += u32::from(force > 0.0);
    }
    assert!((4000..6000).contains(&pushed));
}

/// n x n contacts on the underside of a box of 0.1 x 0.1 x 0.04 m.
fn underside(n: usize) -> Vec<HalfSpace> {
    let at = |i: usize| 0.1 * i as f64 / (n - 1) as f64 - 0.05;
    (0..n * n)
        .map(|k| {
            contact(
                &Vector3::new(at(k / n), at(k % n), -0.02),
                &Vector3::z(),
                0.0,
            )
        })
        .collect()
}

#[test]
fn a_box_on_a_plane_feels_the_same_on_4_or_10000_contacts() {
    let moment = |a: f64, b: f64| (a * a + b * b) / 12.0;
    let inertia = Matrix3::from_diagonal(&Vector3::new(
        moment(0.1, 0.04),
        moment(0.1, 0.04),
        moment(0.1, 0.1),
    ));
    let metric = Metric::new(1.0, &inertia).expect("the tensor is positive definite");
    let (depth, half_edge) = (5e-3, 0.05);
    let limit = depth * half_edge / inertia.m22;
    for tilt in [0.0, 0.3 * limit, 0.999 * limit, 1.2 * limit, 3.0 * limit] {
        let twist = Vector3::new(0.0, tilt, 0.0);
        let a_u = six(&(Vector3::z() * -depth), &twist) * K_S;
        let reference = wrench(&metric, &a_u, &underside(2));
        if tilt < limit {
            let flat = six(&(Vector3::z() * depth), &(-(inertia * twist))) * (K_H * K_S);
            assert!(
                (reference - flat).norm() <= 1e-12 * flat.norm(),
                "tilt {tilt}"
            );
        } else {
            // Pivots on the edge that goes down: one resultant there, tau = r x F.
            let torque = -half_edge * reference[2];
            assert!(
                (reference[4] - torque).abs() <= 1e-12 * torque.abs(),
                "tilt {tilt}"
            );
        }
        for n in [4, 10, 100] {
            let spread = (wrench(&metric, &a_u, &underside(n)) - reference).norm();
            assert!(
                spread <= 1e-9 * reference.norm(),
                "{n} x {n} contacts: {spread:e}"
            );
        }
    }
}

#[test]
fn near_parallel_normals_push_like_one() {
    let metric = point_metric();
    for exponent in 1..=9 {
        let delta = 10_f64.powi(-exponent);
        let (sine, cosine) = delta.sin_cos();
        let rows = [
            plane(sine, 0.0, cosine),
            plane(-sine, 0.0, cosine),
            plane(sine, 0.0, cosine),
        ];
        for x in [0.0, 1e-3, -1e-3, 5e-3] {
            let a_u = Vector6::new(x, 0.0, -5e-3, 0.0, 0.0, 0.0);
            let found = wrench(&metric, &a_u, &rows);
            let expected = Vector6::new(0.0, 0.0, K_H * 5e-3, 0.0, 0.0, 0.0);
            let size = K_H * metric.norm(&a_u);
            assert!(
                (found - expected).norm() <= 2.0 * sine * size,
                "delta {delta:e}: {found}"
            );
            assert!(found.norm() <= size * (1.0 + 1e-12));
        }
    }
}

#[test]
fn a_slit_locks_its_axis_with_a_bounded_force() {
    let metric = point_metric();
    for opening in [0.0, 1e-13, 1e-9, 1e-6] {
        let (sine, cosine) = (PI - opening).sin_cos();
        let sine = if opening == 0.0 { 0.0 } else { sine };
        let rows = [plane(0.0, 0.0, 1.0), plane(sine, 0.0, cosine)];
        for depth in [-5e-3, 5e-3] {
            let a_u = Vector6::new(3e-3, 1e-3, depth, 0.1, 0.2, 0.3);
            let answer = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
            assert_eq!(answer.status, ProjectionStatus::Solved, "{answer:?}");
            let a_c = answer.acceleration;
            assert!(a_c[2].abs() <= 1e-5 * 5e-3 + opening, "{a_c}");
            assert!((a_c[0] - 3e-3).abs() <= 1e-5 * 5e-3 + opening, "{a_c}");
            let force = metric.mass_matrix_times(&(a_c - a_u)).norm();
            assert!(force <= metric.norm(&a_u) * (1.0 + 1e-9));
        }
    }
}

#[test]
fn a_slit_of_a_millionth_still_has_a_vertex() {
    // Walls that close towards -x: there is nowhere to go but +x, however slowly they close.
    let metric = point_metric();
    let (sine, cosine) = (PI - 1e-6).sin_cos();
    let rows = [plane(0.0, 0.0, 1.0), plane(sine, 0.0, cosine)];
    let a_u = Vector6::new(-3e-3, 1e-3, 5e-3, 0.0, 0.0, 0.0);
    let answer = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
    let expected = Vector6::new(0.0, 1e-3, 0.0, 0.0, 0.0, 0.0);
    assert!(
        (answer.acceleration - expected).norm() <= 1e-9 * a_u.norm(),
        "{answer:?}"
    );
}

#[test]
fn a_v_groove_holds_up_to_its_angle_and_then_slides() {
    let metric = point_metric();
    for degrees in [5.0_f64, 30.0, 45.0, 80.0, 89.9] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let rows = [plane(cosine, 0.0, sine), plane(-cosine, 0.0, sine)];
        let down = 4e-3;
        let limit = down * cosine / sine;
        // The held ones balance a wish inside the cone of both normals: |x| / z <= cot alpha.
        let mut last: Option<(f64, Vector6)> = None;
        for step in -40..=40 {
            let x = limit * f64::from(step) / 20.0;
            let a_u = Vector6::new(x, 0.0, -down, 0.0, 0.0, 0.0);
            let found = wrench(&metric, &a_u, &rows);
            let single = if x > 0.0 {
                rows[1].jacobian
            } else {
                rows[0].jacobian
            };
            let expected = if x.abs() <= limit {
                -a_u * K_H
            } else {
                single * (-single.dot(&a_u) * K_H)
            };
            let size = K_H * a_u.norm();
            assert!(
                (found - expected).norm() <= 1e-12 * size,
                "{degrees} {step}: {found}"
            );
            if let Some((previous_x, previous)) = last {
                let change = (found - previous).norm();
                assert!(change <= K_H * (x - previous_x) * (1.0 + 1e-9) + 1e-12 * size);
            }
            last = Some((x, found));
        }
    }
}

#[test]
fn a_trihedral_corner_clips_each_axis() {
    let metric = point_metric();
    let rows = [
        plane(1.0, 0.0, 0.0),
        plane(0.0, 1.0, 0.0),
        plane(0.0, 0.0, 1.0),
    ];
    let random = &mut Random(7);
    for _ in 0..10_000 {
        let a_u = hand_motion(random);
        let found = project(SolverKind::ActiveSet, &metric, &a_u, &rows).acceleration;
        for i in 0..6 {
            let expected = if i < 3 { a_u[i].max(0.0) } else { a_u[i] };
            assert!((found[i] - expected).abs() <= 1e-15, "{found} {a_u}");
        }
    }
}

#[test]
fn thousands_of_contacts_agree_with_non_negative_least_squares() {
    let metric = hand_sized_metric();
    let random = &mut Random(38);
    let mut iterations = 0;
    for (count, repeats) in [(1, 50), (7, 50), (40, 50), (300, 20), (1000, 10), (5000, 6)] {
        for _ in 0..repeats {
            let up = random.direction();
            let rows: Vec<HalfSpace> = (0..count)
                .map(|_| {
                    let normal = random.direction();
                    let normal = if normal.dot(&up) < 0.0 {
                        -normal
                    } else {
                        normal
                    };
                    contact(&(random.vector3() * 0.05), &normal, -1e-3 * random.unit())
                })
                .collect();
            let a_u = hand_motion(random);
            let answer = project(SolverKind::ActiveSet, &metric, &a_u, &rows);
            assert_eq!(answer.status, ProjectionStatus::Solved);
            assert_eq!(answer.producer, SolverKind::ActiveSet);
            assert_eq!(answer.restarts, 0);
            let expected = oracle(&metric, &a_u, &rows).expect("0 is feasible");
            let error = metric.norm(&(answer.acceleration - expected)) / metric.norm(&a_u);
            assert!(error <= 1e-9, "{count} rows: {error:e}");
            iterations = iterations.max(answer.iterations);
        }
    }
    assert!(iterations <= 100, "{iterations} iterations");
}
