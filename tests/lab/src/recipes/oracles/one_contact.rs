//! R03: one contact off the centre: lambda = -J a_u / (J M^-1 J^T), force along the normal, torque about the centre.

use god_object::quasi_statics::Metric;
use nalgebra::{Matrix3, Vector3};

use super::{K_H, Random, contact, for_solvers};
use crate::recipes::Extent;
use crate::row::Row;

/// Of the wrench of the wish itself.
const RELATIVE_ERROR: f64 = 1e-12;

pub(in crate::recipes) fn run(extent: Extent) -> Vec<Row> {
    let count = extent.choose(10_000, 1000);
    let inertia = Matrix3::from_diagonal(&Vector3::new(2e-3, 3e-3, 4e-3));
    let metric = Metric::new(1.0, &inertia).expect("the tensor is positive definite");
    let rows = [contact(&Vector3::new(0.04, 0.02, -0.03), &Vector3::z())];
    let j = rows[0].jacobian;
    let lever = j.fixed_rows::<3>(3).into_owned();
    let inverse_mass = 1.0
        + lever
            .component_mul(&lever)
            .component_div(&inertia.diagonal())
            .sum();
    for_solvers("R03", |solver| {
        let mut random = Random(3);
        let mut worst: f64 = 0.0;
        for _ in 0..count {
            let wish = random.wish();
            let lambda = (-j.dot(&wish) / inverse_mass).max(0.0);
            let found = solver.wrench(&metric, &wish, &rows);
            let scale = metric.mass_matrix_times(&wish).norm() * K_H;
            worst = worst.max((found - j * (K_H * lambda)).norm() / scale);
        }
        let row = solver.row("R03", "one contact off centre");
        vec![row.at_most("relative_error", worst, "-", RELATIVE_ERROR)]
    })
}
