//! R33: a body that starts 5 mm inside an obstacle: no force before it is free, with a reason, or one that grows slowly.

use std::sync::Arc;

use god_object::spatial::linear;
use god_object::{GodObject, Pose, StartError};

use super::Extent;
use super::bodies::{cube, ground};
use crate::clock::TICK;
use crate::method::{Method, Scene};
use crate::row::Row;

const HALF: f64 = 0.01;
const INSIDE: f64 = 5e-3;
/// N/s.
const RAMP: f64 = 1.0;

pub(super) fn run(_extent: Extent) -> Vec<Row> {
    let inside = Pose::translation(0.0, 0.0, HALF - INSIDE);
    let scene = Scene::new(cube(HALF), [ground()], 2.0 * HALF, 0.1, inside);
    let refused = GodObject::new(Arc::clone(&scene.world), scene.settings, inside).err();
    let named = |error: &StartError| matches!(error, StartError::Penetration { obstacle } if obstacle == "ground");
    let wrong = !refused.as_ref().is_some_and(named);
    let row = Row {
        settings: refused.map_or_else(|| "started".to_owned(), |error| error.to_string()),
        ..Row::new("R33", "5 mm inside", Method::Ours.name())
    };
    let mut rows = vec![row.never("not_refused_by_name", usize::from(wrong))];
    for method in Method::ALL {
        let row = Row::new("R33", "5 mm inside", method.name());
        match method {
            Method::Ours => {}
            Method::Penalty => {
                let tuning = method.tunings()[0];
                let mut penalty = method.start(&scene, TICK, tuning);
                penalty.update(0.0, &inside);
                penalty.publish(0.0);
                let force = linear(&penalty.force(TICK, &inside)).norm();
                let row = Row {
                    settings: tuning.to_string(),
                    rate: Some(1000),
                    ..row
                };
                rows.push(row.at_most("step_at_the_start", force, "N/ms", RAMP * TICK));
            }
            _ => rows.push(row.out_of_scope("it is started where ours may start")),
        }
    }
    rows
}
