//! The active set allocates nothing after `Projector::new`, whatever it is given.

use crate::projection_support::{
    FAMILIES, Random, contact, hand_motion, hand_sized_metric, rows_of,
};
use assert_no_alloc::assert_no_alloc;
use god_object::quasi_statics::{ProjectionStatus, Projector, SolverKind};

const MAX_ROWS: usize = 5000;

#[test]
fn projecting_never_allocates() {
    let metric = hand_sized_metric();
    let random = &mut Random(31);
    let mut projector = Projector::new(SolverKind::ActiveSet, MAX_ROWS);
    for family in 0..FAMILIES.len() {
        for count in [0, 1, 60, MAX_ROWS] {
            let rows = rows_of(family, count, true, random);
            let a_u = hand_motion(random);
            let cold = assert_no_alloc(|| projector.project(&metric, &a_u, &rows, &[]));
            let own: Vec<u32> = cold.active.iter().map(|row| row.row).collect();
            let warm = assert_no_alloc(|| projector.project(&metric, &a_u, &rows, &own));
            assert_eq!(warm.status, ProjectionStatus::Solved);
        }
    }
}

#[test]
fn the_ways_out_do_not_allocate_either() {
    let metric = hand_sized_metric();
    let random = &mut Random(32);
    let mut projector = Projector::new(SolverKind::ActiveSet, 64);
    let a_u = hand_motion(random);
    let normal = random.direction();
    let arm = random.vector3();
    let walls = [contact(&arm, &normal, 1e-3), contact(&arm, &-normal, 1e-3)];
    let answer = assert_no_alloc(|| projector.project(&metric, &a_u, &walls, &[0, 1]));
    assert_eq!(answer.status, ProjectionStatus::Infeasible);
    let many = [walls[0]; 65];
    let answer = assert_no_alloc(|| projector.project(&metric, &a_u, &many, &[]));
    assert_eq!(answer.status, ProjectionStatus::IterationLimit);
    let answer = assert_no_alloc(|| projector.project(&metric, &(a_u * f64::NAN), &walls, &[]));
    assert_eq!(answer.status, ProjectionStatus::NotFinite);
}
