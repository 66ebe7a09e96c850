//! What holds of any penalty method: a force of so much for a depth, out of the nearest surface, and the bound of its spring.

use super::{Figure, HALF, TINY, at, damping, driven, figure};
use crate::clock::TICK;
use crate::method::{Method, Scene};
use crate::recipes::{block, cube};

/// m, of each step into a plate of twice [`HALF`], and how many.
const STEP: f64 = 1e-5;
const STEPS: u32 = 900;

pub(super) fn figures() -> Vec<Figure> {
    let thickness = 2.0 * HALF;
    let plate = block(
        "plate",
        [-0.1, -0.1, -thickness].into(),
        [0.1, 0.1, 0.0].into(),
    );
    let scene = Scene::new(cube(HALF), [plate], 2.0 * HALF, 0.1, at(2.0 * HALF));
    // The deepest of its vertices.
    let tuning = Method::Penalty.tunings()[1];
    let depth = |tick: u32| STEP * (f64::from(tick) + 0.5);
    let mut method = Method::Penalty.start(&scene, TICK, tuning);
    let run = driven(method.as_mut(), (STEPS, 1), |tick| at(HALF - depth(tick)));
    let forces = || {
        (0..)
            .zip(&run)
            .map(|(tick, (_, force))| (depth(tick), force[2]))
    };
    let through = forces().find(|(_, force)| *force < 0.0);
    let near = forces().filter(|(depth, _)| *depth < 0.5 * thickness);
    let errors = near.map(|(depth, force)| (force / (depth * scene.stiffness()) - 1.0).abs());
    let bound = damping::of_spring();
    vec![
        figure(
            (Method::Penalty, "any penalty method"),
            "error of force over stiffness times depth, on a face",
            "0",
            errors.fold(0.0, f64::max),
            [0.0, TINY],
            "",
        ),
        figure(
            (Method::Penalty, "any without history"),
            "depth at which a plate lets it through, over its thickness",
            "0.5",
            through.map_or(f64::NAN, |(depth, _)| depth / thickness),
            [0.499, 0.501],
            "",
        ),
        figure(
            (Method::Penalty, "Colgate and Schenkel 1997"),
            "damping of a device that its wall is passive on, K T / 2",
            format!("{bound:.3} N s/m"),
            damping::needed(Method::Penalty, tuning, HALF, 2),
            [bound - 1e-6, bound + 1e-6],
            "N s/m",
        ),
    ]
}
