//! Holes, sheets, and bodies that touch.

use taut_scene::shapes::Axis;

use super::{Case, bad, good};
use crate::import::solids::{
    HALF, Soup, VOLUME, ball, flipped, joined, mapped, moved, part, sheet, six_volumes, soup_of,
    without,
};
use crate::import::write::{obj_soup, ply, stl};

pub(super) fn holes() -> Vec<Case> {
    let whole = ball(0.03);
    // Far apart in the order of the file, and so in space.
    let without_some = |count: usize| {
        let mut soup = whole.clone();
        (0..count).for_each(|k| {
            soup.remove(40 + 90 * k);
        });
        soup
    };
    let volume = |soup: &Soup| soup.iter().map(six_volumes).sum::<f64>() / 6.0;
    let cup = || without(part(), |p| p[2] == HALF[2]);
    let tin = || soup_of(&taut_scene::shapes::cylinder(0.02, 0.01, 24, Axis::Z));
    let opened = || without(tin(), |p| p[2] == 0.01);
    vec![
        good("hole.ply", "a triangle is missing", ply(&without_some(1)))
            .meant(whole.clone())
            .finds(&["holes-closed"])
            .solids(1, volume(&whole)),
        good(
            "holes.ply",
            "three triangles are missing",
            ply(&without_some(3)),
        )
        .meant(whole.clone())
        .finds(&["holes-closed"])
        .solids(1, volume(&whole)),
        bad(
            "cup.ply",
            "a box without its upper face, unasked",
            ply(&cup()),
            "write --close-holes 4; if it is a sheet, write --thicken",
        ),
        good("cup-closed.ply", "the same, to be closed", ply(&cup()))
            .finds(&["holes-closed"])
            .options("--close-holes 4"),
        good(
            "cup-thick.ply",
            "the same, to be a cup of sheet metal",
            ply(&cup()),
        )
        .meant(cup())
        .finds(&["thickened"])
        .solids(1, 1.2808e-5)
        .options("--thicken 0.002")
        .error(1e-12),
        good(
            "tin.ply",
            "a cylinder of 24 sides without its lid, to be closed",
            ply(&opened()),
        )
        .meant(tin())
        .finds(&["holes-closed"])
        .solids(1, volume(&tin()))
        .options("--close-holes 24"),
    ]
}

pub(super) fn sheets() -> Vec<Case> {
    let thickened = |file, what, soup: Soup, volume| {
        good(file, what, stl(&soup))
            .meant(soup)
            .finds(&["thickened"])
            .solids(1, volume)
            .options("--thicken 0.001")
    };
    vec![
        bad(
            "sheet.stl",
            "an open sheet",
            stl(&flat()),
            "if it is a sheet, write --thicken",
        ),
        bad(
            "sheet-closed.stl",
            "an open sheet, to be closed as a hole",
            stl(&flat()),
            "closed there it would hold nothing",
        )
        .options("--close-holes 64"),
        thickened(
            "sheet-thick.stl",
            "an open sheet, to be 1 mm thick",
            flat(),
            2.4e-6,
        ),
        thickened(
            "plate-thick.stl",
            "an open sheet with four holes for bolts, to be 1 mm thick",
            plate(),
            2.336e-6,
        ),
        thickened("bent.stl", "a bent sheet, to be 1 mm thick", bent(), 2.4e-6),
        good(
            "tee.stl",
            "two sheets that make a T, to be 1 mm thick",
            stl(&tee()),
        )
        .meant(tee())
        .finds(&["sheets-split", "taken-apart", "thickened", "meets-itself"])
        .solids(2, 3.6e-6)
        .options("--thicken 0.001"),
        good(
            "two-sided.ply",
            "a sheet of two sides with nothing between, to be 1 mm thick",
            ply(&joined([flat(), flipped(flat())])),
        )
        .meant(flat())
        .finds(&["backs", "thickened"])
        .solids(1, 2.4e-6)
        .options("--thicken 0.001"),
    ]
}

fn flat() -> Soup {
    sheet([0.06, 0.04], [6, 4])
}

/// A cell of 4 mm is gone near each corner: four edges and less than a percent of the area each.
fn plate() -> Soup {
    let in_cell = |c: f64, middle: f64| (c - middle).abs() < 0.0021;
    without(sheet([0.06, 0.04], [15, 10]), |[x, y, _]| {
        [0.006, 0.054].iter().any(|middle| in_cell(*x, *middle))
            && [0.006, 0.034].iter().any(|middle| in_cell(*y, *middle))
    })
}

fn bent() -> Soup {
    mapped(flat(), |[x, y, _]| {
        if x > 0.03 {
            [0.03, y, x - 0.03]
        } else {
            [x, y, 0.0]
        }
    })
}

fn tee() -> Soup {
    let stem = mapped(sheet([0.03, 0.04], [3, 4]), |[x, y, _]| [0.03, y, x]);
    joined([flat(), stem])
}

pub(super) fn contacts() -> Vec<Case> {
    let [x, y, z] = HALF;
    let beside = |way| moved(part(), way);
    let pair = |way| joined([part(), beside(way)]);
    // The inner wall: a rectangle across the box between its edges at y = +-0.02.
    let wall = vec![
        [[-x, -y, -z], [-x, -y, z], [x, y, z]],
        [[-x, -y, -z], [x, y, z], [x, y, -z]],
    ];
    vec![
        good(
            "at-an-edge.stl",
            "two boxes that touch at an edge",
            stl(&pair([2.0 * x, 2.0 * y, 0.0])),
        )
        .meant(pair([2.0 * x, 2.0 * y, 0.0]))
        .finds(&["taken-apart"])
        .solids(2, 2.0 * VOLUME),
        good(
            "at-a-vertex.stl",
            "two boxes that touch at a vertex",
            stl(&pair([2.0 * x, 2.0 * y, 2.0 * z])),
        )
        .meant(pair([2.0 * x, 2.0 * y, 2.0 * z]))
        .finds(&["taken-apart"])
        .solids(2, 2.0 * VOLUME),
        good(
            "at-a-face.stl",
            "two boxes that touch with a whole face each",
            stl(&joined([part(), mirrored(x)])),
        )
        .meant(joined([
            without(part(), |p| p[0] == x),
            without(mirrored(x), |p| p[0] == x),
        ]))
        .finds(&["inner-walls"])
        .solids(1, 2.0 * VOLUME),
        good(
            "overlap.stl",
            "two boxes that overlap",
            stl(&pair([x, y, z])),
        )
        .meant(pair([x, y, z]))
        .finds(&["meets-itself"])
        .solids(2, 2.0 * VOLUME),
        bad(
            "inner-wall.ply",
            "a wall across the inside",
            ply(&joined([part(), wall])),
            "it cannot be told which belong together",
        ),
        good(
            "two.obj",
            "two boxes apart, triangles with vertices of their own",
            obj_soup(&pair([0.1, 0.0, 0.0])),
        )
        .meant(pair([0.1, 0.0, 0.0]))
        .finds(&["vertices-equal"])
        .solids(2, 2.0 * VOLUME),
    ]
}

/// The box mirrored at the plane of its face at `x`: the triangles of that face are the same.
fn mirrored(x: f64) -> Soup {
    flipped(mapped(part(), |p| [2.0 * x - p[0], p[1], p[2]]))
}
