//! R04: flat on flat: the wrench does not depend on how many contacts carry it, nor on which.

use god_object::quasi_statics::{HalfSpace, Metric};
use god_object::spatial::six;
use nalgebra::{Matrix3, Vector3};

use super::{K_H, contact, for_solvers};
use crate::recipes::Extent;
use crate::row::Row;

const HALF_EDGE: f64 = 0.05;
const HALF_HEIGHT: f64 = 0.02;
const DEPTH: f64 = 5e-3;
const K_S: f64 = 0.5;
const CLOSED_FORM: f64 = 1e-9;
const SPREAD: f64 = 1e-9;

/// n x n contacts on the underside of the box.
fn underside(n: usize) -> Vec<HalfSpace> {
    let at = |i: usize| HALF_EDGE * (2.0 * i as f64 / (n - 1) as f64 - 1.0);
    (0..n * n)
        .map(|k| {
            let arm = Vector3::new(at(k / n), at(k % n), -HALF_HEIGHT);
            contact(&arm, &Vector3::z())
        })
        .collect()
}

pub(in crate::recipes) fn run(extent: Extent) -> Vec<Row> {
    let moment = |a: f64, b: f64| (a * a + b * b) / 3.0;
    let across = moment(HALF_EDGE, HALF_HEIGHT);
    let inertia =
        Matrix3::from_diagonal(&Vector3::new(across, across, moment(HALF_EDGE, HALF_EDGE)));
    let metric = Metric::new(1.0, &inertia).expect("the tensor is positive definite");
    // Beyond this tilt the box leaves the plane and pivots on an edge.
    let limit = DEPTH * HALF_EDGE / across;
    let counts: &[usize] = extent.choose(&[2, 4, 10, 100], &[2, 4, 10]);
    for_solvers("R04", |solver| {
        let mut rows = Vec::new();
        for share in [0.0, 0.3, 0.999, 1.2, 3.0] {
            let twist = Vector3::new(0.0, share * limit, 0.0);
            let wish = six(&(Vector3::z() * -DEPTH), &twist) * K_S;
            let flat = six(&(Vector3::z() * DEPTH), &(-(inertia * twist))) * (K_H * K_S);
            let mut first = None;
            for n in counts {
                solver.times.clear();
                let found = solver.wrench(&metric, &wish, &underside(*n));
                let first = *first.get_or_insert(found);
                let case = format!("tilt {share} of the limit, {} contacts", n * n);
                let row = solver.row("R04", &case);
                let spread = (found - first).norm() / first.norm();
                rows.push(row.clone().at_most("spread", spread, "-", SPREAD));
                let error = if share < 1.0 {
                    (found - flat).norm() / flat.norm()
                } else {
                    // One resultant on the edge that goes down: tau = r x F.
                    let torque = -HALF_EDGE * found[2];
                    (found[4] - torque).abs() / torque.abs()
                };
                rows.push(row.at_most("relative_error", error, "-", CLOSED_FORM));
            }
        }
        rows
    })
}
