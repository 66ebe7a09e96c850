//! Pieces of a file that become bodies of their own.

use taut_scene::{ImportRequest, import};

use super::joined::{TWO_LOOKS, volumes};
use super::solids::{moved, part};
use super::write::ply;
use crate::support::{Folder, assert_says, built};

/// Boxes in a row, as groups of an OBJ file: by name, with a colour each.
fn groups(names: &[&str]) -> String {
    let mut text = String::from("mtllib looks.mtl\n");
    let mut next = 1;
    for (k, name) in names.iter().enumerate() {
        let soup = moved(part(), [0.1 * k as f64, 0.0, 0.0]);
        if !name.is_empty() {
            text += &format!("g {name} row\n");
        }
        text += &format!("usemtl m{}\n", k % 2);
        for [x, y, z] in soup.iter().flatten() {
            text += &format!("v {x} {y} {z}\n");
        }
        for _ in 0..soup.len() {
            text += &format!("f {next} {} {}\n", next + 1, next + 2);
            next += 3;
        }
    }
    text
}

#[test]
fn each_piece_becomes_a_body_where_that_is_asked() {
    let folder = Folder::new();
    folder.write("looks.mtl", TWO_LOOKS);
    folder.write("row.obj", groups(&["", "pin", "nut.001", "nut.002", "pin"]));
    folder.write("plain.ply", ply(&moved(part(), [0.0, 0.1, 0.0])));
    for (only, expected) in [
        (&[][..], &["row", "pin", "nut-001", "nut-002", "plain"][..]),
        (&["row"], &["pin", "nut-001", "nut-002", "plain"]),
        (&["pin"], &["pin", "plain"]),
    ] {
        let request = ImportRequest {
            split: true,
            only: only.iter().map(|name| (*name).to_owned()).collect(),
            ..folder.words(&["row.obj", "plain.ply"], &format!("out-{}", only.concat()))
        };
        let report = import(&request).unwrap();
        let names: Vec<&str> = report.parts.iter().map(|part| part.body.as_str()).collect();
        assert_eq!(names, expected);
        let scene = built(&report.scene);
        for (k, name) in names.iter().enumerate() {
            let boxes = if *name == "pin" { 2 } else { 1 };
            let (found, _) = volumes(&report, k);
            assert_eq!(found.len(), boxes, "{name}");
            let piece = &report.parts[k].sources[0].piece;
            assert_eq!(piece.is_none(), ["row", "plain"].contains(name), "{report}");
        }
        // Each has the colour of its own material.
        let color = |name: &str| {
            let body = scene.bodies.iter().find(|body| body.name == name);
            body.map(|body| body.appearance.color)
        };
        if only.is_empty() {
            assert_eq!(color("nut-001"), Some(Some([1.0, 0.0, 0.0])));
            assert_eq!(color("nut-002"), Some(Some([0.0, 1.0, 0.0])));
        }
        assert_eq!(color("plain"), Some(None));
    }
    let request = ImportRequest {
        split: true,
        obstacles_only: false,
        ..folder.words(&["row.obj", "x=plain.ply"], "held")
    };
    let report = import(&request).unwrap();
    let names: Vec<&str> = report.parts.iter().map(|part| part.body.as_str()).collect();
    assert_eq!(names, ["god-object", "pin", "nut-001", "nut-002", "x"]);
}

#[test]
fn sides_of_one_solid_are_no_bodies_and_that_is_said() {
    let folder = Folder::new();
    let mut text = String::new();
    for [x, y, z] in part().iter().flatten() {
        text += &format!("v {x} {y} {z}\n");
    }
    for t in 0..12 {
        let [a, b, c] = [1, 2, 3].map(|k| 3 * t + k);
        text += &format!("g side{}\nf {a} {b} {c}\n", t / 2);
    }
    folder.write("box.obj", text);
    import(&folder.words(&["box.obj"], "whole")).unwrap();
    let request = ImportRequest {
        split: true,
        ..folder.words(&["box.obj"], "apart")
    };
    let error = import(&request).unwrap_err();
    assert_eq!(error.problems().len(), 6);
    let text = error.problems()[0].text.clone();
    assert!(
        text.starts_with("its piece \"side0\", by itself as --split has it, is open along 4 edges"),
        "{text}"
    );
    let missing = ImportRequest {
        split: true,
        only: vec!["lid".into()],
        ..folder.words(&["box.obj"], "missing")
    };
    let error = import(&missing).unwrap_err().to_string();
    assert_says(&error, "has no node, object or group \"lid\"");
}
