//! Duriez et al. 2006, Saupin et al. 2008: contacts hold exactly, whatever their number, and the loop of the forces is as live between updates as in one.

use god_object::spatial::linear;

use super::{Figure, HALF, at, driven, figure};
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
    let depth = |tick: u32| {
        let turn = std::f64::consts::TAU * f64::from(tick) / f64::from(TICKS);
        0.5 * DEEP * (1.0 - turn.cos())
    };
    let run = driven(method.as_mut(), (TICKS, SELDOM), |tick| {
        let mut device = at(HALF - depth(tick));
        device.translation.x = SPEED * (f64::from(tick) * TICK);
        device
    });
    let (mut along, mut error) = (0.0_f64, 0.0_f64);
    for (tick, (_, wrench)) in (0..).zip(&run) {
        let force = linear(wrench);
        along = along.max(force.xy().norm());
        error = error.max((force.z - depth(tick) * scene.stiffness()).abs());
    }
    // The rest distance that contacts keep is felt, and what Gauss-Seidel leaves.
    let most = 2.0 * scene.settings.rest_distance * scene.stiffness();
    let source = (Method::TwoRateLcp, "Saupin et al. 2008");
    vec![
        figure(
            source,
            "error of the force of a cube that swings into a plane while it slides, updates every 33 ms",
            "0 N: the problem is solved anew for each force",
            error,
            [0.0, most],
            "N",
        ),
        figure(
            source,
            "force along the plane there",
            "0 N",
            along,
            [0.0, most],
            "N",
        ),
    ]
}
