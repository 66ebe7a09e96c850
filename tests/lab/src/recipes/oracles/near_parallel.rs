//! R05: near-parallel normals push like one; opposite ones lock their axis with a bounded force.

use std::f64::consts::PI;

use god_object::Vector6;

use super::{K_H, for_solvers, plane, point_metric};
use crate::recipes::Extent;
use crate::row::Row;

const DEPTH: f64 = 5e-3;
/// Over the bound: rounding.
const ROUNDING: f64 = 1e-9;

pub(in crate::recipes) fn run(_extent: Extent) -> Vec<Row> {
    let metric = point_metric();
    for_solvers("R05", |solver| {
        let mut rows = Vec::new();
        for exponent in 1..=9 {
            let delta = 10_f64.powi(-exponent);
            let (sine, cosine) = delta.sin_cos();
            let normals = [
                plane(sine, 0.0, cosine),
                plane(-sine, 0.0, cosine),
                plane(sine, 0.0, cosine),
            ];
            let (mut error, mut bound): (f64, f64) = (0.0, 0.0);
            for x in [0.0, 1e-3, -1e-3, 5e-3] {
                let wish = Vector6::new(x, 0.0, -DEPTH, 0.0, 0.0, 0.0);
                let found = solver.wrench(&metric, &wish, &normals);
                let expected = Vector6::new(0.0, 0.0, K_H * DEPTH, 0.0, 0.0, 0.0);
                let size = K_H * metric.norm(&wish);
                error = error.max((found - expected).norm() / size);
                bound = bound.max(found.norm() / size);
            }
            let row = solver.row("R05", &format!("normals 1e-{exponent} rad from z"));
            rows.push(
                row.clone()
                    .at_most("relative_error", error, "-", 2.0 * sine),
            );
            rows.push(row.at_most("force_over_bound", bound, "-", 1.0 + ROUNDING));
        }
        let (sine, cosine) = (PI - 1e-6).sin_cos();
        let slit = [plane(0.0, 0.0, 1.0), plane(sine, 0.0, cosine)];
        for depth in [-DEPTH, DEPTH] {
            let wish = Vector6::new(3e-3, 1e-3, depth, 0.1, 0.2, 0.3);
            let answer = solver.project(&metric, &wish, &slit).acceleration;
            let force = metric.mass_matrix_times(&(answer - wish)).norm() / metric.norm(&wish);
            let row = solver.row("R05", &format!("slit, wish of {depth} m across"));
            rows.push(
                row.clone()
                    .at_most("across", answer[2].abs() / DEPTH, "-", 1e-5),
            );
            rows.push(row.at_most("force_over_bound", force, "-", 1.0 + ROUNDING));
        }
        rows
    })
}
