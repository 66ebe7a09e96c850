//! How much damping a device needs so that nothing can be got out of a method.
//!
//! | symbol | unit  | meaning                                              |
//! |--------|-------|------------------------------------------------------|
//! | K, B   | N/m, N s/m | spring and damper between the hand and what it touches |
//! | T      | s     | time between forces: `TICK`                          |
//! | b      | N s/m | damping of the device                                |
//!
//! Source: Colgate and Schenkel 1997, "Passivity of a class of sampled-data systems": b > T / 2 Re((1 - exp(-j w T)) H) / (1 - cos w T) at all
//! frequencies. For H = K + B (z - 1) / (T z) that is b > K T / 2 - B cos w T, at worst K T / 2 + |B|.

use std::f64::consts::TAU;

use god_object::spatial::linear;

use super::{HALF, at, driven};
use crate::clock::TICK;
use crate::method::{Method, Scene, Tuning};
use crate::recipes::{ball, ground};

/// Half the swing of the device, m.
const SWING: f64 = 1e-4;
/// Ticks on the way to the middle of the swing and until the method has settled there, and ticks of the swing: the last half counts.
const SETTLED: u32 = 400;
const SWINGS: u32 = 256;

/// A ball above a wall.
pub(super) fn wall() -> Scene {
    Scene::new(ball(HALF), [ground()], 2.0 * HALF, 0.1, at(HALF + 1e-4))
}

/// K T / 2, N s/m.
pub(super) fn of_spring() -> f64 {
    0.5 * wall().stiffness() * TICK
}

/// The most of [`needed`] over K T / 2 + B, of every tuning of a method with a damped body, over swings of these ticks.
pub(super) fn most_over_bound(method: Method, depth: f64, swings: &[u32]) -> f64 {
    let scene = wall();
    let over_bound = |tuning: Tuning| {
        let (Tuning::Proxy {
            share,
            damping_ratio,
            ..
        }
        | Tuning::Tool {
            share,
            damping_ratio,
            ..
        }) = tuning
        else {
            panic!("{tuning}: no damped body")
        };
        let inertia = share * scene.world.body.mass;
        let damper = 2.0 * damping_ratio * (scene.stiffness() * inertia).sqrt();
        let bound = of_spring() + damper;
        let over = move |swing: &u32| needed(method, tuning, depth, *swing) / bound;
        swings.iter().map(over).fold(f64::NEG_INFINITY, f64::max)
    };
    let each = method.tunings().into_iter().map(over_bound);
    each.fold(f64::NEG_INFINITY, f64::max)
}

/// The damping, N s/m, that takes as much as comes out of a method. The device swings about a depth in the wall, m, once in so many ticks, at
/// constant speed between samples: of all motions with these samples the one that a damper takes least of.
pub(super) fn needed(method: Method, tuning: Tuning, depth: f64, swing: u32) -> f64 {
    let height = |tick: u32| {
        let down = depth * (f64::from(2 * tick) / f64::from(SETTLED)).min(1.0);
        let turn = TAU * f64::from(tick % swing) / f64::from(swing);
        let swung = if tick < SETTLED {
            0.0
        } else {
            SWING * turn.cos()
        };
        HALF - down + swung
    };
    let mut method = method.start(&wall(), TICK, tuning);
    let run = driven(method.as_mut(), (SETTLED + SWINGS, 1), |tick| {
        at(height(tick))
    });
    let (mut given, mut taken) = (0.0, 0.0);
    for tick in SETTLED + SWINGS / 2..SETTLED + SWINGS {
        let way = height(tick + 1) - height(tick);
        given += linear(&run[tick as usize].1).z * way;
        taken += way * way / TICK;
    }
    given / taken
}
