//! Colgate, Stanley and Brown 1995: behind a coupling of spring and damper any passive simulation is passive on a device that is damped by
//! K T / 2 + |B|; a wall needs all of that.

use super::{Figure, HALF, damping, figure};
use crate::method::Method;

/// Ticks of a swing: the fastest, and others.
const FASTEST: u32 = 2;
const SWINGS: [u32; 6] = [FASTEST, 4, 8, 16, 32, 64];
/// Where nothing is touched, m below the wall's face.
const FREE: f64 = -0.02;

pub(super) fn figures() -> Vec<Figure> {
    let most = |depth, swings| damping::most_over_bound(Method::VirtualCoupling, depth, swings);
    let source = (
        Method::VirtualCoupling,
        "Colgate, Stanley and Brown 1995; Colgate and Schenkel 1997",
    );
    let figure =
        |of, published, here, least| figure(source, of, published, here, [least, 1.0 + 1e-6], "");
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
