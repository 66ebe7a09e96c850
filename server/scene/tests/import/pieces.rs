//! Files of several pieces, and files that are no surfaces.

use taut_scene::{FileError, ImportReport, ImportRequest, import};
use taut_test_kit::base64;

use super::solids::part;
use super::write::ply;
use crate::support::{Folder, assert_says};

/// Two tetrahedra in glTF: nodes "peg" and "block" below "tool", and another scene.
fn gltf(more: &str) -> String {
    let corners: [[f32; 3]; 12] = {
        let [a, b, c, d] = [
            [0.0, 0.0, 0.0],
            [0.01, 0.0, 0.0],
            [0.0, 0.01, 0.0],
            [0.0, 0.0, 0.01],
        ];
        [a, c, b, a, b, d, a, d, c, b, c, d]
    };
    let bytes: Vec<u8> = corners
        .iter()
        .flatten()
        .flat_map(|c| c.to_le_bytes())
        .collect();
    let data = base64(&bytes);
    format!(
        r#"{{"asset":{{"version":"2.0"}},{more}"buffers":[{{"byteLength":144,"uri":"data:application/octet-stream;base64,{data}"}}],
        "bufferViews":[{{"buffer":0,"byteLength":144}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":12,"type":"VEC3","min":[0,0,0],"max":[0.01,0.01,0.01]}}],
        "meshes":[{{"name":"form","primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "nodes":[{{"name":"tool","children":[1,2]}},{{"name":"peg","mesh":0}},{{"name":"block","mesh":0,"translation":[0.1,0,0]}},{{"name":"spare","mesh":0}}],
        "scene":0,"scenes":[{{"nodes":[0]}},{{"name":"store","nodes":[3]}}]}}"#
    )
}

fn imported(name: &str, bytes: impl AsRef<[u8]>, only: &[&str]) -> Result<ImportReport, FileError> {
    let folder = Folder::new();
    folder.write(name, bytes);
    import(&ImportRequest {
        only: only.iter().map(|name| (*name).to_owned()).collect(),
        ..folder.request(&[name])
    })
}

#[test]
fn pieces_and_scenes_that_are_left_out_are_told() {
    let report = imported("tool.gltf", gltf(""), &[]).unwrap();
    let told = report.to_string();
    assert_says(&told, "joined its 2 pieces in one body: \"block\", \"peg\"");
    assert_says(&told, "scene 1 \"store\" of the file is left out");
    assert_eq!(report.parts[0].mesh.triangles, 8);
}

#[test]
fn only_the_chosen_nodes_are_taken() {
    for (only, triangles) in [
        (&["peg"][..], 4),
        (&["block", "peg"], 8),
        (&["tool"], 8),
        (&["form"], 8),
    ] {
        let report = imported("tool.gltf", gltf(""), only).unwrap();
        assert_eq!(report.parts[0].mesh.triangles, triangles, "{only:?}");
        assert_says(&report, "took only");
    }
    let error = imported("tool.gltf", gltf(""), &["pin"]).unwrap_err();
    assert_says(&error, "it has \"block\", \"peg\"");
    let error = imported("tool.gltf", gltf(""), &["peg", "pin"]).unwrap_err();
    assert_says(&error, "no part has a node, object or group \"pin\"");
    // Of another scene.
    assert!(imported("tool.gltf", gltf(""), &["spare"]).is_err());
}

#[test]
fn a_file_without_names_is_taken_whole_beside_one_with_them() {
    let folder = Folder::new();
    folder.write("tool.gltf", gltf(""));
    folder.write("plain.ply", ply(&part()));
    let request = ImportRequest {
        only: vec!["peg".to_owned()],
        ..folder.request(&["tool.gltf", "plain.ply"])
    };
    let report = import(&request).unwrap();
    assert_eq!(report.parts[0].mesh.triangles, 4);
    assert_eq!(report.parts[1].mesh.triangles, part().len());
}

#[test]
fn what_is_no_surface_is_refused_with_what_to_do() {
    let draco = gltf(
        r#""extensionsUsed":["KHR_draco_mesh_compression"],"extensionsRequired":["KHR_draco_mesh_compression"],"#,
    );
    let points = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n1 0 0\n";
    for (name, bytes, expected) in [
        (
            "a.gltf",
            draco.as_str(),
            "export it without Draco compression",
        ),
        ("a.ply", points, "`taut import --thicken` makes a shell"),
        (
            "a.step",
            "ISO-10303-21;",
            "export the part as STL, OBJ or glTF",
        ),
        ("a.IGS", "", "export the part as STL, OBJ or glTF"),
    ] {
        let error = imported(name, bytes, &[]).unwrap_err().to_string();
        assert!(error.contains(expected), "{name}: {error}");
    }
    let error = import(&Folder::new().request(&[""])).unwrap_err();
    assert_says(&error, "is a directory");
}
