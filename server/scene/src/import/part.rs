//! One part of an import: read, repaired, simplified, judged.

use std::path::Path;

use god_object::Mesh;

use super::placing::upright;
use super::repair::{Repaired, Wishes, is_single, repair};
use super::report::{Finding, PartReport, Places};
use super::visual::Visual;
use super::{ImportRequest, unit};
use crate::appearance::Appearance;
use crate::check::{Meeting, MeshFigures};
use crate::mesh_file::{MeshPart, Pieces, RawMesh, read_part};
use crate::problem::{FileError, Problem};
use crate::progress::Progress;
use crate::simplify::simplify;

/// Longest name of a body made of its file's, bytes: with a number and an ending it is a name of a file everywhere.
const MAX_NAME_BYTES: usize = 128;

/// What became of a part.
pub(super) struct Part {
    pub(super) report: PartReport,
    pub(super) mesh: RawMesh,
    /// What is drawn instead, where its triangles do not all look alike.
    pub(super) visual: Option<Visual>,
    /// Of its file.
    pub(super) pieces: Pieces,
}

/// A name for the body and its file, from the name of the part's: unique, of letters and digits of any language, `_` and `-`.
pub(super) fn new_name(path: &Path, taken: &mut Vec<String>) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut plain = String::new();
    for c in stem.chars() {
        // Accents that some systems write behind their letter.
        let is_mark = ('\u{300}'..='\u{36f}').contains(&c);
        let kept = if c.is_alphanumeric() || c == '_' || is_mark {
            c
        } else {
            '-'
        };
        if plain.len() + kept.len_utf8() > MAX_NAME_BYTES {
            break;
        }
        if kept != '-' || !plain.ends_with('-') {
            plain.push(kept);
        }
    }
    let plain = match plain.trim_matches('-') {
        "" => "part".to_owned(),
        name => name.to_owned(),
    };
    let mut name = plain.clone();
    let mut number = 2;
    // Names that differ in case only are one file on some systems.
    let is_same = |a: &str, b: &str| a.to_lowercase() == b.to_lowercase();
    while taken.iter().any(|other| is_same(other, &name)) {
        name = format!("{plain}-{number}");
        number += 1;
    }
    taken.push(name.clone());
    name
}

/// One part, read, repaired and simplified.
pub(super) fn part(
    path: &Path,
    body: &str,
    mesh_file: &str,
    request: &ImportRequest,
) -> Result<Part, FileError> {
    let MeshPart { mesh, look, pieces } = read(path, &request.only)?;
    let as_read = (!look.parts.is_empty()).then(|| mesh.clone());
    // A vertex of no triangle is no part of the surface, however far away it is.
    let raw = mesh.without_unused();
    let fail = |text: String| FileError::from(Problem::of_file(path.display(), text));
    let (unit, unit_assumed) = unit::unit_of(path, &raw, request.unit).map_err(fail)?;
    let single = is_single(&raw.vertices);
    let (file, count) = (path.display(), raw.triangles.len());
    let progress = Progress::on_triangles(count, format_args!("{file}: mending {count} triangles"));
    let wishes = Wishes {
        close_holes: request.close_holes,
        thicken: request.thicken,
    };
    let Repaired {
        mesh,
        mut findings,
        moved,
        thickened,
    } = repair(raw.scaled(unit.metres), single, wishes).map_err(|faults| {
        let of_file = |text| Problem::of_file(path.display(), text);
        FileError::of_all(faults.into_iter().map(of_file).collect())
    })?;
    drop(progress);
    // A face that was turned, or that has a back now, would be seen from its wrong side in the surface of the file.
    let turned = |finding: &Finding| ["triangles-turned", "parts-turned"].contains(&finding.kind);
    let faces_as_before = thickened.is_none() && !findings.iter().any(turned);
    let as_read = as_read.filter(|_| faces_as_before);
    let one_look = RawMesh::default();
    let lost = look.not_drawn(
        &Appearance::default(),
        as_read.as_ref().unwrap_or(&one_look),
    );
    let visual = as_read.and_then(|mesh| {
        Visual::of(mesh, &look, mesh_file, |mesh| {
            upright(mesh.scaled(unit.metres), request.up)
        })
    });
    let (mesh, simplified) = match request.simplify {
        Some(max_error) => {
            let (mesh, outcome) = simplify(mesh, max_error, body);
            (mesh, Some(outcome))
        }
        None => (mesh, None),
    };
    let meeting = felt_meeting(&mesh, path, thickened.is_some()).map_err(fail)?;
    let raw = upright(RawMesh::from(&mesh), request.up);
    findings.splice(0..0, told_of_file(&pieces, &request.only));
    let mut report = PartReport {
        file: path.display().to_string(),
        body: body.to_owned(),
        mesh_file: mesh_file.to_owned(),
        unit: unit.name,
        unit_assumed,
        findings,
        moved_m: moved,
        thickened_m: thickened,
        simplified_m: None,
        appearance: look.appearance,
        mesh: MeshFigures::of(&raw),
    };
    if let Some(outcome) = &simplified {
        report.simplified(outcome);
    }
    report.findings.extend(told_at_last(meeting, lost));
    Ok(Part {
        report,
        mesh: raw,
        visual,
        pieces,
    })
}

/// Where the surface meets itself, if what overlaps is outward; else why it is refused.
fn felt_meeting(mesh: &Mesh, path: &Path, is_thickened: bool) -> Result<Option<Meeting>, String> {
    match Meeting::of(mesh, &path.display().to_string()) {
        Some(meeting) if meeting.inverted_m.is_some() => {
            let thinner = if is_thickened {
                "; a smaller --thicken may do, too"
            } else {
                ""
            };
            Err(format!("{}{thinner}", meeting.text()))
        }
        meeting => Ok(meeting),
    }
}

/// A file that names no pieces is taken whole, whichever were chosen.
fn read(path: &Path, only: &[String]) -> Result<MeshPart, FileError> {
    if only.is_empty() {
        return read_part(path, only);
    }
    let whole = read_part(path, &[])?;
    if whole.pieces.names().is_empty() {
        return Ok(whole);
    }
    read_part(path, only)
}

/// Which pieces of the file are the body, and what of the file is none.
fn told_of_file(pieces: &Pieces, only: &[String]) -> Vec<Finding> {
    let mut told = Vec::new();
    let mut add = |kind, count, text: String| {
        told.push(Finding::new(kind, &Places::of(count, None), text));
    };
    let count = pieces.names().len();
    if count > 1 {
        let text = if only.is_empty() {
            format!(
                "joined its {count} pieces in one body: {}; --only takes some",
                pieces.listed()
            )
        } else {
            let names: Vec<String> = only
                .iter()
                .filter(|name| pieces.has(name))
                .map(|name| format!("\"{name}\""))
                .collect();
            format!(
                "took only {} of its {count} pieces: {}",
                names.join(", "),
                pieces.listed()
            )
        };
        add("pieces", count, text);
    }
    for left_out in pieces.left_out() {
        add("left-out", 1, left_out.clone());
    }
    told
}

/// What is not mended, and what is not drawn.
fn told_at_last(meeting: Option<Meeting>, lost: Option<String>) -> Vec<Finding> {
    let mut told = Vec::new();
    if let Some(meeting) = meeting {
        told.push(Finding::new(
            "meets-itself",
            &Places::of(1, Some(meeting.place_m.into())),
            "NOT MENDED: the surface touches or runs through itself; its mass counts what overlaps twice, and the force inside is not defined",
        ));
    }
    if let Some(lost) = lost {
        let text = format!("of its look is not drawn: {lost}");
        let finding = Finding::new("look-lost", &Places::default(), text);
        told.push(finding);
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_keep_the_letters_of_every_language() {
        let mut taken = Vec::new();
        for (file, name) in [
            (
                "B\u{fc}chse Gr\u{f6}\u{df}e 2.STL",
                "B\u{fc}chse-Gr\u{f6}\u{df}e-2",
            ),
            (
                "b\u{dc}CHSE gr\u{f6}\u{df}e 2.ply",
                "b\u{dc}CHSE-gr\u{f6}\u{df}e-2-2",
            ),
            ("Bu\u{308}chse.stl", "Bu\u{308}chse"),
            ("\u{90e8}\u{54c1} (1).obj", "\u{90e8}\u{54c1}-1"),
            ("a=b\"c.ply", "a-b-c"),
            ("??.ply", "part"),
        ] {
            assert_eq!(new_name(Path::new(file), &mut taken), name);
        }
        let long = new_name(Path::new(&"\u{90e8}".repeat(300)), &mut taken);
        assert!(long.len() <= MAX_NAME_BYTES && !long.is_empty());
    }
}
