//! One part, from what a file holds to a surface that the method can use, or every reason why not.

use nalgebra::Point3;

use super::edges::components;
use super::holes::{self, MAX_HOLE_EDGES};
use super::report::{Finding, Places};
use super::request::ImportRequest;
use super::weld::{self, WIDEST_SHARE, Welded};
use super::{faces, manifold, orientation, shell, stitch};
use crate::check::place_text;
use crate::mesh_file::RawMesh;

/// Most loose parts of one file: how they lie in each other is asked of each pair.
const MAX_LOOSE_PARTS: usize = 10_000;
/// Rounding of a file may be at most this share of the part's diagonal; more, and its form is lost.
const MOST_ROUNDING: f64 = 1e-3;

/// A closed surface, and what was done; which side of its parts is outside is not yet known.
#[derive(Debug)]
pub(super) struct Repaired {
    pub(super) mesh: RawMesh,
    pub(super) findings: Vec<Finding>,
    /// Farthest that a point of the surface was moved, m.
    pub(super) moved: f64,
    pub(super) thickened: Option<f64>,
}

/// Repairs a part in metres; the faults are sentences about the file. `single` says that the file holds single precision.
pub(super) fn repair(
    mut mesh: RawMesh,
    single: bool,
    wishes: &ImportRequest,
) -> Result<Repaired, Vec<String>> {
    let rounding = weld::rounding(&mesh, single);
    let size = weld::diagonal(&mesh);
    let readable = rounding <= MOST_ROUNDING * size; // false for NaN
    if !readable {
        return Err(vec![format!(
            "is a part of {size:.3e} m whose coordinates are good to {rounding:.3e} m only, since it lies so far from the origin or all its points are one; export it near the origin"
        )]);
    }
    let mut findings = Vec::new();
    let welded = join(&mut mesh, rounding, &mut findings)?;
    let stitched = stitch::stitch(&mut mesh, rounding.max(WIDEST_SHARE * size));
    note(
        &mut findings,
        "sides-cut",
        &Places::of(stitched.sides, stitched.place),
        |n| {
            format!(
                "cut {n} open sides at corners of other triangles that lie on them, within {:.3e} m",
                stitched.moved
            )
        },
    );
    // Holes of a sheet that is split, or has one side, cannot be told from its border.
    let sheets = wishes.thicken.is_some() && wishes.close_holes.unwrap_or(0) == 0;
    make_surfaces(&mut mesh, sheets, &mut findings)?;
    let thickened = close(&mut mesh, wishes, &mut findings)?;
    Ok(Repaired {
        mesh,
        findings,
        moved: welded.moved + stitched.moved,
        thickened,
    })
}

/// Vertices that are one, and triangles that are none.
fn join(
    mesh: &mut RawMesh,
    rounding: f64,
    findings: &mut Vec<Finding>,
) -> Result<Welded, Vec<String>> {
    let before = mesh.vertices.len();
    *mesh = std::mem::take(mesh).welded();
    note(
        findings,
        "vertices-equal",
        &Places::of(before - mesh.vertices.len(), None),
        |n| format!("shared {n} vertices that were written more than once"),
    );
    let mut without_area = faces::remove_without_area(mesh);
    let mut duplicates = faces::remove_duplicates(mesh);
    let welded = weld::weld_borders(mesh, rounding);
    note(
        findings,
        "vertices-merged",
        &Places::of(welded.merged, welded.place),
        |n| {
            format!(
                "merged {n} vertices of open edges with near ones, at most {:.3e} m away",
                welded.moved
            )
        },
    );
    if welded.merged > 0 {
        without_area.join(faces::remove_without_area(mesh));
        let more = faces::remove_duplicates(mesh);
        duplicates.copies.join(more.copies);
        duplicates.walls.join(more.walls);
        duplicates.backs.join(more.backs);
    }
    note(findings, "no-area", &without_area, |n| {
        format!("removed {n} triangles without area")
    });
    note(findings, "copies", &duplicates.copies, |n| {
        format!("removed {n} copies of triangles")
    });
    note(findings, "backs", &duplicates.backs, |n| {
        format!("removed {n} triangles that lie back to back on others")
    });
    note(findings, "inner-walls", &duplicates.walls, |n| {
        format!(
            "removed {n} pairs of triangles back to back between touching bodies, which are one body now"
        )
    });
    if mesh.triangles.is_empty() {
        return Err(vec![
            "has no triangle with an area; export it as a mesh of the part's surface".to_owned(),
        ]);
    }
    Ok(welded)
}

/// Surfaces whose edges have two triangles or one, which agree about outside. `sheets` are split where they meet, and may have one side.
fn make_surfaces(
    mesh: &mut RawMesh,
    sheets: bool,
    findings: &mut Vec<Finding>,
) -> Result<(), Vec<String>> {
    let apart = manifold::take_apart(mesh, sheets).map_err(|crowded| {
        vec![format!(
            "has {} triangles at the edge about {}, and it cannot be told which belong together; remove inner walls and loose fins there, or export bodies one by one; sheets that meet at an edge, and fins, become solids with --thicken",
            crowded.triangles,
            place_text(&crowded.place)
        )]
    })?;
    note(findings, "sheets-split", &apart.split, |n| {
        format!(
            "split sheets at {n} edges where more than two triangles meet; the solids that they become overlap there"
        )
    });
    note(
        findings,
        "taken-apart",
        &Places::of(apart.vertices, apart.place),
        |n| {
            format!(
                "gave surfaces that touch at edges or vertices {n} vertices of their own; nothing moved"
            )
        },
    );
    let loose = components(&mesh.triangles).len();
    if loose > MAX_LOOSE_PARTS {
        return Err(vec![format!(
            "falls into {loose} loose parts, but {MAX_LOOSE_PARTS} are the limit; is its unit right, and is it a surface?"
        )]);
    }
    let agreed = orientation::agree(mesh, sheets).map_err(|one_sided| {
        vec![format!(
            "has a surface with one side only, as a Moebius strip: its triangles cannot agree about outside, as at {}; if it is an open sheet, write --thicken with its thickness in metres; else mend it in the program that made it",
            place_text(&one_sided.place)
        )]
    })?;
    note(findings, "triangles-turned", &agreed.turned, |n| {
        format!("turned {n} triangles that disagreed with their neighbours about outside")
    });
    note(findings, "one-sided", &agreed.one_sided, |n| {
        format!(
            "found {n} sheets with one side only, as a Moebius strip; their solids are felt on both"
        )
    });
    Ok(())
}

/// Holes and sheets; how far thickening went, m.
fn close(
    mesh: &mut RawMesh,
    wishes: &ImportRequest,
    findings: &mut Vec<Finding>,
) -> Result<Option<f64>, Vec<String>> {
    // Small openings of a sheet are meant, as those for bolts: they stay, unless it is asked for.
    let most_edges = wishes.close_holes.or(wishes.thicken.map(|_| 0));
    let closed = holes::close(mesh, most_edges);
    note(findings, "holes-closed", &closed.holes, |n| {
        format!(
            "closed {n} holes with {} triangles, the longest {:.3e} m around",
            closed.triangles, closed.longest
        )
    });
    let open = holes::loops(mesh);
    if open.is_empty() {
        return Ok(None);
    }
    let Some(thickness) = wishes.thicken else {
        let pieces = components(&mesh.triangles).len();
        let is_rubble = 2 * pieces > mesh.triangles.len();
        return Err(vec![if is_rubble {
            let reach = WIDEST_SHARE * weld::diagonal(mesh);
            format!(
                "falls into {pieces} pieces of a triangle or two, farther apart than the {reach:.3e} m within which vertices are merged, as at {}; export it as one connected mesh",
                place_text(&open[0].place)
            )
        } else {
            open_text(&open, wishes.close_holes)
        }]);
    };
    let thickened = shell::thicken(mesh, thickness);
    note(findings, "thickened", &thickened.sheets, |n| {
        let thin = if thickened.thinnest < 0.999 * thickness {
            format!(
                "; at creases sharper than 60 degrees the wall is only {:.3e} m thick, and grows to {thickness} m away from them",
                thickened.thinnest
            )
        } else {
            String::new()
        };
        format!(
            "made {n} open sheets solids of {thickness} m; their surfaces are at most {:.3e} m from the sheets{thin}",
            thickened.farthest
        )
    });
    Ok(Some(thickened.farthest))
}

fn open_text(open: &[holes::Loop], tried: Option<usize>) -> String {
    let edges: usize = open.iter().map(|l| l.vertices.len()).sum();
    let listed: Vec<String> = open
        .iter()
        .take(3)
        .map(|hole| {
            format!(
                "{} edges, {:.3e} m around, about {}",
                hole.vertices.len(),
                hole.length,
                place_text(&hole.place)
            )
        })
        .collect();
    let more = if open.len() > listed.len() {
        format!(" and {} more", open.len() - listed.len())
    } else {
        String::new()
    };
    let largest = open.iter().map(|l| l.vertices.len()).max().unwrap_or(0);
    let advice = if tried.is_some_and(|most| largest <= most) {
        "closed there it would hold nothing or cut through itself; if it is a sheet, write --thicken with its thickness in metres".to_owned()
    } else if largest <= MAX_HOLE_EDGES {
        format!(
            "if they are holes, write --close-holes {largest}; if it is a sheet, write --thicken with its thickness in metres"
        )
    } else {
        format!(
            "holes of more than {MAX_HOLE_EDGES} edges are closed in the program that made it; if it is a sheet, write --thicken with its thickness in metres"
        )
    };
    format!(
        "is open along {edges} edges in {} loops ({}{more}); {advice}",
        open.len(),
        listed.join("; ")
    )
}

/// Notes what was found somewhere.
pub(super) fn note(
    findings: &mut Vec<Finding>,
    kind: &'static str,
    places: &Places,
    text: impl FnOnce(usize) -> String,
) {
    if places.count > 0 {
        findings.push(Finding::new(kind, places, text(places.count)));
    }
}

/// Whether every coordinate is one of single precision.
pub(super) fn is_single(vertices: &[Point3<f64>]) -> bool {
    let exact = |c: f64| f64::from(c as f32) == c;
    vertices.iter().all(|v| v.iter().all(|c| exact(*c)))
}
