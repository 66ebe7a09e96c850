//! Awkward part files, what `taut import` does with each, and whether that is so.

use std::path::{Path, PathBuf};

use taut_scene::shapes::Axis;
use taut_scene::{FileError, ImportReport, ImportRequest, import};

use super::judge::{judge, one_sided};
use super::solids::{
    HALF, Noise, Soup, Triangle, VOLUME, ball, cuboid, flipped, joined, mapped, moved, part,
    scaled, sheet, soup_of, with, without,
};
use super::write::{glb, obj_soup, ply, ply_soup, stl, stl_text};

/// One file.
pub(crate) struct Case {
    /// File name, unique.
    pub file: &'static str,
    /// What is awkward.
    pub what: &'static str,
    pub bytes: Vec<u8>,
    /// Options beside `--out`, as on the command line.
    pub options: &'static str,
    /// The solid that is meant, m; empty where the file is refused.
    pub truth: Soup,
    /// How far the file itself is from that, m.
    pub error: f64,
    pub expected: Expected,
}

pub(crate) enum Expected {
    Imported {
        /// Of the findings, in order.
        kinds: &'static [&'static str],
        /// Connected parts.
        parts: usize,
        /// m^3.
        volume: f64,
    },
    /// What the refusal contains.
    Refused(&'static str),
}

/// Error of single precision for coordinates below 0.25 m: half a unit in the last place along each axis.
const SINGLE: f64 = 1.3e-8;

fn good(
    file: &'static str,
    what: &'static str,
    bytes: Vec<u8>,
    truth: Soup,
    kinds: &'static [&'static str],
    (parts, volume): (usize, f64),
) -> Case {
    Case {
        file,
        what,
        bytes,
        options: "",
        truth,
        error: SINGLE,
        expected: Expected::Imported {
            kinds,
            parts,
            volume,
        },
    }
}

fn bad(file: &'static str, what: &'static str, bytes: Vec<u8>, text: &'static str) -> Case {
    Case {
        file,
        what,
        bytes,
        options: "",
        truth: Vec::new(),
        error: 0.0,
        expected: Expected::Refused(text),
    }
}

impl Case {
    fn options(self, options: &'static str) -> Self {
        Self { options, ..self }
    }

    fn error(self, error: f64) -> Self {
        Self { error, ..self }
    }
}

pub(crate) fn cases() -> Vec<Case> {
    [
        formats_and_units(),
        shared_vertices(),
        faces(),
        directions(),
        openings(),
        contacts(),
        broken(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

const ONE: (usize, f64) = (1, VOLUME);
const MM: f64 = 1e3;

fn formats_and_units() -> Vec<Case> {
    vec![
        good("clean.ply", "nothing", ply(&part()), part(), &[], ONE),
        good(
            "clean.stl",
            "binary STL in metres",
            stl(&part()),
            part(),
            &[],
            ONE,
        ),
        good(
            "text.stl",
            "STL as text",
            stl_text(&part()),
            part(),
            &[],
            ONE,
        ),
        good(
            "clean.glb",
            "glTF, which is in metres",
            glb(&part()),
            part(),
            &[],
            ONE,
        ),
        good(
            "mm.stl",
            "millimetres",
            stl(&scaled(part(), MM)),
            part(),
            &[],
            ONE,
        )
        .options("--unit mm"),
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
            part(),
            &["vertices-equal"],
            ONE,
        )
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
            scaled(part(), 1e-3),
            &[],
            (1, VOLUME * 1e-9),
        )
        .options("--unit m"),
        bad(
            "huge.ply",
            "coordinates of 1e200",
            ply(&scaled(part(), 1e200)),
            "must have one between",
        )
        .options("--unit m"),
        good(
            "far.ply",
            "a kilometre from the origin, double precision",
            ply(&moved(part(), [1e3, 2e3, 0.0])),
            part(),
            &[],
            ONE,
        )
        .error(1e-12),
        bad(
            "far.stl",
            "a kilometre from the origin, single precision",
            stl(&moved(part(), [1e3, 2e3, 0.0])),
            "export it near the origin",
        ),
        good(
            "stray.ply",
            "a vertex of no triangle, 1,000 km away",
            {
                let text = String::from_utf8(ply(&part())).unwrap();
                text.replace("vertex 8", "vertex 9")
                    .replacen("\n3 ", "\n1e6 0 0\n3 ", 1)
                    .into_bytes()
            },
            part(),
            &[],
            ONE,
        ),
    ]
}

fn shared_vertices() -> Vec<Case> {
    let ball_volume = || {
        let soup = ball(0.03);
        soup.iter().map(six_volumes).sum::<f64>() / 6.0
    };
    vec![
        good(
            "soup.ply",
            "triangles with vertices of their own",
            ply_soup(&part()),
            part(),
            &["vertices-equal"],
            ONE,
        ),
        good(
            "soup.obj",
            "the same as OBJ",
            obj_soup(&part()),
            part(),
            &["vertices-equal"],
            ONE,
        ),
        good(
            "noise.ply",
            "the same, each corner off by up to 1e-7 m",
            ply_soup(&Noise::new().on(ball(0.03), 1e-7)),
            ball(0.03),
            &["vertices-merged"],
            (1, ball_volume()),
        )
        .error(2e-7),
        good(
            "rounded.stl",
            "each triangle rounded by itself, 1 m from the origin",
            stl(&Noise::new().on(moved(ball(0.03), [1.0, 1.0, 1.0]), 5e-8)),
            ball(0.03),
            &["vertices-merged"],
            (1, ball_volume()),
        )
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
            part(),
            &["sides-cut"],
            ONE,
        ),
    ]
}

fn six_volumes([a, b, c]: &Triangle) -> f64 {
    let [x, y, z] = *a;
    x * (b[1] * c[2] - b[2] * c[1])
        + y * (b[2] * c[0] - b[0] * c[2])
        + z * (b[0] * c[1] - b[1] * c[0])
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

fn faces() -> Vec<Case> {
    let first = part()[0];
    let [a, b, _] = first;
    vec![
        good(
            "no-area.ply",
            "a triangle with two equal corners",
            ply(&with(part(), &[[a, a, b]])),
            part(),
            &["no-area"],
            ONE,
        ),
        good(
            "in-line.ply",
            "a triangle with its corners in one line, as CAD programs leave them",
            ply(&with_flat_triangle()),
            part(),
            &["no-area", "sides-cut"],
            ONE,
        ),
        good(
            "sliver.ply",
            "a sliver 1e-8 m high, which is part of the surface",
            ply(&sliver()),
            part(),
            &[],
            ONE,
        ),
        good(
            "copy.ply",
            "a triangle twice",
            ply(&with(part(), &[first])),
            part(),
            &["copies"],
            ONE,
        ),
        good(
            "back.ply",
            "a triangle twice, back to back",
            ply(&with(part(), &flipped(vec![first]))),
            part(),
            &["backs"],
            ONE,
        ),
        good(
            "twice.ply",
            "the whole part twice",
            ply(&joined([part(), part()])),
            part(),
            &["copies"],
            ONE,
        ),
        good(
            "twice.obj",
            "the same, with vertices of their own",
            obj_soup(&joined([part(), part()])),
            part(),
            &["vertices-equal", "copies"],
            ONE,
        ),
        bad(
            "only-lines.ply",
            "nothing but triangles without area",
            ply(&vec![[a, a, b], [a, b, b]]),
            "has no triangle with an area",
        ),
        good(
            "flat.ply",
            "3,072 triangles of a turned box: many in one plane, to rounding",
            ply(&tilted()),
            tilted(),
            &[],
            ONE,
        ),
        good(
            "fine.ply",
            "3,072 triangles of a box, simplified",
            ply(&fine_box()),
            part(),
            &["simplified"],
            ONE,
        )
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
    for _ in 0..4 {
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

fn directions() -> Vec<Case> {
    let inner = || cuboid([0.01, 0.008, 0.005]);
    const INNER: f64 = 8.0 * 0.01 * 0.008 * 0.005;
    let beside = || moved(part(), [0.1, 0.0, 0.0]);
    let mixed = || {
        let mut k = 0;
        let turn = |t: Triangle| {
            k += 1;
            if k % 3 == 0 { [t[0], t[2], t[1]] } else { t }
        };
        part().into_iter().map(turn).collect::<Soup>()
    };
    let core = || moved(cuboid([0.002; 3]), [0.002, 0.0, 0.0]);
    const CORE: f64 = 8.0 * 8e-9;
    vec![
        good(
            "inside-out.stl",
            "all triangles turned",
            stl(&flipped(part())),
            part(),
            &["parts-turned"],
            ONE,
        ),
        good(
            "one-turned.stl",
            "one triangle turned",
            stl(&joined([
                flipped(part()[..1].to_vec()),
                part()[1..].to_vec(),
            ])),
            part(),
            &["triangles-turned"],
            ONE,
        ),
        good(
            "mixed.stl",
            "every third triangle turned",
            stl(&mixed()),
            part(),
            &["triangles-turned"],
            ONE,
        ),
        good(
            "one-part-turned.stl",
            "two parts, one of them inside out",
            stl(&joined([part(), flipped(beside())])),
            joined([part(), beside()]),
            &["parts-turned"],
            (2, 2.0 * VOLUME),
        ),
        good(
            "cavity.ply",
            "a closed cavity",
            ply(&joined([part(), flipped(inner())])),
            joined([part(), inner()]),
            &["cavities"],
            (2, VOLUME - INNER),
        ),
        good(
            "cavity-inside-out.ply",
            "a closed cavity, all turned",
            ply(&joined([flipped(part()), inner()])),
            joined([part(), inner()]),
            &["parts-turned", "cavities"],
            (2, VOLUME - INNER),
        ),
        good(
            "cavity-outward.ply",
            "a closed cavity whose wall is turned",
            ply(&joined([part(), inner()])),
            joined([part(), inner()]),
            &["parts-turned", "cavities"],
            (2, VOLUME - INNER),
        ),
        good(
            "core.ply",
            "a body in the cavity, turned",
            ply(&joined([part(), flipped(inner()), flipped(core())])),
            joined([part(), inner(), core()]),
            &["parts-turned", "cavities"],
            (3, VOLUME - INNER + CORE),
        ),
        bad(
            "moebius.ply",
            "a surface with one side only",
            ply(&moebius()),
            "one side only",
        ),
    ]
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

fn openings() -> Vec<Case> {
    let holed = |count: usize| {
        let whole = ball(0.03);
        let mut soup = whole.clone();
        // Far apart in the order of the file, and so in space.
        (0..count).for_each(|k| {
            soup.remove(100 + 300 * k);
        });
        (soup, whole)
    };
    let volume = |soup: &Soup| soup.iter().map(six_volumes).sum::<f64>() / 6.0;
    let ((one, whole), (three, _)) = (holed(1), holed(3));
    let cup = || without(part(), |p| p[2] == HALF[2]);
    let flat = || sheet([0.06, 0.04], [6, 4]);
    let bent = || {
        mapped(flat(), |[x, y, _]| {
            if x > 0.03 {
                [0.03, y, x - 0.03]
            } else {
                [x, y, 0.0]
            }
        })
    };
    let tin = || soup_of(&taut_scene::shapes::cylinder(0.02, 0.01, 24, Axis::Z));
    let opened = || without(tin(), |p| p[2] == 0.01);
    vec![
        good(
            "hole.ply",
            "a triangle is missing",
            ply(&one),
            whole.clone(),
            &["holes-closed"],
            (1, volume(&whole)),
        ),
        good(
            "holes.ply",
            "three triangles are missing",
            ply(&three),
            whole.clone(),
            &["holes-closed"],
            (1, volume(&whole)),
        ),
        bad(
            "cup.ply",
            "a box without its upper face, unasked",
            ply(&cup()),
            "write --close-holes 4; if it is a sheet, write --thicken",
        ),
        good(
            "cup-closed.ply",
            "the same, to be closed",
            ply(&cup()),
            part(),
            &["holes-closed"],
            ONE,
        )
        .options("--close-holes 4"),
        good(
            "cup-thick.ply",
            "the same, to be a cup of sheet metal",
            ply(&cup()),
            cup(),
            &["thickened"],
            (1, 1.2808e-5),
        )
        .options("--thicken 0.002")
        .error(1e-12),
        good(
            "tin.ply",
            "a cylinder of 24 sides without its lid, to be closed",
            ply(&opened()),
            tin(),
            &["holes-closed"],
            (1, volume(&tin())),
        )
        .options("--close-holes 24"),
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
        good(
            "sheet-thick.stl",
            "an open sheet, to be 1 mm thick",
            stl(&flat()),
            flat(),
            &["thickened"],
            (1, 2.4e-6),
        )
        .options("--thicken 0.001"),
        good(
            "bent.stl",
            "a bent sheet, to be 1 mm thick",
            stl(&bent()),
            bent(),
            &["thickened"],
            (1, 2.4e-6),
        )
        .options("--thicken 0.001"),
        good(
            "two-sided.ply",
            "a sheet of two sides with nothing between, to be 1 mm thick",
            ply(&joined([flat(), flipped(flat())])),
            flat(),
            &["backs", "thickened"],
            (1, 2.4e-6),
        )
        .options("--thicken 0.001"),
    ]
}

fn contacts() -> Vec<Case> {
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
            pair([2.0 * x, 2.0 * y, 0.0]),
            &["taken-apart"],
            (2, 2.0 * VOLUME),
        ),
        good(
            "at-a-vertex.stl",
            "two boxes that touch at a vertex",
            stl(&pair([2.0 * x, 2.0 * y, 2.0 * z])),
            pair([2.0 * x, 2.0 * y, 2.0 * z]),
            &["taken-apart"],
            (2, 2.0 * VOLUME),
        ),
        good(
            "at-a-face.stl",
            "two boxes that touch with a whole face each",
            stl(&joined([part(), mirrored(x)])),
            joined([
                without(part(), |p| p[0] == x),
                without(mirrored(x), |p| p[0] == x),
            ]),
            &["inner-walls"],
            (1, 2.0 * VOLUME),
        ),
        good(
            "overlap.stl",
            "two boxes that overlap",
            stl(&pair([x, y, z])),
            pair([x, y, z]),
            &["meets-itself"],
            (2, 2.0 * VOLUME),
        ),
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
            pair([0.1, 0.0, 0.0]),
            &["vertices-equal"],
            (2, 2.0 * VOLUME),
        ),
    ]
}

/// The box mirrored at the plane of its face at `x`: the triangles of that face are the same.
fn mirrored(x: f64) -> Soup {
    flipped(mapped(part(), |p| [2.0 * x - p[0], p[1], p[2]]))
}

fn broken() -> Vec<Case> {
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

/// Imports one case into `folder`, where its file is.
pub(crate) fn run(case: &Case, folder: &Path) -> (PathBuf, Result<ImportReport, FileError>) {
    let file = folder.join(case.file);
    std::fs::write(&file, &case.bytes).unwrap();
    let out = folder.join(format!("{}.out", case.file));
    let mut request = ImportRequest {
        parts: vec![file],
        folder: out.clone(),
        ..ImportRequest::default()
    };
    let words: Vec<&str> = case.options.split_whitespace().collect();
    for pair in words.chunks(2) {
        match pair {
            ["--unit", unit] => request.unit = Some(unit.parse().unwrap()),
            ["--close-holes", edges] => request.close_holes = Some(edges.parse().unwrap()),
            ["--thicken", metres] => request.thicken = Some(metres.parse().unwrap()),
            ["--simplify", metres] => request.simplify = Some(metres.parse().unwrap()),
            _ => panic!("{pair:?}"),
        }
    }
    (out, import(&request))
}

/// What is not as the case says.
fn fault(case: &Case, folder: &Path) -> Option<String> {
    let (out, outcome) = run(case, folder);
    let leftovers = std::fs::read_dir(folder)
        .unwrap()
        .filter(|entry| {
            let name = entry.as_ref().unwrap().file_name();
            name.to_string_lossy().ends_with(".partial")
        })
        .count();
    if leftovers > 0 {
        return Some("left something half-written".into());
    }
    match (&case.expected, outcome) {
        (Expected::Refused(text), Err(error)) => {
            let said = error.problems()[0].text.clone();
            let clean = said.contains(text) && !out.exists();
            (!clean).then(|| format!("refused: {said}"))
        }
        (Expected::Refused(_), Ok(report)) => Some(format!("was imported: {report}")),
        (Expected::Imported { .. }, Err(error)) => Some(format!("was refused: {error}")),
        (
            Expected::Imported {
                kinds,
                parts,
                volume,
            },
            Ok(report),
        ) => misjudged(case, (kinds, *parts, *volume), &out, &report),
    }
}

fn misjudged(
    case: &Case,
    (kinds, parts, volume): (&[&str], usize, f64),
    out: &Path,
    report: &ImportReport,
) -> Option<String> {
    let found: Vec<&str> = report.parts[0].findings.iter().map(|f| f.kind).collect();
    if found != kinds {
        return Some(format!("findings {found:?}\n{report}"));
    }
    let verdict = judge(&out.join(&report.parts[0].mesh_file));
    if !verdict.closed || verdict.volumes.len() != parts {
        return Some(format!(
            "closed {}, parts {:?}",
            verdict.closed, verdict.volumes
        ));
    }
    let total: f64 = verdict.volumes.iter().sum();
    let cavities = found.contains(&"cavities");
    let looks_out = verdict.volumes.iter().all(|v| *v > 0.0);
    if (total - volume).abs() > 1e-3 * volume || (!cavities && !looks_out) {
        return Some(format!("volumes {:?}, expected {volume}", verdict.volumes));
    }
    let part = &report.parts[0];
    let bound = part.moved_m
        + part.thickened_m.unwrap_or(0.0)
        + part.simplified_m.unwrap_or(0.0)
        + case.error;
    // Far parts were moved to the origin.
    let far = report
        .notes
        .iter()
        .any(|note| note.contains("far from the origin"));
    let truth = if far {
        centred(&case.truth)
    } else {
        case.truth.clone()
    };
    let soup = verdict.soup;
    let apart = one_sided(&soup, &truth).max(one_sided(&truth, &soup));
    (apart > bound).then(|| format!("{apart:e} m from what is meant, {bound:e} m were stated"))
}

fn centred(soup: &Soup) -> Soup {
    let corners = || soup.iter().flatten();
    let middle = [0, 1, 2].map(|k| {
        let low = corners().map(|p| p[k]).fold(f64::INFINITY, f64::min);
        let high = corners().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
        -(low + high) / 2.0
    });
    moved(soup.clone(), middle)
}

#[test]
fn every_awkward_part_is_mended_or_refused_as_the_table_says() {
    let folder = tempfile::tempdir().unwrap();
    let all = cases();
    assert!(all.len() >= 40, "{}", all.len());
    let faults: Vec<String> = all
        .iter()
        .filter_map(|case| Some(format!("{}: {}", case.file, fault(case, folder.path())?)))
        .collect();
    assert!(
        faults.is_empty(),
        "{} of {}:\n{}",
        faults.len(),
        all.len(),
        faults.join("\n")
    );
}

/// Writes every file and what the import made of it to $TAUT_AWKWARD, for scripts/judge-import.
#[test]
#[ignore = "writes files for scripts/judge-import"]
fn write_awkward_parts() {
    let folder =
        PathBuf::from(std::env::var_os("TAUT_AWKWARD").expect("TAUT_AWKWARD names a folder"));
    for case in cases() {
        let _ = run(&case, &folder);
    }
}

#[test]
fn generated_shapes_are_what_the_table_takes_them_for() {
    let mesh = taut_scene::shapes::cuboid(HALF);
    assert_eq!(soup_of(&mesh).len(), 12);
    let volume: f64 = part().iter().map(six_volumes).sum::<f64>() / 6.0;
    assert!((volume - VOLUME).abs() < 1e-15);
}
