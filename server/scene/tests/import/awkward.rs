//! What `taut import` does with the awkward files, and whether that is so.

use std::path::{Path, PathBuf};

use taut_scene::{FileError, ImportReport, ImportRequest, LengthUnit, import};

use super::cases::{Case, Expected, cases};
use super::judge::{judge, one_sided};
use super::solids::{HALF, Soup, VOLUME, moved, part, six_volumes, soup_of};

/// Imports one case into `folder`, where its file is.
pub(crate) fn run(case: &Case, folder: &Path) -> (PathBuf, Result<ImportReport, FileError>) {
    let file = folder.join(case.file);
    std::fs::write(&file, &case.bytes).unwrap();
    let out = folder.join(format!("{}.out", case.file));
    let mut request = ImportRequest {
        parts: vec![file.into()],
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
    let found: Vec<&str> = report.parts[0].all_findings().map(|f| f.kind).collect();
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
    // The shell of a cloud is as far from it as is said, and no more exact.
    let is_cloud = found.contains(&"shelled");
    let off = if is_cloud { 0.05 } else { 1e-3 };
    if (total - volume).abs() > off * volume || (!cavities && !looks_out) {
        return Some(format!("volumes {:?}, expected {volume}", verdict.volumes));
    }
    let part = &report.parts[0];
    let bound = part.moved_m()
        + part.sources[0].thickened_m.unwrap_or(0.0)
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
    if apart > bound {
        return Some(format!(
            "{apart:e} m from what is meant, {bound:e} m were stated"
        ));
    }
    if is_cloud {
        return None; // it holds no triangles to compare
    }
    // What the file itself holds is no farther away than was said, unless it was taken out or all was moved.
    let unit: LengthUnit = part.sources[0].unit.parse().unwrap();
    let file = soup_of(
        &taut_scene::read_mesh(Path::new(&part.sources[0].file))
            .unwrap()
            .scaled(unit.metres),
    );
    let lost = one_sided(&file, &soup);
    let stated = bound - case.error + 1e-15;
    let comparable = !far && !found.contains(&"inner-walls");
    (comparable && lost > stated)
        .then(|| format!("{lost:e} m from the file, {stated:e} m were stated"))
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
