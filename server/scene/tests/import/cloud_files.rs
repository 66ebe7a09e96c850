//! Files that hold points: their formats, their faults, and what they are joined with.

use std::fmt::Write as _;
use std::path::Path;

use taut_scene::{ImportRequest, import};

use super::clouds::{import_as, judge_shell, on_ball, random};
use super::judge::judge;
use super::solids::{Point, moved, part, sheet};
use super::write::{obj_soup, ply, ply_points};
use crate::support::{Folder, assert_says};

#[test]
fn points_of_every_format_and_unit_give_the_same_shell() {
    let cloud = random(60, |p| p.map(|c| (100.0 * c).round() / 8.0));
    let mut lines = String::new();
    for [x, y, z] in &cloud {
        writeln!(lines, "{x} {y} {z} 0 0 1").unwrap();
    }
    let commas = format!("x;y;z;nx;ny;nz\n{}", lines.replace(' ', ";"));
    let pcd = format!(
        "VERSION 0.7\nFIELDS x y z nx ny nz\nSIZE 4 4 4 4 4 4\nTYPE F F F F F F\nCOUNT 1 1 1 1 1 1\nWIDTH 61\nHEIGHT 1\nPOINTS 61\nDATA ascii\n{lines}nan nan nan nan nan nan\n"
    );
    let obj: String = cloud
        .iter()
        .map(|[x, y, z]| format!("v {x} {y} {z}\n"))
        .collect();
    let ply = ply_points(&cloud);
    let (_, meant) = import_as("a.ply", &ply, Some(6e-3), Some("mm")).unwrap();
    for (name, bytes) in [
        ("a.xyz", lines.as_bytes()),
        ("a.TXT", lines.as_bytes()),
        ("a.csv", commas.as_bytes()),
        ("a.pcd", pcd.as_bytes()),
        ("a.obj", obj.as_bytes()),
    ] {
        let (report, verdict) = import_as(name, bytes, Some(6e-3), Some("mm")).unwrap();
        assert!(verdict.soup == meant.soup, "{name}");
        assert_eq!(
            report.to_string().contains("left out 1 points"),
            name == "a.pcd"
        );
    }
    let metres: Vec<Point> = cloud.iter().map(|p| p.map(|c| c * 1e-3)).collect();
    judge_shell(&metres, 6e-3, &meant, ([0.0; 3], 1e-11), "millimetres");
}

#[test]
fn what_is_no_cloud_or_cannot_be_a_shell_is_refused_with_what_to_do() {
    let two = ply_points(&[[0.0; 3], [1.0, 0.0, 0.0]]);
    for (name, bytes, thicken, said) in [
        (
            "a.ply",
            two.clone(),
            None,
            "has no faces, only 2 points: `taut import --thicken` makes a shell",
        ),
        (
            "a.xyz",
            b"0 0 0\n1 1 1\n".to_vec(),
            None,
            "only 2 points: `taut import --thicken`",
        ),
        ("a.xyz", b"# nothing\n".to_vec(), Some(1e-3), "has no faces"),
        (
            "a.xyz",
            b"0 0 0\n0 inf 0\n".to_vec(),
            Some(1e-3),
            "a.xyz:2: vertex 1 has y = inf",
        ),
        (
            "a.xyz",
            b"0 0 0\n1e300 0 0\n".to_vec(),
            Some(1e-3),
            "nothing for a hand",
        ),
        (
            "a.ply",
            ply_points(&[[0.0; 3], [f64::NAN, 0.0, 0.0]]),
            Some(1e-3),
            "vertex 1 has x = NaN",
        ),
        (
            "a.las",
            b"LASF".to_vec(),
            Some(1e-3),
            "is no known mesh format",
        ),
    ] {
        let error = import_as(name, &bytes, thicken, None)
            .unwrap_err()
            .to_string();
        assert!(error.contains(said), "{name}: {error}");
    }
    // 30 km away in single precision digits are 2 mm apart.
    let far = random(50, |p| p.map(|c| f64::from((0.02 * c + 3e4) as f32)));
    let error = import_as("a.ply", &ply_points(&far), Some(2e-3), Some("m"))
        .unwrap_err()
        .to_string();
    assert_says(&error, "move them near to the origin in double precision");
}

/// A file of a sheet, one of a scan, one of a solid: one body.
#[test]
fn a_scan_is_joined_with_meshes_in_one_body() {
    let folder = Folder::new();
    let scan = random(1500, |p| on_ball(p, 0.01).map(|c| c + 0.1));
    let files: [(&str, Vec<u8>); 3] = [
        (
            "a.xyz",
            scan.iter()
                .map(|[x, y, z]| format!("{x} {y} {z}\n"))
                .collect::<String>()
                .into(),
        ),
        ("b.obj", obj_soup(&part())),
        (
            "c.ply",
            ply(&moved(sheet([0.06, 0.04], [3, 2]), [0.1, 0.0, 0.0])),
        ),
    ];
    let parts = files.map(|(name, bytes)| taut_scene::ImportPart {
        body: Some("all".into()),
        ..folder.write(name, bytes).into()
    });
    let report = import(&ImportRequest {
        parts: parts.into(),
        thicken: Some(5e-3),
        ..folder.request(&[])
    });
    let report = report.unwrap();
    let verdict = judge(&Path::new(&report.folder).join(&report.parts[0].mesh_file));
    assert!(verdict.closed);
    assert_eq!(verdict.volumes.len(), 4, "{report}");
}

#[test]
fn a_million_points_are_taken() {
    let cloud = random(1_000_000, |p| on_ball(p, 0.05));
    let (report, verdict) = import_as("a.ply", &ply_points(&cloud), Some(0.02), Some("m")).unwrap();
    assert!(verdict.closed && verdict.volumes.len() == 2, "{report}");
    // Balls of the radii 0.06 and 0.04, and what the lattice adds.
    let volume: f64 = verdict.volumes.iter().sum();
    let meant = 4.0 / 3.0 * std::f64::consts::PI * (0.06_f64.powi(3) - 0.04_f64.powi(3));
    assert!((volume / meant - 1.0).abs() < 0.02, "{}", volume / meant);
}
