//! R06: a V-groove holds a wish within its angle and lets the others slide up one face; the force is continuous between them.

use god_object::Vector6;

use super::{K_H, for_solvers, plane, point_metric};
use crate::recipes::Extent;
use crate::row::Row;

const DOWN: f64 = 4e-3;
const RELATIVE_ERROR: f64 = 1e-12;
/// Steps to either side, to twice the limit.
const STEPS: i32 = 40;

pub(in crate::recipes) fn run(_extent: Extent) -> Vec<Row> {
    let metric = point_metric();
    for_solvers("R06", |solver| {
        let mut rows = Vec::new();
        for degrees in [5.0_f64, 30.0, 45.0, 80.0, 89.9] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let faces = [plane(cosine, 0.0, sine), plane(-cosine, 0.0, sine)];
            let limit = DOWN * cosine / sine;
            let (mut error, mut jump): (f64, f64) = (0.0, 0.0);
            let mut last: Option<(f64, Vector6)> = None;
            for step in -STEPS..=STEPS {
                let x = 2.0 * limit * f64::from(step) / f64::from(STEPS);
                let wish = Vector6::new(x, 0.0, -DOWN, 0.0, 0.0, 0.0);
                let found = solver.wrench(&metric, &wish, &faces);
                let single = faces[usize::from(x > 0.0)].jacobian;
                let expected = if x.abs() <= limit {
                    -wish * K_H
                } else {
                    single * (-single.dot(&wish) * K_H)
                };
                error = error.max((found - expected).norm() / (K_H * wish.norm()));
                if let Some((before, force)) = last {
                    jump = jump.max((found - force).norm() / (K_H * (x - before)));
                }
                last = Some((x, found));
            }
            let row = solver.row("R06", &format!("half-angle {degrees} degrees"));
            rows.push(
                row.clone()
                    .at_most("relative_error", error, "-", RELATIVE_ERROR),
            );
            // The force follows the wish no faster than the wish moves.
            rows.push(row.at_most("force_over_wish", jump, "-", 1.0 + 1e-6));
        }
        rows
    })
}
