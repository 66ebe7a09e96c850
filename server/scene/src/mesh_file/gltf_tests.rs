//! glTF files read, and refused where they are damaged.

use super::*;

fn parse(bytes: &[u8], directory: Option<&Path>) -> Result<RawMesh, Fault> {
    super::parse(
        bytes,
        directory,
        &mut Materials::default(),
        &mut Pieces::default(),
    )
}

/// One triangle in a data URI; indices in the first 8 bytes, positions after.
fn triangle(node: &str, last_index: u16) -> String {
    let mut bytes = Vec::new();
    for index in [0, 1, last_index, 0] {
        bytes.extend(index.to_le_bytes());
    }
    for coordinate in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(coordinate.to_le_bytes());
    }
    let data = taut_test_kit::base64(&bytes);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0{node}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":1}},"indices":0}}]}}],
        "buffers":[{{"uri":"data:application/octet-stream;base64,{data}","byteLength":44}}],
        "bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":6}},{{"buffer":0,"byteOffset":8,"byteLength":36}}],
        "accessors":[{{"bufferView":0,"componentType":5123,"count":3,"type":"SCALAR"}},
        {{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}]}}"#
    )
}

/// Found by fuzzing: the crate's reader took the header's length for longer than the header.
#[test]
fn a_container_shorter_than_its_header_is_refused() {
    for length in [0_u32, 11, 12, 19, 40, u32::MAX] {
        let bytes = [b"glTF\x02\0\0\0", &length.to_le_bytes()[..], &[0; 27]].concat();
        let fault = parse(&bytes, None).expect_err("no chunk");
        assert!(fault.text.starts_with("is no valid GLB"), "{}", fault.text);
    }
}

/// Found by fuzzing: the crate's validation indexed the accessors without a look at their number.
#[test]
fn positions_in_an_accessor_that_is_not_there_are_refused() {
    let text =
        r#"{"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":2}}]}]}"#;
    let fault = parse(text.as_bytes(), None).expect_err("no accessors");
    assert_eq!(
        fault.text,
        "has positions in accessor 2, but 0 accessors; export it again"
    );
}

#[test]
fn node_transforms_are_applied() {
    let mesh = parse(
        triangle(r#","translation":[0,0,5],"scale":[2,2,2]"#, 2).as_bytes(),
        None,
    )
    .unwrap();
    assert_eq!(mesh.vertices[1], Point3::new(2.0, 0.0, 5.0));
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn a_mirroring_node_keeps_the_outside_outside() {
    let mesh = parse(triangle(r#","scale":[-1,1,1]"#, 2).as_bytes(), None).unwrap();
    assert_eq!(mesh.triangles, [[0, 2, 1]]);
}

#[test]
fn texture_coordinates_go_with_their_corners() {
    // The file's floats, read in pairs, serve as coordinates.
    let with_coordinates = |node: &str| {
        triangle(node, 2)
            .replace("\"POSITION\":1", "\"POSITION\":1,\"TEXCOORD_0\":2")
            .replace(
                "\"byteLength\":36}",
                "\"byteLength\":36},{\"buffer\":0,\"byteOffset\":8,\"byteLength\":24}",
            )
            .replace(
                "\"max\":[1,1,0]}",
                "\"max\":[1,1,0]},{\"bufferView\":2,\"componentType\":5126,\"count\":3,\"type\":\"VEC2\"}",
            )
    };
    let read = |text: String| parse_texture_coordinates(text.as_bytes(), None);
    assert_eq!(
        read(with_coordinates("")).unwrap(),
        [[[0.0, 0.0], [0.0, 1.0], [0.0, 0.0]]]
    );
    // As the corners are exchanged, so are theirs.
    assert_eq!(
        read(with_coordinates(r#","scale":[-1,1,1]"#)).unwrap(),
        [[[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]]]
    );
    let fault = read(triangle("", 2)).unwrap_err();
    assert!(
        fault
            .text
            .contains("mesh 0 primitive 0: has no texture coordinates"),
        "{}",
        fault.text
    );
}

#[test]
fn a_buffer_lies_beside_the_file_and_its_name_may_be_encoded() {
    let text = triangle("", 2);
    let (head, tail) = text.split_once("data:").unwrap();
    let (data, tail) = tail.split_once('"').unwrap();
    let bytes =
        crate::mesh_file::gltf_container::decode_base64(data.split_once(',').unwrap().1).unwrap();
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("a b.bin"), bytes).unwrap();
    let read = |uri: &str| {
        parse(
            format!("{head}{uri}\"{tail}").as_bytes(),
            Some(directory.path()),
        )
    };
    for uri in ["a%20b.bin", "./a%20b.bin"] {
        assert_eq!(read(uri).unwrap().triangles, [[0, 1, 2]]);
    }
    for uri in ["%2E%2E/a%20b.bin", "../secret.bin"] {
        let expected =
            format!("buffer 0 is `{uri}`, but must lie beside the file; export it as .glb");
        assert_eq!(read(uri).unwrap_err(), Fault::new(expected));
    }
}

/// A skin or a target by itself makes a file no worse; a mesh that hangs on one is elsewhere than its vertices say.
#[test]
fn a_mesh_that_is_morphed_or_has_a_skin_is_refused() {
    let targets = |node: &str| {
        let with = "\"indices\":0,\"targets\":[{\"POSITION\":1}]";
        triangle(node, 2).replace("\"indices\":0", with)
    };
    let skin = |node: &str| {
        triangle(node, 2).replace("\"meshes\":", "\"skins\":[{\"joints\":[0]}],\"meshes\":")
    };
    for text in [targets(""), targets(r#","weights":[0.0]"#), skin("")] {
        assert!(parse(text.as_bytes(), None).is_ok(), "{text}");
    }
    for (text, expected) in [
        (targets(r#","weights":[0.5]"#), "mesh 0 has morph targets"),
        (skin(r#","skin":0"#), "mesh 0 has a skin"),
    ] {
        let text = parse(text.as_bytes(), None).unwrap_err().text;
        assert!(text.starts_with(expected), "{text}");
    }
}

/// The crate reads an element out of the bytes up to the next one, and panics where those are too few.
#[test]
fn what_an_accessor_does_not_hold_is_refused() {
    let changed = |from: &str, to: &str| triangle("", 2).replace(from, to);
    let strided = |stride: u32| {
        let view = format!("\"byteLength\":36,\"byteStride\":{stride}}}");
        changed("\"byteLength\":36}", &view)
    };
    let past = changed(r#""count":3,"type":"VEC3""#, r#""count":4,"type":"VEC3""#);
    let overlap = "accessor 1 has elements that overlap (byteStride";
    for (text, expected) in [
        (triangle("", 7), "an index is 7, but there are 3 vertices"),
        (past, "accessor 1 reaches past its buffer"),
        (strided(4), &format!("{overlap} 4)")),
        (strided(8), &format!("{overlap} 8)")),
    ] {
        let expected = format!("mesh 0 primitive 0: {expected}; export");
        let text = parse(text.as_bytes(), None).unwrap_err().text;
        assert!(text.starts_with(&expected), "{text}");
    }
}
