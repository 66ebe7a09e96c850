//! Points without faces.

use std::fmt::Write as _;

use taut_scene::shapes::sphere;

use super::{Case, bad, good};
use crate::import::solids::{Point, Soup, ball, six_volumes};
use crate::import::write::ply_points;

/// The points of a ball of 642 vertices, some 3 mm apart.
fn scan() -> Vec<Point> {
    sphere(0.02, 3)
        .vertices
        .iter()
        .map(|p| (*p).into())
        .collect()
}

pub(super) fn clouds() -> Vec<Case> {
    let mut text = String::from("x;y;z;intensity\n");
    for [x, y, z] in scan() {
        writeln!(text, "{};{};{};7", 1e3 * x, 1e3 * y, 1e3 * z).unwrap();
    }
    // The points lie on its middle.
    let shell = |soup: &Soup, thickness: f64| {
        let radius = (3.0 * soup.iter().map(six_volumes).sum::<f64>()
            / (24.0 * std::f64::consts::PI))
            .cbrt();
        let [outer, inner] = [0.5, -0.5].map(|half| radius + half * thickness);
        4.0 / 3.0 * std::f64::consts::PI * (outer.powi(3) - inner.powi(3))
    };
    let whole = ball(0.02);
    vec![
        bad(
            "scan.ply",
            "points without faces, unasked",
            ply_points(&scan()),
            "`taut import --thicken` makes a shell around them",
        ),
        good(
            "scan-thick.csv",
            "the same as text, in millimetres, to be a shell of 10 mm",
            text.into_bytes(),
        )
        .meant(whole.clone())
        .finds(&["shelled", "cavities"])
        .solids(2, shell(&whole, 1e-2))
        .options("--unit mm --thicken 0.01")
        .error(1e-3),
        bad(
            "scan-far.ply",
            "the same in single precision, 30 km away",
            ply_points(&scan().into_iter().map(far).collect::<Vec<_>>()),
            "move them near to the origin in double precision",
        )
        .options("--thicken 0.004"),
    ]
}

fn far(point: Point) -> Point {
    point.map(|c| f64::from((c + 3e4) as f32))
}
