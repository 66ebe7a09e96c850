//! Colgate, Stanley and Brown 1995: behind a coupling of spring and damper any passive simulation is passive on a device that is damped by
//! K T / 2 + |B|; a wall needs all of that.

use super::{Figure, HALF, damping};
use crate::method::{Method, Tuning};

/// Ticks of a swing: the fastest, and others.
const FASTEST: u32 = 2;
const SWINGS: [u32; 6] = [FASTEST, 4, 8, 16, 32, 64];
/// Where nothing is touched, m below the wall's face.
const FREE: f64 = -0.02;

pub(super) fn figures() -> Vec<Figure> {
    let most = |depth: f64, swings: &[u32]| {
        let tunings = Method::VirtualCoupling.tunings();
        let each = tunings.iter().flat_map(|tuning| {
            let needed = |swing| damping::needed(Method::VirtualCoupling, *tuning, depth, swing);
            swings
                .iter()
                .map(move |swing| needed(*swing) / bound(*tuning))
        });
        each.fold(f64::NEG_INFINITY, f64::max)
    };
    let figure = |of: &str, published: &str, here: f64, least: f64| Figure {
        method: Method::VirtualCoupling,
        of: of.to_owned(),
        source: "Colgate, Stanley and Brown 1995; Colgate and Schenkel 1997",
        published: published.to_owned(),
        here,
        within: [least, 1.0 + 1e-6],
        unit: "",
    };
    vec![
        figure(
            "damping of a device that its wall is passive on, over K T / 2 + B, every tuning",
            "1",
            most(HALF, &[FASTEST]),
            1.0 - 1e-6,
        ),
        figure(
            "the same where nothing is touched, swings of 2 to 64 ms",
            "at most 1",
            most(FREE, &SWINGS),
            f64::NEG_INFINITY,
        ),
        figure(
            "the same where the wall is touched and left",
            "at most 1",
            most(0.0, &SWINGS),
            f64::NEG_INFINITY,
        ),
    ]
}

/// K T / 2 + B of a tuning, N s/m.
fn bound(tuning: Tuning) -> f64 {
    let Tuning::Proxy {
        share,
        damping_ratio,
        ..
    } = tuning
    else {
        panic!("{tuning}: not of virtual coupling")
    };
    let scene = damping::wall();
    let inertia = share * scene.world.body.mass;
    damping::of_spring() + 2.0 * damping_ratio * (scene.stiffness() * inertia).sqrt()
}
