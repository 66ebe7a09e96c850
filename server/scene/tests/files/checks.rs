//! `check` finds the kind of a file and everything that is wrong with it.

use std::path::Path;

use taut_scene::shapes::cuboid;
use taut_scene::{
    FileKind, FileReport, SHIPPED_WORKBENCH, check, read_mesh, shipped_scene_text, write_ply,
};

use crate::support::{Folder, assert_says, joined};

#[test]
fn a_sound_mesh_gets_its_figures() {
    let report = Folder::new().check("box.ply", write_ply(&cuboid([0.1, 0.2, 0.3])));
    assert!(report.is_good(), "{report}");
    let figures = report.mesh.as_ref().unwrap();
    assert_eq!((figures.triangles, figures.vertices), (12, 8));
    assert!(figures.watertight && figures.oriented);
    assert!((figures.volume_m3 - 0.048).abs() < 1e-12);
    assert_eq!(figures.size_m, [0.2, 0.4, 0.6]);
    assert_says(
        &report,
        "12 triangles, 8 vertices, 0.2000 x 0.4000 x 0.6000 m, watertight yes",
    );
}

#[test]
fn lengths_far_below_a_micrometre_have_digits() {
    let report = Folder::new().check("thin.ply", write_ply(&cuboid([0.1, 0.2, 1e-6])));
    assert_says(&report, "0.2000 x 0.4000 x 2.000e-6 m,");
    let scene = "name = \"a\"\n[god_object]\nshape = { sphere = { radius = 0.01 } }\nmass = 1\n[method]\nclearance = 1e-9\n";
    let report = Folder::new().check("scene.toml", scene.as_bytes());
    assert_says(&report, "rest distance 0.100 nm");
}

#[test]
fn a_closed_part_inside_out_is_named_with_its_place_and_a_cavity_is_not() {
    let with_part = |half: f64, x: f64| {
        let mut part = cuboid([half; 3]);
        part.vertices.iter_mut().for_each(|p| p.x += x);
        part.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        write_ply(&joined([cuboid([0.1; 3]), part]))
    };
    let report = Folder::new().check("inverted.ply", with_part(0.02, 0.3));
    let texts: Vec<&str> = report.problems.iter().map(|p| p.text.as_str()).collect();
    let expected =
        "the closed part of 12 triangles about (0.30000, 0.00000, 0.00000) m is inside out";
    assert!(
        texts.len() == 1 && texts[0].starts_with(expected),
        "{texts:?}"
    );
    let cavity = Folder::new().check("cavity.ply", with_part(0.02, 0.05));
    assert!(cavity.is_good(), "{cavity}");
}

#[test]
fn a_broken_mesh_is_told_everything_that_is_wrong() {
    let mut mesh = cuboid([0.1, 0.1, 0.1]);
    mesh.triangles.pop();
    let doubled = mesh.triangles[0];
    mesh.triangles.push(doubled);
    mesh.triangles.push([0, 0, 1]);
    let report = Folder::new().check("broken.ply", write_ply(&mesh));
    let texts: Vec<&str> = report.problems.iter().map(|p| p.text.as_str()).collect();
    // The copy closes one of the three edges of the hole, the wrong way round, and crowds its other two.
    let expected = [
        "1 triangles have no area, the first about (-0.03333, -0.10000, -0.10000) m; remove them or merge their vertices, as `taut import` does",
        "1 triangles have the same corners as another, the first about (-0.10000, -0.03333, 0.03333) m; remove them, as `taut import` does",
        "2 edges have one triangle only, the first about (0.00000, 0.00000, 0.10000) m; close the holes",
        "2 edges have more than two triangles, the first about (-0.10000, -0.10000, 0.00000) m; split the surfaces apart",
        "1 edges have triangles that disagree about outside, the first about (-0.10000, 0.00000, 0.10000) m; turn triangles around",
    ];
    assert_eq!(texts.len(), expected.len());
    for (text, start) in texts.iter().zip(expected) {
        assert!(
            text.starts_with(start) && text.contains("`taut import`"),
            "{text}"
        );
    }
    assert_says(&report, "watertight NO");
}

#[test]
fn an_inside_out_mesh_and_millimetres_are_noticed() {
    let mut mesh = cuboid([30.0, 30.0, 30.0]);
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let report = Folder::new().check("inside.ply", write_ply(&mesh));
    assert_says(&report.problems[0], "inside.ply: the surface is inside out");
    assert_says(&report.notes[0], "unit = \"mm\"");
}

#[test]
fn a_part_in_millimetres_is_doubted_in_its_scene_and_taken_with_its_unit() {
    let folder = Folder::new();
    folder.write("part.ply", write_ply(&cuboid([30.0, 20.0, 10.0])));
    let scene = |more: &str| {
        format!(
            "name = \"part\"\n[god_object]\nmass = 1.0\nshape = {{ mesh = \"part.ply\"{more} }}\n[[obstacle]]\nname = \"table\"\n\
             shape = {{ plane = {{}} }}\npose = {{ position = [0.0, 0.0, -100.0] }}\n"
        )
    };
    let metres = folder.check("metres.toml", scene(""));
    assert_eq!(metres.notes.len(), 1, "{metres}");
    assert_says(&metres.notes[0], "60.00 m");
    assert_says(&metres.notes[0], "unit = \"mm\"");
    for (more, longest) in [
        (", unit = \"mm\"", "god-object 60.00 mm"),
        (", unit = \"mm\", scale = 2.0", "god-object 120.0 mm"),
        (", scale = 0.001", "god-object 60.00 mm"),
    ] {
        let report = folder.check("part.toml", scene(more));
        assert!(
            report.problems.is_empty() && report.notes.is_empty(),
            "{report}"
        );
        assert!(report.summary.contains(longest), "{report}");
    }
    let twice = folder.check("twice.toml", scene(", unit = \"um\""));
    assert_says(&twice.notes[0], "write no unit");
    let unknown = folder.check("ell.toml", scene(", unit = \"ell\""));
    assert_says(&unknown, "\"ell\", but must be");
}

#[test]
fn files_are_known_by_ending_and_contents() {
    let folder = Folder::new();
    folder.write(
        "peg-in-a-hole.csv",
        include_str!("../../../scenes/peg-in-a-hole.csv"),
    );
    let scene = folder.check("scene.toml", shipped_scene_text("peg-in-a-hole").unwrap());
    assert_eq!(scene.kind, FileKind::Scene);
    assert!(
        scene.is_good() && scene.summary.contains("god-object 288, box 280"),
        "{scene}"
    );
    let workbench = folder.check("bench.toml", SHIPPED_WORKBENCH);
    assert_eq!(workbench.kind, FileKind::Workbench);
    assert!(
        workbench.is_good() && workbench.summary.contains("2 screens, 2 nodes"),
        "{workbench}"
    );
    let trace = folder.check("trace.csv", "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n");
    assert_eq!((trace.kind, trace.is_good()), (FileKind::Trace, true));
    let neither = folder.check("other.toml", "a = 1");
    assert_says(&neither, "other.toml: is neither a scene");
    let unknown = folder.check("a.docx", "");
    assert_says(&unknown, "a.docx: is no file that taut knows");
    let shipped = check(&[Path::new("sphere-on-plane")]).remove(0);
    assert_eq!((shipped.kind, shipped.is_good()), (FileKind::Scene, true));
}

#[test]
fn a_scenes_faults_come_with_lines_and_as_json_values() {
    let text = shipped_scene_text("sphere-on-plane")
        .unwrap()
        .replace("mass = 1.0", "mas = 1.0")
        .replace("k_h", "kh");
    let folder = Folder::new();
    let hand = include_str!("../../../scenes/sphere-on-plane.csv");
    folder.write("sphere-on-plane.csv", hand);
    let report = folder.check("scene.toml", text);
    assert_eq!(report.problems.len(), 3, "{report}");
    assert!(report.problems.iter().all(|p| p.line.is_some()));
    assert_says(&report, "3 faults");
}

#[test]
fn all_formats_give_the_same_box() {
    let folder = Folder::new();
    let mesh = cuboid([1.0, 2.0, 3.0]);
    let mut obj = String::new();
    let mut stl = String::from("solid box\n");
    for v in &mesh.vertices {
        obj += &format!("v {} {} {}\n", v.x, v.y, v.z);
    }
    for t in &mesh.triangles {
        obj += &format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
        stl += "facet normal 0 0 0\nouter loop\n";
        for i in t {
            let v = mesh.vertices[*i as usize];
            stl += &format!("vertex {} {} {}\n", v.x, v.y, v.z);
        }
        stl += "endloop\nendfacet\n";
    }
    stl += "endsolid box\n";
    for (name, content) in [
        ("a.ply", write_ply(&mesh)),
        ("a.obj", obj.into_bytes()),
        ("a.stl", stl.into_bytes()),
    ] {
        let read = read_mesh(&folder.write(name, content)).unwrap();
        assert_eq!(
            (read.vertices.len(), read.triangles.len()),
            (8, 12),
            "{name}"
        );
        assert!(check(&[folder.path(name)])[0].is_good(), "{name}");
    }
}

/// The shipped workbench with this many more nodes, and with the first of `changes` put in the place of the second.
fn workbench_with(nodes: usize, changes: &[(&str, &str)]) -> FileReport {
    let mut text = SHIPPED_WORKBENCH.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    let at = text.find("[viewer]").expect("there is a viewer");
    let more: String = (0..nodes)
        .map(|k| format!("[[node]]\nname = \"more-{k}\"\nscreens = [\"front\"]\n\n"))
        .collect();
    text.insert_str(at, &more);
    Folder::new().check("workbench.toml", text)
}

#[test]
fn nodes_without_a_place_are_a_fault_and_clients_that_cost_much_a_note() {
    let room = ("max_clients = 16", "max_clients = 64");
    let report = workbench_with(40, &[room]);
    let text = report.to_string();
    assert!(
        !report.is_good() && text.contains("at most 32 are kept together"),
        "{text}"
    );
    let first = SHIPPED_WORKBENCH
        .lines()
        .position(|line| line == "[[node]]");
    let told: Vec<Option<usize>> = report.problems.iter().map(|p| p.line).collect();
    assert_eq!(told, [first.map(|line| line + 1)], "{text}");
    let off = ("swap = \"scheduled\"", "swap = \"off\"");
    let report = workbench_with(40, &[room, off]);
    assert!(report.is_good(), "{report}");
    assert_says(&report, "% of a core");
    let report = workbench_with(20, &[]);
    assert_says(&report, "`max_clients`");
    let slow = ("broadcast_rate = 1000", "broadcast_rate = 250");
    let report = workbench_with(0, &[room, slow]);
    assert!(report.is_good() && report.notes.is_empty(), "{report}");
}

#[test]
fn a_least_rate_above_the_rate_is_a_fault() {
    let report = workbench_with(0, &[("least_rate = 10", "least_rate = 61")]);
    let text = report.to_string();
    assert!(
        !report.is_good() && text.contains("every node would swap on its own"),
        "{text}"
    );
    assert!(!workbench_with(0, &[("rate = 60 ", "rate = 0.5 ")]).is_good());
}

#[test]
fn faults_of_meshes_are_told_with_those_of_the_scene_that_names_them() {
    let folder = Folder::new();
    let mut mesh = cuboid([0.1; 3]);
    mesh.triangles.pop();
    folder.write("open.ply", write_ply(&mesh));
    let report = folder.check(
        "faulty.toml",
        "name = \"x\"\nspeed = 3\n[god_object]\nmass = 1.0\nshape = { mesh = \"open.ply\" }\n\
         [[obstacle]]\nname = \"a\"\nshape = { mesh = \"missing.ply\" }\n[[obstacle]]\nname = \"b\"\nshape = { mesh = \"open.ply\" }\n",
    );
    let texts: Vec<&str> = report.problems.iter().map(|p| p.text.as_str()).collect();
    let expected = [
        "unknown key `speed`",
        "the mesh \"open.ply\" cannot be used: 3 edges have one triangle only, the first about",
        "the file \"missing.ply\" does not exist",
    ];
    assert_eq!(texts.len(), expected.len(), "{texts:?}");
    for (text, start) in texts.iter().zip(expected) {
        assert!(text.starts_with(start), "{text}");
    }
    assert_eq!(report.problems[1].line, Some(5));
}
