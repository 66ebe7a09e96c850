//! Sheets that meet at edges, have one side, or stand on solids, made thick.

use std::f64::consts::TAU;

use taut_scene::{FileError, ImportReport, ImportRequest, import};

use super::joined::kinds;
use super::judge::{Verdict, judge, one_sided, winding};
use super::solids::{HALF, Point, Soup, cross, dot, joined, mapped, minus, moved, part, sheet};
use super::write::{ply, stl};
use crate::support::{Folder, assert_says};

const THICK: f64 = 1e-3;

fn thickened(soup: &Soup, close: Option<usize>) -> Result<(ImportReport, Verdict), FileError> {
    let folder = Folder::new();
    folder.write("a.ply", ply(soup));
    let report = import(&ImportRequest {
        thicken: Some(THICK),
        close_holes: close,
        ..folder.request(&["a.ply"])
    })?;
    let verdict = judge(&folder.path("out/a.ply"));
    assert!(verdict.closed, "{report}");
    assert!(
        verdict.volumes.iter().all(|volume| *volume > 0.0),
        "{report}"
    );
    Ok((report, verdict))
}

/// Plates of 20 mm by 30 mm that all end at the z axis, in these directions.
fn plates(directions: &[f64]) -> Soup {
    let plate = |angle: &f64| {
        let (sin, cos) = angle.sin_cos();
        mapped(sheet([0.02, 0.03], [4, 5]), move |[x, y, _]| {
            [x * cos, x * sin, y]
        })
    };
    directions.iter().flat_map(plate).collect()
}

/// Every place of the sheet is in the solid or on it, and no place of the solid farther away than is said.
fn judge_solid(sheet: &Soup, (report, verdict): &(ImportReport, Verdict), what: &str) {
    let said = report.parts[0].sources[0].thickened_m.unwrap();
    let apart = one_sided(&verdict.soup, sheet);
    assert!(apart <= said + 1e-9, "{what}: {apart} of {said}");
    for [a, b, c] in sheet {
        let middle: Point = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
        assert!(winding(&verdict.soup, middle) > 0.999, "{what}");
    }
}

#[test]
fn plates_that_meet_at_an_edge_are_split_there_and_each_is_thick() {
    // Directions in degrees, and how many solids: those go on in one another that are the straightest.
    for (degrees, solids) in [
        (&[0.0, 180.0, 90.0][..], 2),
        (&[0.0, 120.0, 240.0], 2),
        (&[0.0, 90.0, 180.0, 270.0], 2),
        (&[0.0, 30.0, 60.0], 3),
        (&[10.0, 80.0, 190.0, 205.0, 300.0], 3),
        (&[0.0, 72.0, 144.0, 216.0, 288.0], 3),
    ] {
        let directions: Vec<f64> = degrees.iter().map(|d| d / 360.0 * TAU).collect();
        let soup = plates(&directions);
        let what = format!("{degrees:?}");
        let made = thickened(&soup, None).unwrap();
        assert_eq!(made.1.volumes.len(), solids, "{what}: {}", made.0);
        let kinds = kinds(&made.0, 0);
        assert_eq!(kinds[0], "sheets-split", "{what}: {kinds:?}");
        assert!(kinds.contains(&"meets-itself"), "{what}: {kinds:?}");
        judge_solid(&soup, &made, &what);
        // Unasked it is refused with its place and what to write.
        let folder = Folder::new();
        folder.write("a.stl", stl(&soup));
        let error = import(&folder.request(&["a.stl"])).unwrap_err();
        let count = degrees.len();
        if count % 2 == 1 {
            assert_says(
                &error,
                &format!("has {count} triangles at the edge about ("),
            );
            assert_says(&error, "become solids with --thicken");
        }
    }
}

/// A strip around a ring, with half turns.
fn strip(half_turns: u32, cells: u32) -> Soup {
    let at = |k: u32, across: f64| -> Point {
        let around = f64::from(k % cells) / f64::from(cells) * TAU;
        // Where it closes the strip meets itself across.
        let is_back = k == cells && half_turns % 2 == 1;
        let across = if is_back { -across } else { across };
        let (sin, cos) = (around * f64::from(half_turns) / 2.0).sin_cos();
        let radius = 0.03 + across * cos;
        [radius * around.cos(), radius * around.sin(), across * sin]
    };
    let mut soup = Soup::new();
    for k in 0..cells {
        for [from, to] in [[-0.006, 0.0], [0.0, 0.006]] {
            let (a, b) = (at(k, from), at(k, to));
            let (c, d) = (at(k + 1, to), at(k + 1, from));
            soup.extend([[a, b, c], [a, c, d]]);
        }
    }
    soup
}

#[test]
fn a_strip_with_one_side_becomes_a_solid_as_one_with_two() {
    for half_turns in 0..4 {
        for cells in [24, 61] {
            let soup = strip(half_turns, cells);
            let what = format!("{half_turns} half turns, {cells} cells");
            let made = thickened(&soup, None).unwrap();
            assert_eq!(made.1.volumes.len(), 1, "{what}");
            let is_one_sided = kinds(&made.0, 0).contains(&"one-sided");
            assert_eq!(is_one_sided, half_turns % 2 == 1, "{what}: {}", made.0);
            judge_solid(&soup, &made, &what);
            let area: f64 = soup.iter().map(area).sum();
            let share = made.1.volumes[0] / (area * THICK);
            // Few cells with many turns are bent at their edges, and thicker there.
            assert!((share - 1.0).abs() < 0.05, "{what}: {share}");
        }
    }
    // Holes of a sheet with one side cannot be told from its border.
    let error = thickened(&strip(1, 24), Some(16)).unwrap_err().to_string();
    assert_says(&error, "Moebius strip");
}

fn area([a, b, c]: &[Point; 3]) -> f64 {
    let twice = cross(minus(*b, *a), minus(*c, *a));
    0.5 * dot(twice, twice).sqrt()
}

/// A box with a fin along one of its edges, a sheet far from it, both; and a wall across its inside.
#[test]
fn solids_stay_as_they_are_beside_sheets_and_fins() {
    let [x, y, z] = HALF;
    let fin: Soup = vec![
        [[x, -y, z], [x, y, z], [x, y, z + 0.02]],
        [[x, -y, z], [x, y, z + 0.02], [x, -y, z + 0.02]],
    ];
    let aside = moved(sheet([0.03, 0.02], [3, 2]), [0.1, 0.0, 0.0]);
    let volume = 8.0 * x * y * z;
    for (soup, solids, split) in [
        (joined([part(), fin.clone()]), 2, true),
        (joined([part(), aside.clone()]), 2, false),
        (joined([fin.clone(), aside, part()]), 3, true),
    ] {
        let made = thickened(&soup, None).unwrap();
        assert_eq!(made.1.volumes.len(), solids, "{}", made.0);
        assert!(
            (made.1.volumes[0] / volume - 1.0).abs() < 1e-9,
            "{:?}",
            made.1.volumes
        );
        assert_eq!(
            kinds(&made.0, 0).contains(&"sheets-split"),
            split,
            "{}",
            made.0
        );
        let said = made.0.parts[0].sources[0].thickened_m.unwrap();
        assert!(one_sided(&made.1.soup, &soup) <= said + 1e-9);
    }
    // Which side of an inner wall is meant to be solid nobody knows.
    let wall: Soup = vec![
        [[-x, -y, -z], [-x, -y, z], [x, y, z]],
        [[-x, -y, -z], [x, y, z], [x, y, -z]],
    ];
    let error = thickened(&joined([part(), wall]), None)
        .unwrap_err()
        .to_string();
    assert_says(&error, "it cannot be told which belong together");
}
