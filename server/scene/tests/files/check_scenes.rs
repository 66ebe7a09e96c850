//! `check` says everything of a scene at once, in units that can be read.

use std::path::Path;

use taut_scene::shapes::cuboid;
use taut_scene::{check, check_in, looping_fault, write_ply};

use crate::support::{Folder, assert_says, built};

/// A scene whose held body has this shape.
fn held(shape: &str, more: &str) -> String {
    format!("name = \"a\"\n[god_object]\nmass = 1.0\nshape = {{ {shape} }}\n{more}")
}

/// Boxes as named groups, one beside the other; the last one is open.
const GROUPS: [&str; 3] = ["peg", "my block", "open"];

fn obj(key: &str) -> String {
    let mut text = String::new();
    for (place, name) in GROUPS.iter().enumerate() {
        let mesh = cuboid([0.01; 3]);
        text += &format!("{key} {name}\n");
        for v in &mesh.vertices {
            text += &format!("v {} {} {}\n", v.x + 0.1 * place as f64, v.y, v.z);
        }
        let kept = mesh.triangles.len() - usize::from(*name == "open");
        for t in &mesh.triangles[..kept] {
            let [a, b, c] = t.map(|v| 8 * place as u32 + v + 1);
            text += &format!("f {a} {b} {c}\n");
        }
    }
    text
}

#[test]
fn a_mesh_is_checked_in_its_unit() {
    let folder = Folder::new();
    let part = folder.write("part.ply", write_ply(&cuboid([30.0, 20.0, 10.0])));
    let metres = check(&[&part]).remove(0);
    let notes = metres.notes.join("\n");
    assert!(
        notes.contains("names no unit: taken as m") && notes.contains("--unit mm"),
        "{metres}"
    );
    let millimetres = check_in(&[&part], Some("mm".parse().unwrap())).remove(0);
    assert!(millimetres.notes.is_empty(), "{millimetres}");
    assert_eq!(millimetres.mesh.unwrap().size_m, [0.06, 0.04, 0.02]);
    let held_by_hand = folder.check("small.ply", write_ply(&cuboid([0.03; 3])));
    let told = &held_by_hand.notes[..];
    assert!(
        told.len() == 1 && told[0].contains("taken as m, which makes its longest side 60.00 mm"),
        "{told:?}"
    );
}

#[test]
fn a_scene_that_names_a_unit_is_not_told_to_name_it() {
    let folder = Folder::new();
    folder.write("part.ply", write_ply(&cuboid([30.0, 20.0, 10.0])));
    for (more, size) in [
        ("unit = \"mm\", scale = 1000.0", "60.00 m"),
        ("scale = 0.1", "6.000 m"),
    ] {
        let report = folder.check("s.toml", held(&format!("mesh = \"part.ply\", {more}"), ""));
        let notes = report.notes.join("\n");
        assert!(
            notes.contains(size) && !notes.contains("write unit") && notes.contains("check both"),
            "{report}"
        );
    }
    let tiny = folder.check("t.toml", held("mesh = \"part.ply\", scale = 1e-6", ""));
    assert!(tiny.summary.contains("god-object 60.00 um"), "{tiny}");
}

#[test]
fn the_files_of_a_faulty_scene_are_all_looked_at() {
    let more = "speed = 1\nsurface = { texture = { height_map = { file = \"no.png\", tile = 0.1, amplitude = 1e-4 } } }\n";
    let text = held("mesh = \"no.ply\"", "")
        + "[[obstacle]]\nname = \"b\"\nshape = { box = { half_extents = [1, 1, 1] } }\nmotion = { trace = \"motion.csv\" }\n"
        + more
        + "[[scenery]]\nname = \"c\"\nshape = { mesh = \"seen.obj\" }\n[hand]\npath = \"loop.csv\"\nloop = true\n[view]\nenvironment = \"no.hdr\"\n";
    let folder = Folder::new();
    folder.write("motion.csv", "t,x\n");
    folder.write(
        "loop.csv",
        "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,1,0,0,1,0,0,0\n",
    );
    // Without the fault of the scene itself the same is told.
    for (text, of_text) in [
        (text.clone(), true),
        (text.replace("speed = 1\n", ""), false),
    ] {
        let all = folder.check("s.toml", text).to_string();
        let of_files = [
            "no.ply",
            "no.png",
            "motion.csv:",
            "seen.obj",
            "no.hdr",
            "loop.csv:3: ",
        ];
        for part in of_files.into_iter().chain(of_text.then_some("`speed`")) {
            assert!(all.contains(part), "{part}: {all}");
        }
    }
}

#[test]
fn a_hand_that_does_not_return_is_told_with_file_and_line() {
    let folder = Folder::new();
    let row = |t: u32, z: f64| format!("{t},0,0,{z},1,0,0,0\n");
    let open = "t,x,y,z,qw,qx,qy,qz\n".to_owned() + &row(0, 0.05) + &row(1, 0.02);
    let path = folder.write("loop.csv", &open);
    let scene = |repeat: bool| {
        held(
            "sphere = { radius = 0.01 }",
            &format!("[hand]\npath = \"loop.csv\"\nloop = {repeat}\n"),
        )
    };
    let report = folder.check("s.toml", scene(true));
    assert!(
        report.problems.len() == 1 && report.problems[0].line == Some(3),
        "{report}"
    );
    assert!(report.problems[0].file.ends_with("loop.csv"), "{report}");
    assert!(folder.check("s.toml", scene(false)).is_good());
    assert!(looping_fault(&path).is_some());
    folder.write("loop.csv", open + &row(2, 0.05));
    assert!(folder.check("s.toml", scene(true)).is_good());
    assert_eq!(looping_fault(Path::new("none.csv")), None);
}

#[test]
fn chosen_pieces_of_a_file_are_the_shape() {
    let folder = Folder::new();
    for key in ["o", "g"] {
        folder.write("all.obj", obj(key));
        // A group's name ends at a blank, an object's does not.
        let second = if key == "o" { "my block" } else { "block" };
        for (only, triangles) in [("\"peg\"", 12), (&format!("\"peg\", \"{second}\""), 24)] {
            let shape = format!("mesh = \"all.obj\", only = [{only}]");
            let path = folder.write("s.toml", held(&shape, ""));
            let built = built(path);
            assert_eq!(built.bodies[0].mesh.triangles.len(), triangles);
            assert_eq!(built.bodies[0].mesh.vertices.len(), triangles * 8 / 12);
        }
        for (only, expected) in [
            ("", "only one edge"),
            (
                "only = [\"pge\"]",
                "has no node, object or group \"pge\"; it has \"peg\"",
            ),
            (
                "only = [\"peg\", \"pge\"]",
                "has no node, object or group \"pge\"",
            ),
            ("only = []", "names no piece"),
            ("only = 1", "must be an array of texts"),
        ] {
            let shape = format!(
                "mesh = \"all.obj\"{}{only}",
                if only.is_empty() { "" } else { ", " }
            );
            let report = folder.check("s.toml", held(&shape, ""));
            let told = report.to_string();
            let open = only.is_empty() && told.contains("edges have one triangle only");
            assert!(open || told.contains(expected), "{told}");
        }
    }
    let report = check(&[folder.path("all.obj")]).remove(0);
    assert_says(&report, "its 3 pieces are one body");
}
