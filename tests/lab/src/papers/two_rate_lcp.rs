//! Duriez et al. 2006, Saupin et al. 2008: contacts hold exactly, whatever their number, and the loop of the forces is as live between updates as in one.

use god_object::spatial::linear;

use super::{Figure, HALF, at};
use crate::clock::TICK;
use crate::method::{Method, Scene};
use crate::recipes::{cube, ground};

/// Ticks between updates: far fewer of them than forces.
const SELDOM: u32 = 33;
const TICKS: u32 = 600;
const SPEED: f64 = 0.1;
/// How deep the device goes into the plane and comes out of it, m, in one swing.
const DEEP: f64 = 2e-3;

pub(super) fn figures() -> Vec<Figure> {
    let scene = Scene::new(cube(HALF), [ground()], 2.0 * HALF, SPEED, at(HALF));
    let tuning = Method::TwoRateLcp.tunings()[0];
    let mut method = Method::TwoRateLcp.start(&scene, f64::from(SELDOM) * TICK, tuning);
    let (mut along, mut error) = (0.0_f64, 0.0_f64);
    for tick in 0..TICKS {
        let time = f64::from(tick) * TICK;
        let turn = std::f64::consts::TAU * f64::from(tick) / f64::from(TICKS);
        let depth = 0.5 * DEEP * (1.0 - turn.cos());
        let mut device = at(HALF - depth);
        device.translation.x = SPEED * time;
        if tick % SELDOM == 0 {
            method.update(time, &device);
            method.publish(time);
        }
        let force = linear(&method.force(time, &device));
        along = along.max(force.xy().norm());
        error = error.max((force.z - depth * scene.stiffness()).abs());
    }
    // The rest distance that contacts keep is felt, and what Gauss-Seidel leaves.
    let most = 2.0 * scene.settings.rest_distance * scene.stiffness();
    let figure = |of: &str, published: &str, here: f64, most: f64| Figure {
        method: Method::TwoRateLcp,
        of: of.to_owned(),
        source: "Saupin et al. 2008",
        published: published.to_owned(),
        here,
        within: [0.0, most],
        unit: "N",
    };
    vec![
        figure(
            "error of the force of a cube that swings into a plane while it slides, updates every 33 ms",
            "0 N: the problem is solved anew for each force",
            error,
            most,
        ),
        figure("force along the plane there", "0 N", along, most),
    ]
}
