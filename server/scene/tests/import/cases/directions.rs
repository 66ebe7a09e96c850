//! Triangles and parts that look the wrong way, and cavities.

use super::{Case, bad, good};
use crate::import::solids::{Soup, Triangle, VOLUME, cuboid, flipped, joined, moved, part};
use crate::import::write::{ply, stl};

pub(super) fn turned() -> Vec<Case> {
    let beside = || moved(part(), [0.1, 0.0, 0.0]);
    let mut k = 0;
    let every_third = |t: Triangle| {
        k += 1;
        if k % 3 == 0 { [t[0], t[2], t[1]] } else { t }
    };
    let mixed: Soup = part().into_iter().map(every_third).collect();
    vec![
        good(
            "inside-out.stl",
            "all triangles turned",
            stl(&flipped(part())),
        )
        .finds(&["parts-turned"]),
        good(
            "one-turned.stl",
            "one triangle turned",
            stl(&joined([
                flipped(part()[..1].to_vec()),
                part()[1..].to_vec(),
            ])),
        )
        .finds(&["triangles-turned"]),
        good("mixed.stl", "every third triangle turned", stl(&mixed)).finds(&["triangles-turned"]),
        good(
            "one-part-turned.stl",
            "two parts, one of them inside out",
            stl(&joined([part(), flipped(beside())])),
        )
        .meant(joined([part(), beside()]))
        .finds(&["parts-turned"])
        .solids(2, 2.0 * VOLUME),
    ]
}

pub(super) fn cavities() -> Vec<Case> {
    const INNER: f64 = 8.0 * 0.01 * 0.008 * 0.005;
    const CORE: f64 = 8.0 * 8e-9;
    let inner = || cuboid([0.01, 0.008, 0.005]);
    let core = || moved(cuboid([0.002; 3]), [0.002, 0.0, 0.0]);
    vec![
        good(
            "cavity.ply",
            "a closed cavity",
            ply(&joined([part(), flipped(inner())])),
        )
        .meant(joined([part(), inner()]))
        .finds(&["cavities"])
        .solids(2, VOLUME - INNER),
        good(
            "cavity-inside-out.ply",
            "a closed cavity, all turned",
            ply(&joined([flipped(part()), inner()])),
        )
        .meant(joined([part(), inner()]))
        .finds(&["parts-turned", "cavities"])
        .solids(2, VOLUME - INNER),
        good(
            "cavity-outward.ply",
            "a closed cavity whose wall is turned",
            ply(&joined([part(), inner()])),
        )
        .meant(joined([part(), inner()]))
        .finds(&["parts-turned", "cavities"])
        .solids(2, VOLUME - INNER),
        good(
            "core.ply",
            "a body in the cavity, turned",
            ply(&joined([part(), flipped(inner()), flipped(core())])),
        )
        .meant(joined([part(), inner(), core()]))
        .finds(&["parts-turned", "cavities"])
        .solids(3, VOLUME - INNER + CORE),
    ]
}

pub(super) fn one_sided() -> Vec<Case> {
    vec![bad(
        "moebius.ply",
        "a surface with one side only",
        ply(&moebius()),
        "one side only",
    )]
}

fn moebius() -> Soup {
    const CELLS: usize = 24;
    let at = |i: usize, side: f64| {
        let turn = i as f64 / CELLS as f64 * std::f64::consts::TAU;
        let (s, c) = (turn / 2.0).sin_cos();
        let r = 0.03 + 0.01 * side * c;
        // The last ring is the first one, the other way round, to the digit.
        [r * turn.cos(), r * turn.sin(), 0.01 * side * s]
    };
    let ring = |i: usize| {
        if i == CELLS {
            [at(0, 1.0), at(0, -1.0)]
        } else {
            [at(i, -1.0), at(i, 1.0)]
        }
    };
    (0..CELLS)
        .flat_map(|i| {
            let ([a, b], [c, d]) = (ring(i), ring(i + 1));
            [[a, c, b], [b, c, d]]
        })
        .collect()
}
