//! Barbic and James 2008: the coupling saturates, so that a device that is far inside presses no deeper than the contacts bear; and a coupling without
//! damping is a spring.

use super::{Figure, HALF, at, damping, driven, figure};
use crate::clock::TICK;
use crate::method::{Method, Scene};
use crate::recipes::{block, cube};
use crate::tuning::{ShellPoints, Tuning};

/// Of a contact over that of the coupling.
const RATIO: f64 = 1e3;
/// How far beyond the plate the device goes, m, and steps on the way.
const BEYOND: f64 = 0.05;
const STEPS: u32 = 500;
const PLATE: f64 = 1e-4;

/// Along the normals of the points, as published, with a body that stands between updates.
const AS_PUBLISHED: Tuning = Tuning::Static {
    points: ShellPoints::Spaced(0.125),
    stiffness: RATIO,
    own_normals: true,
    goes_on: false,
};

pub(super) fn figures() -> Vec<Figure> {
    let plate = block("plate", [-0.1, -0.1, -PLATE].into(), [0.1, 0.1, 0.0].into());
    let scene = Scene::new(cube(HALF), [plate], 2.0 * HALF, 0.1, at(2.0 * HALF));
    let way = HALF + BEYOND;
    let height = |tick: u32| 2.0 * HALF - way * f64::from(tick) / f64::from(STEPS);
    let mut method = Method::StaticCoupling.start(&scene, TICK, AS_PUBLISHED);
    let run = driven(method.as_mut(), (STEPS, 1), |tick| at(height(tick)));
    let lowest = run.iter().map(|(pose, _)| pose.translation.z - HALF);
    let lowest = lowest.fold(f64::INFINITY, f64::min);
    let limit = scene.settings.force_limit;
    let contact = RATIO * scene.stiffness();
    let last = run[run.len() - 1].1[2];
    let source = (Method::StaticCoupling, "Barbic and James 2008");
    let bound = damping::of_spring() * RATIO / (1.0 + RATIO);
    vec![
        figure(
            source,
            "depth in a plate of 0.1 mm, from the offset on, with the device 45 mm beyond it: the coupling saturates",
            format!("at most {:.1e} m", limit / contact),
            limit / contact - lowest,
            [0.0, limit / contact],
            "m",
        ),
        figure(
            source,
            "force there",
            format!("{limit} N, where the coupling saturates"),
            last,
            [limit - 1e-6, limit + 1e-6],
            "N",
        ),
        figure(
            (Method::StaticCoupling, "Colgate and Schenkel 1997"),
            "damping of a device that its wall is passive on, K T / 2 of both springs in series",
            format!("{bound:.4} N s/m"),
            damping::needed(Method::StaticCoupling, SERIES, HALF, 2),
            [bound - 1e-6, bound + 1e-6],
            "N s/m",
        ),
    ]
}

/// One point with a radius, so that a single spring is in series with the coupling.
const SERIES: Tuning = Tuning::Static {
    points: ShellPoints::Round,
    stiffness: RATIO,
    own_normals: false,
    goes_on: false,
};
