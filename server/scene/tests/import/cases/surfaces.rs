//! Vertices that are not shared, and triangles that are none or too many.

use super::{Case, bad, good};
use crate::import::solids::{
    HALF, Noise, Soup, ball, flipped, joined, mapped, moved, part, sheet, six_volumes, with,
    without,
};
use crate::import::write::{obj_soup, ply, ply_soup, stl};

pub(super) fn shared_vertices() -> Vec<Case> {
    let ball_volume = || {
        let soup = ball(0.03);
        soup.iter().map(six_volumes).sum::<f64>() / 6.0
    };
    vec![
        good(
            "soup.ply",
            "triangles with vertices of their own",
            ply_soup(&part()),
        )
        .finds(&["vertices-equal"]),
        good("soup.obj", "the same as OBJ", obj_soup(&part())).finds(&["vertices-equal"]),
        good(
            "noise.ply",
            "the same, each corner off by up to 1e-7 m",
            ply_soup(&Noise::new().on(ball(0.03), 1e-7)),
        )
        .meant(ball(0.03))
        .finds(&["vertices-merged"])
        .solids(1, ball_volume())
        .error(2e-7),
        good(
            "rounded.stl",
            "each triangle rounded by itself, 1 m from the origin",
            stl(&Noise::new().on(moved(ball(0.03), [1.0, 1.0, 1.0]), 5e-8)),
        )
        .meant(ball(0.03))
        .finds(&["vertices-merged"])
        .solids(1, ball_volume())
        .error(4e-7),
        bad(
            "cracks.ply",
            "cracks of 0.1 mm",
            ply_soup(&Noise::new().on(ball(0.03), 1e-4)),
            "pieces of a triangle or two",
        ),
        good(
            "t-vertices.ply",
            "edges cut on one side only",
            ply(&with_t_vertices()),
        )
        .finds(&["sides-cut"]),
    ]
}

/// The box with the upper face cut into 4 x 3 cells, the other faces as they were.
fn with_t_vertices() -> Soup {
    let [x, y, z] = HALF;
    let top = moved(sheet([2.0 * x, 2.0 * y], [4, 3]), [-x, -y, z]);
    joined([without(part(), |p| p[2] == z), top])
}

/// The box with a corner put on the edge between two faces, by triangles without area.
fn with_flat_triangle() -> Soup {
    let [x, y, z] = HALF;
    let (a, b, c) = ([-x, -y, z], [x, -y, z], [0.0, -y, z]);
    // One face has the corner c, the other has not; between them lies a triangle whose corners are in one line.
    let mut soup = Vec::new();
    for t in part() {
        if t.iter().all(|p| p[2] == z) && t.contains(&a) && t.contains(&b) {
            let apex = t.into_iter().find(|p| *p != a && *p != b).unwrap();
            soup.extend([[a, c, apex], [c, b, apex], [a, b, c]]);
        } else {
            soup.push(t);
        }
    }
    soup
}

pub(super) fn thin_triangles() -> Vec<Case> {
    let [a, b, _] = part()[0];
    vec![
        good(
            "no-area.ply",
            "a triangle with two equal corners",
            ply(&with(part(), &[[a, a, b]])),
        )
        .finds(&["no-area"]),
        good(
            "in-line.ply",
            "a triangle with its corners in one line, as CAD programs leave them",
            ply(&with_flat_triangle()),
        )
        .finds(&["no-area", "sides-cut"]),
        good(
            "sliver.ply",
            "a sliver 1e-8 m high, which is part of the surface",
            ply(&sliver()),
        ),
    ]
}

pub(super) fn copies() -> Vec<Case> {
    let first = part()[0];
    vec![
        good("copy.ply", "a triangle twice", ply(&with(part(), &[first]))).finds(&["copies"]),
        good(
            "back.ply",
            "a triangle twice, back to back",
            ply(&with(part(), &flipped(vec![first]))),
        )
        .finds(&["backs"]),
        good(
            "twice.ply",
            "the whole part twice",
            ply(&joined([part(), part()])),
        )
        .finds(&["copies"]),
        good(
            "twice.obj",
            "the same, with vertices of their own",
            obj_soup(&joined([part(), part()])),
        )
        .finds(&["vertices-equal", "copies"]),
    ]
}

pub(super) fn whole_surfaces() -> Vec<Case> {
    let [a, b, _] = part()[0];
    vec![
        bad(
            "only-lines.ply",
            "nothing but triangles without area",
            ply(&vec![[a, a, b], [a, b, b]]),
            "has no triangle with an area",
        ),
        good(
            "flat.ply",
            "768 triangles of a turned box: many in one plane, to rounding",
            ply(&tilted()),
        )
        .meant(tilted()),
        good(
            "fine.ply",
            "768 triangles of a box, simplified",
            ply(&fine_box()),
        )
        .finds(&["simplified"])
        .options("--simplify 1e-6"),
    ]
}

/// The box with one edge cut twice, 1e-8 m apart.
fn sliver() -> Soup {
    let [x, y, z] = HALF;
    let (a, b) = ([-x, -y, z], [x, -y, z]);
    let cuts = [[0.0, -y, z], [1e-8, -y, z]];
    let mut soup = Vec::new();
    for t in part() {
        let from = (0..3).find(|k| [[a, b], [b, a]].contains(&[t[*k], t[(*k + 1) % 3]]));
        let Some(k) = from else {
            soup.push(t);
            continue;
        };
        let (from, to, apex) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
        let mut between = cuts;
        if from == b {
            between.reverse();
        }
        soup.extend([
            [from, between[0], apex],
            [between[0], between[1], apex],
            [between[1], to, apex],
        ]);
    }
    soup
}

fn tilted() -> Soup {
    let (s, c) = 0.7_f64.sin_cos();
    let about_z = |[x, y, z]: [f64; 3]| [c * x - s * y, s * x + c * y, z];
    let about_x = |[x, y, z]: [f64; 3]| [x, c * y - s * z, s * y + c * z];
    mapped(fine_box(), |p| about_x(about_z(p)))
}

fn fine_box() -> Soup {
    let halves = |p: &[f64; 3], q: &[f64; 3]| [0, 1, 2].map(|k| (p[k] + q[k]) / 2.0);
    let mut soup = part();
    for _ in 0..3 {
        soup = soup
            .iter()
            .flat_map(|[a, b, c]| {
                let (d, e, f) = (halves(a, b), halves(b, c), halves(c, a));
                [[*a, d, f], [d, *b, e], [f, e, *c], [d, e, f]]
            })
            .collect();
    }
    soup
}
