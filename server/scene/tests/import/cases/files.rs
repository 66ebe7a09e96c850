//! Formats, units, places, and files that are broken.

use super::{Case, MM, bad, good};
use crate::import::solids::{VOLUME, moved, part, scaled};
use crate::import::write::{glb, obj_soup, ply, stl, stl_text};

pub(super) fn formats() -> Vec<Case> {
    vec![
        good("clean.ply", "nothing", ply(&part())),
        good("clean.stl", "binary STL in metres", stl(&part())),
        good("text.stl", "STL as text", stl_text(&part())),
        good("clean.glb", "glTF, which is in metres", glb(&part())),
    ]
}

pub(super) fn units() -> Vec<Case> {
    vec![
        good("mm.stl", "millimetres", stl(&scaled(part(), MM))).options("--unit mm"),
        bad(
            "mm-unsaid.stl",
            "millimetres, but nobody says so",
            stl(&scaled(part(), MM)),
            "write --unit cm (0.6000 m) or --unit mm (0.0600 m)",
        ),
        good(
            "inch.obj",
            "inches",
            obj_soup(&scaled(part(), 1.0 / 0.0254)),
        )
        .finds(&["vertices-equal"])
        .options("--unit inch"),
        bad(
            "tiny.stl",
            "a part of 60 um, taken for metres",
            stl(&scaled(part(), 1e-3)),
            "nothing for a hand if that is in metres",
        ),
        good(
            "tiny-meant.stl",
            "a part of 60 um that is meant so",
            stl(&scaled(part(), 1e-3)),
        )
        .meant(scaled(part(), 1e-3))
        .solids(1, VOLUME * 1e-9)
        .options("--unit m"),
        bad(
            "huge.ply",
            "coordinates of 1e200",
            ply(&scaled(part(), 1e200)),
            "must have one between",
        )
        .options("--unit m"),
    ]
}

pub(super) fn far_places() -> Vec<Case> {
    vec![
        good(
            "far.ply",
            "a kilometre from the origin, double precision",
            ply(&moved(part(), [1e3, 2e3, 0.0])),
        )
        .error(1e-12),
        bad(
            "far.stl",
            "a kilometre from the origin, single precision",
            stl(&moved(part(), [1e3, 2e3, 0.0])),
            "export it near the origin",
        ),
        good("stray.ply", "a vertex of no triangle, 1,000 km away", {
            let text = String::from_utf8(ply(&part())).unwrap();
            text.replace("vertex 8", "vertex 9")
                .replacen("\n3 ", "\n1e6 0 0\n3 ", 1)
                .into_bytes()
        }),
    ]
}

pub(super) fn broken() -> Vec<Case> {
    let whole = stl(&part());
    let mut nan = part();
    nan[3][1][2] = f64::NAN;
    vec![
        bad(
            "nan.stl",
            "a coordinate that is no number",
            stl(&nan),
            "vertex 10 has z = NaN",
        ),
        bad("empty.stl", "no bytes", Vec::new(), "is no STL file"),
        bad(
            "empty.ply",
            "no triangles",
            ply(&Vec::new()),
            "has no faces",
        ),
        bad(
            "cut-off.stl",
            "the end is missing",
            whole[..whole.len() - 70].to_vec(),
            "is cut off: 12 triangles are promised, 10 are there",
        ),
        bad(
            "index.obj",
            "a face names a vertex that is not there",
            [obj_soup(&part()), b"f 1 2 99\n".to_vec()].concat(),
            "names vertex 99, but the file has 36",
        ),
        bad(
            "picture.obj",
            "no mesh at all",
            b"\x89PNG\r\n\x1a\n".to_vec(),
            "has no faces",
        ),
        bad(
            "point.ply",
            "all corners are one",
            ply(&vec![[[0.01; 3]; 3]; 4]),
            "nothing for a hand",
        ),
    ]
}
