//! Points without faces as shells: closed, as far from the points as is promised, around all of them. Distances and sides are found each with each.

use std::path::Path;

use taut_scene::{FileError, ImportReport, ImportRequest, import};

use super::judge::{Verdict, judge, winding};
use super::solids::{Noise, Point, Triangle};
use super::write::ply_points;
use crate::support::{Folder, assert_says};

pub(super) fn import_as(
    name: &str,
    bytes: &[u8],
    thicken: Option<f64>,
    unit: Option<&str>,
) -> Result<(ImportReport, Verdict), FileError> {
    let folder = Folder::new();
    folder.write(name, bytes);
    let report = import(&ImportRequest {
        unit: unit.map(|unit| unit.parse().unwrap()),
        thicken,
        ..folder.request(&[name])
    })?;
    let verdict = judge(&Path::new(&report.folder).join(&report.parts[0].mesh_file));
    Ok((report, verdict))
}

fn nearest(cloud: &[Point], [x, y, z]: Point) -> f64 {
    let mut least = f64::INFINITY;
    for p in cloud {
        let (x, y, z) = (p[0] - x, p[1] - y, p[2] - z);
        least = least.min(x * x + y * y + z * z);
    }
    least.sqrt()
}

/// A place of the triangle, by two numbers in [0, 1].
fn within([a, b, c]: &Triangle, u: f64, v: f64) -> Point {
    let (u, v) = if u + v > 1.0 {
        (1.0 - u, 1.0 - v)
    } else {
        (u, v)
    };
    [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]))
}

/// What is promised of a shell of this thickness around a cloud; `way` is by how much it was moved to the origin, `rounding` how well that is known.
pub(super) fn judge_shell(
    cloud: &[Point],
    thickness: f64,
    verdict: &Verdict,
    (way, rounding): (Point, f64),
    what: &str,
) {
    assert!(verdict.closed, "{what}");
    let moved: Vec<Point> = cloud
        .iter()
        .map(|p| [0, 1, 2].map(|k| p[k] + way[k]))
        .collect();
    let (least, most) = (0.35 * thickness, 0.65 * thickness);
    let mut noise = Noise::new();
    let mut unit = || 0.5 + 0.5 * noise.next();
    let step = (verdict.soup.len() / 700).max(1);
    for triangle in verdict.soup.iter().step_by(step) {
        let others = [
            within(triangle, unit(), unit()),
            within(triangle, unit(), unit()),
        ];
        for place in triangle.iter().copied().chain(others) {
            let d = nearest(&moved, place);
            let bounded = (least - rounding..=most + rounding).contains(&d);
            assert!(bounded, "{what}: {d} m, not {least} to {most}");
        }
    }
    // All that is nearer than that is inside, all that is farther outside.
    let step = (moved.len() / 15).max(1);
    let mut sides = [0; 2];
    for point in moved.iter().step_by(step) {
        assert!(
            (winding(&verdict.soup, *point) - 1.0).abs() < 1e-6,
            "{what}"
        );
        for _ in 0..6 {
            let place = point.map(|c| c + 1.2 * thickness * (2.0 * unit() - 1.0));
            let d = nearest(&moved, place);
            let expected = match d {
                d if d < least - rounding => 1.0,
                d if d > most + rounding => 0.0,
                _ => continue,
            };
            sides[expected as usize] += 1;
            let found = winding(&verdict.soup, place);
            assert!((found - expected).abs() < 1e-6, "{what}: {found} at {d} m");
        }
    }
    assert!(sides[0] > 0 || moved.len() > 300, "{what}: {sides:?}");
}

/// Numbers in [-1, 1] for each of `count` points.
pub(super) fn random(count: usize, mut place: impl FnMut([f64; 3]) -> Point) -> Vec<Point> {
    let mut noise = Noise::new();
    (0..count)
        .map(|_| place([noise.next(), noise.next(), noise.next()]))
        .collect()
}

pub(super) fn on_ball(p: [f64; 3], radius: f64) -> Point {
    let length = p.iter().map(|c| c * c).sum::<f64>().sqrt().max(1e-9);
    p.map(|c| radius * c / length)
}

/// What it is, its points, a thickness, and how many closed parts the shell has, where that is known.
type Cloud = (&'static str, Vec<Point>, f64, Option<usize>);

fn points_and_lines() -> Vec<Cloud> {
    let line = |way: Point| -> Vec<Point> {
        (0..40)
            .map(|k| way.map(|c| c * f64::from(k) * 1e-3))
            .collect()
    };
    vec![
        ("one point", vec![[0.01, -0.02, 0.03]], 5e-3, Some(1)),
        (
            "two points far apart",
            vec![[0.0; 3], [0.05, 0.0, 0.0]],
            5e-3,
            Some(2),
        ),
        ("a line along an axis", line([1.0, 0.0, 0.0]), 4e-3, Some(1)),
        ("a line across", line([0.3, -0.7, 0.55]), 4e-3, Some(1)),
        (
            "one point a hundred times",
            vec![[0.02; 3]; 100],
            5e-3,
            Some(1),
        ),
    ]
}

fn planes() -> Vec<Cloud> {
    let grid = |z: f64| -> Vec<Point> {
        let cells = (0..12).flat_map(|i| (0..9).map(move |j| [i, j]));
        cells
            .map(|[i, j]| [f64::from(i) * 1e-3, f64::from(j) * 1e-3, z])
            .collect()
    };
    vec![
        ("a plane", grid(0.0), 3e-3, Some(1)),
        (
            "a plane twice",
            [grid(0.0), grid(0.0)].concat(),
            3e-3,
            Some(1),
        ),
        (
            "two sheets farther apart than the shell is thick",
            [grid(0.0), grid(5e-3)].concat(),
            3e-3,
            Some(2),
        ),
        (
            "two sheets nearer than that",
            [grid(0.0), grid(2e-3)].concat(),
            3e-3,
            Some(1),
        ),
        (
            "two sheets that just touch",
            [grid(0.0), grid(3e-3)].concat(),
            3e-3,
            None,
        ),
        (
            "points farther apart than it is thick",
            grid(0.0),
            0.8e-3,
            Some(108),
        ),
        ("points whose balls touch", grid(0.0), 1e-3, None),
    ]
}

fn scattered() -> Vec<Cloud> {
    vec![
        (
            "a ball's surface",
            random(2000, |p| on_ball(p, 0.02)),
            8e-3,
            Some(2),
        ),
        ("noise", random(300, |p| p.map(|c| 0.01 * c)), 3e-3, None),
        (
            "noise on a plane",
            random(600, |[x, y, z]| [0.01 * x, 0.01 * y, 5e-4 * z]),
            3e-3,
            None,
        ),
        (
            "coordinates on the sites",
            random(200, |p| p.map(|c| (c * 8.0).round() * 1e-3)),
            4e-3,
            None,
        ),
        (
            "far from the origin",
            random(400, |p| on_ball(p, 0.01).map(|c| c + 3e4)),
            3e-3,
            None,
        ),
    ]
}

#[test]
fn a_shell_is_closed_and_as_far_from_the_points_as_is_said() {
    let clouds = [points_and_lines(), planes(), scattered()];
    for (what, cloud, thickness, parts) in clouds.into_iter().flatten() {
        let (report, verdict) =
            import_as("a.ply", &ply_points(&cloud), Some(thickness), Some("m")).unwrap();
        let first = report.parts[0].all_findings().next().unwrap();
        assert_eq!(first.kind, "shelled", "{what}");
        let far = moved_by(&report);
        let rounding = if far.is_some() {
            1e-5
        } else {
            1e-9 * thickness
        };
        let way = far.unwrap_or_default();
        judge_shell(&cloud, thickness, &verdict, (way, rounding), what);
        if let Some(parts) = parts {
            assert_eq!(verdict.volumes.len(), parts, "{what}");
            assert_eq!(first.count, parts, "{what}");
        }
        // A shell of a closed surface has a hollow.
        let hollow = verdict.volumes.iter().filter(|v| **v < 0.0).count();
        assert_eq!(
            hollow > 0,
            report.to_string().contains("walls of cavities"),
            "{what}"
        );
        assert_eq!(
            what == "a ball's surface",
            parts == Some(2) && hollow == 1,
            "{what}"
        );
        let farthest = report.parts[0].sources[0].thickened_m.unwrap();
        assert!((farthest / thickness - 0.65).abs() < 1e-12);
    }
}

/// What all parts were moved by, m, as the report tells: to half of 1e-5 m along each axis. Nothing where they were not moved.
fn moved_by(report: &ImportReport) -> Option<Point> {
    let mut notes = report.notes.iter();
    let note = notes.find(|note| note.contains("far from the origin"))?;
    let (_, place) = note.split_once("by the same (")?;
    let (place, _) = place.split_once(')')?;
    let mut numbers = place.split(", ").map(|word| word.parse().unwrap());
    Some([0; 3].map(|_| numbers.next().unwrap()))
}

#[test]
fn gaps_between_points_that_go_through_are_counted() {
    // A ring of points has one, a plane with 2 x 3 openings six.
    let ring = |k: i32| {
        let angle = f64::from(k) * std::f64::consts::TAU / 126.0;
        [0.02 * angle.cos(), 0.02 * angle.sin(), 0.0]
    };
    let ring: Vec<Point> = (0..126).map(ring).collect();
    let cells = (0..22).flat_map(|i| (0..31).map(move |j| [i, j]));
    let holed = cells.filter(|[i, j]| {
        !([5, 15].contains(&(i / 2 * 2 - 1)) && [5, 15, 25].contains(&(j / 2 * 2 - 1)))
    });
    let holed: Vec<Point> = holed
        .map(|[i, j]| [f64::from(i) * 1e-3, f64::from(j) * 1e-3, 0.0])
        .collect();
    assert_eq!(holed.len(), 22 * 31 - 6 * 4);
    for (cloud, gaps) in [(&ring, 1), (&holed, 6)] {
        let (report, _) = import_as("a.ply", &ply_points(cloud), Some(1.6e-3), Some("m")).unwrap();
        let told = report.to_string();
        assert_says(
            &told,
            &format!("; {gaps} gaps between points go through it"),
        );
    }
    // Thicker, they are closed.
    let (report, _) = import_as("a.ply", &ply_points(&holed), Some(4e-3), Some("m")).unwrap();
    assert!(
        !report.to_string().contains("gaps between points"),
        "{report}"
    );
}
