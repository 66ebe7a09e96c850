//! R07: a corner of three planes clips each axis by itself.

use super::{Random, for_solvers, plane, point_metric};
use crate::recipes::Extent;
use crate::row::Row;

/// m.
const ERROR: f64 = 1e-15;

pub(in crate::recipes) fn run(extent: Extent) -> Vec<Row> {
    let metric = point_metric();
    let faces = [
        plane(1.0, 0.0, 0.0),
        plane(0.0, 1.0, 0.0),
        plane(0.0, 0.0, 1.0),
    ];
    let count = extent.choose(10_000, 1000);
    for_solvers("R07", |solver| {
        let mut random = Random(7);
        let mut worst: f64 = 0.0;
        for _ in 0..count {
            let wish = random.wish();
            let found = solver.project(&metric, &wish, &faces).acceleration;
            for i in 0..6 {
                let expected = if i < 3 { wish[i].max(0.0) } else { wish[i] };
                worst = worst.max((found[i] - expected).abs());
            }
        }
        let row = solver.row("R07", "three planes");
        vec![row.at_most("error", worst, "m", ERROR)]
    })
}
