//! PLY files read, and refused where they are damaged.

use super::*;

const TEXT: &str = "ply\nformat ascii 1.0\ncomment a\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0.5 9\n4 0 1 2 3\n";

#[test]
fn text_with_extra_properties_and_a_polygon_is_read() {
    let mesh = parse(TEXT.as_bytes()).unwrap();
    assert_eq!(mesh.vertices.len(), 4);
    assert_eq!(mesh.vertices[3].z, 0.5);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn a_concave_face_is_covered() {
    // The fan around the first corner would cover the notch, which is at the third.
    let arrow = TEXT.replace("1 0 0 9\n1 1 0 9\n0 1 0.5 9", "2 -1 0 9\n1 0 0 9\n2 1 0 9");
    let turned = arrow.replace("4 0 1 2 3", "4 1 2 3 0");
    assert_eq!(
        parse(turned.as_bytes()).unwrap().triangles,
        [[0, 1, 2], [2, 3, 0]]
    );
}

#[test]
fn a_mark_before_the_text_is_skipped() {
    let mesh = parse(("\u{feff}".to_owned() + TEXT).as_bytes()).unwrap();
    assert_eq!(mesh, parse(TEXT.as_bytes()).unwrap());
}

#[test]
fn what_is_written_is_read_back_exactly() {
    let mesh = parse(TEXT.as_bytes()).unwrap();
    assert_eq!(parse(&write_ply(&mesh)).unwrap(), mesh);
}

#[test]
fn big_endian_is_read() {
    let mut bytes = b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar ushort vertex_index\nend_header\n".to_vec();
    for coordinate in [0.0f32, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(coordinate.to_be_bytes());
    }
    bytes.push(3);
    [0u16, 1, 2]
        .iter()
        .for_each(|i| bytes.extend(i.to_be_bytes()));
    let mesh = parse(&bytes).unwrap();
    assert_eq!(mesh.vertices[1].x, 1.5);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn faults_name_line_and_place() {
    let bow = TEXT.replace("0.5", "0").replace("4 0 1 2 3", "4 0 2 1 3");
    for (text, line, expected) in [
        (bow, Some(16), "face 0 of 4 corners is no simple polygon"),
        (
            TEXT.replace("1 1 0 9", "1 nan 0 9"),
            Some(14),
            "vertex 2 has y = NaN",
        ),
        (
            TEXT.replace("4 0 1 2 3", "4 0 1 2 7"),
            None,
            "triangle 1 names vertex 7, but the file has 4; repair the mesh",
        ),
        (
            TEXT.replace("4 0 1 2 3", "3 0 1"),
            Some(16),
            "face 0 has too few numbers; repair the line",
        ),
        (
            TEXT.replace("1 0 0 9", "1 0 zero 9"),
            Some(13),
            "`zero` in vertex 1 is no number; repair the line",
        ),
        ("solid".to_owned(), Some(1), "is no PLY file;"),
    ] {
        let fault = parse(text.as_bytes()).unwrap_err();
        assert_eq!(fault.line, line, "{fault:?}");
        assert!(fault.text.starts_with(expected), "{fault:?}");
    }
}

#[test]
fn a_cut_file_says_where_it_ends() {
    let whole = write_ply(&parse(TEXT.as_bytes()).unwrap());
    let fault = parse(&whole[..whole.len() - 5]).unwrap_err();
    assert_eq!(fault.text, "is cut off in face 1 of 2; copy the file again");
}

#[test]
fn rows_beyond_those_that_are_promised_are_named() {
    let text = "has more after the last element than its header promises; export the file again";
    let fault = parse((TEXT.to_owned() + "3 0 1 2\n").as_bytes()).unwrap_err();
    assert_eq!(fault, Fault::at(17, text));
    let whole = write_ply(&parse((TEXT.to_owned() + "\n\n").as_bytes()).unwrap());
    assert_eq!(parse(&[whole, vec![3]].concat()).unwrap_err().text, text);
}

#[test]
fn a_lying_header_allocates_nothing() {
    let text = TEXT.replace("element vertex 4", "element vertex 99999999999999");
    assert!(
        parse(text.as_bytes())
            .unwrap_err()
            .text
            .contains("is cut off: 99999999999999 `vertex` are promised")
    );
}
