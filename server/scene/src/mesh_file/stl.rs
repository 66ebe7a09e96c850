//! STL, binary and text, by the crate `stl_io`; corners are welded where their coordinates are exactly equal.

use std::borrow::Cow;
use std::io::Cursor;

use super::pieces::Pieces;
use super::read::{finite_vertex, is_blank, without_mark};
use super::{Fault, RawMesh};

/// Bytes before the first triangle of a binary file, and bytes per triangle.
const HEADER_BYTES: usize = 84;
const TRIANGLE_BYTES: usize = 50;

/// The mesh; the solids of a text go to `pieces`.
pub(super) fn parse(bytes: &[u8], pieces: &mut Pieces) -> Result<RawMesh, Fault> {
    let mut mesh = RawMesh::default();
    if is_text(bytes) {
        for solid in solids(bytes)? {
            let before = mesh.triangles.len();
            append(solid.text.as_bytes(), &mut mesh)?;
            pieces.begin(solid.name.into_iter().collect());
            pieces.grow(mesh.triangles.len() - before);
        }
    } else {
        let mut bytes = Cow::from(bytes);
        if bytes.starts_with(b"solid") {
            bytes.to_mut()[0] = b' '; // the crate would take it for a text
        }
        append(&bytes, &mut mesh)?;
        let whole = HEADER_BYTES + mesh.triangles.len() * TRIANGLE_BYTES;
        let rest = bytes.get(whole..).unwrap_or_default();
        if !is_blank(rest) {
            return Err(Fault::new(format!(
                "is too long: {} triangles are promised, but {} bytes follow them; export the file again",
                mesh.triangles.len(),
                rest.len()
            )));
        }
    }
    Ok(mesh.welded())
}

/// Whether triangles of a binary file have colours, which are not read: where bit 15 behind a triangle is set (VisCAM), or the header has `COLOR=`
/// (Materialise).
pub(super) fn has_colours(bytes: &[u8]) -> bool {
    let Some((header, triangles)) = bytes.split_at_checked(HEADER_BYTES) else {
        return false;
    };
    let in_header = header.windows(6).any(|word| word == b"COLOR=");
    let mut last_bytes = triangles
        .chunks_exact(TRIANGLE_BYTES)
        .map(|triangle| triangle[TRIANGLE_BYTES - 1]);
    !is_text(bytes) && (in_header || last_bytes.any(|byte| byte & 0x80 != 0))
}

/// Whether the file begins as a text does. A binary file may do so, too, but its count of triangles has a byte of 0.
fn is_text(bytes: &[u8]) -> bool {
    let start = without_mark(bytes).trim_ascii_start();
    let named = start.split_first_chunk::<5>();
    named.is_some_and(|(word, rest)| {
        word.eq_ignore_ascii_case(b"solid") && rest.first().is_some_and(u8::is_ascii_whitespace)
    }) && !bytes.contains(&0)
}

/// A solid of a text.
struct Solid {
    /// What follows the word `solid`.
    name: Option<String>,
    text: String,
}

/// The solids of a text, each for itself, without its name and its normals and in small letters: the crate reads to the first `endsolid`, and no capitals.
fn solids(bytes: &[u8]) -> Result<Vec<Solid>, Fault> {
    let written = String::from_utf8_lossy(without_mark(bytes));
    let text = written.to_ascii_lowercase();
    let mut solids: Vec<Solid> = Vec::new();
    let mut open: Option<Solid> = None;
    for (index, (line, as_written)) in text.lines().zip(written.lines()).enumerate() {
        let number = index + 1;
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else {
            continue;
        };
        let is_facet = word == "facet" && words.next() == Some("normal") && words.count() == 3;
        match (word, &mut open) {
            ("solid", None) => {
                let name = as_written.trim_start().get("solid".len()..).map(str::trim);
                open = Some(Solid {
                    name: name.filter(|name| !name.is_empty()).map(str::to_owned),
                    text: "solid \n".to_owned(),
                });
            }
            ("endsolid", Some(solid)) => {
                solid.text.push_str("endsolid\n");
                solids.extend(open.take());
            }
            // The corners say it; of a triangle without area some programs write what is no number.
            (_, Some(solid)) if is_facet => solid.text.push_str("facet normal 0 0 0\n"),
            (_, Some(solid)) => {
                solid.text.push_str(line);
                solid.text.push('\n');
            }
            (_, None) => {
                let text = format!("`{word}` stands outside of any `solid`; repair the line");
                return Err(Fault::at(number, text));
            }
        }
    }
    solids.extend(open);
    Ok(solids)
}

/// Appends the triangles of a binary file, or of one solid of a text.
fn append(bytes: &[u8], mesh: &mut RawMesh) -> Result<(), Fault> {
    let mut cursor = Cursor::new(bytes);
    let reader = stl_io::create_stl_reader(&mut cursor).map_err(|e| {
        Fault::new(format!(
            "is no STL file ({}); export it again",
            no_header(&e)
        ))
    })?;
    for triangle in reader {
        let number = mesh.triangles.len();
        let triangle = triangle.map_err(|e| Fault::new(broken_triangle(number, bytes, &e)))?;
        let first = mesh.vertices.len();
        for corner in triangle.vertices {
            let coordinates = corner.0.map(f64::from);
            let vertex = finite_vertex(mesh.vertices.len(), coordinates)
                .map_err(|text| Fault::new(format!("triangle {number}: {text}")))?;
            mesh.vertices.push(vertex);
        }
        let Ok(first) = u32::try_from(first) else {
            return Err(Fault::new("has too many triangles; simplify the mesh"));
        };
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    Ok(())
}

/// Why a file does not begin as STL files do.
fn no_header(error: &std::io::Error) -> String {
    if error.kind() == std::io::ErrorKind::UnexpectedEof {
        return format!(
            "it ends within the {HEADER_BYTES} bytes that a binary one begins with, and is no text of `solid` either"
        );
    }
    error.to_string()
}

fn broken_triangle(number: usize, bytes: &[u8], error: &std::io::Error) -> String {
    let promised = bytes
        .get(80..84)
        .and_then(|b| b.try_into().ok())
        .map(u32::from_le_bytes);
    match promised {
        Some(promised) if error.kind() == std::io::ErrorKind::UnexpectedEof && !is_text(bytes) => {
            let there = bytes.len().saturating_sub(HEADER_BYTES) / TRIANGLE_BYTES;
            format!(
                "is cut off: {promised} triangles are promised, {there} are there; copy the file again"
            )
        }
        _ => format!("triangle {number} cannot be read ({error}); export the file again"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(bytes: &[u8]) -> Result<RawMesh, Fault> {
        super::parse(bytes, &mut Pieces::default())
    }

    fn binary(count: u32, coordinates: &[f32]) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes.extend(count.to_le_bytes());
        for triangle in coordinates.chunks(9) {
            bytes.extend([0; 12]);
            triangle.iter().for_each(|c| bytes.extend(c.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn equal_corners_become_one_vertex() {
        let corners = [
            0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0,
            1.0,
        ];
        let mesh = parse(&binary(2, &corners)).unwrap();
        assert_eq!(mesh.vertices.len(), 4);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn text_files_are_read_too() {
        let text = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
        assert_eq!(parse(text).unwrap().triangles, [[0, 1, 2]]);
        let capitals = text.to_ascii_uppercase();
        assert_eq!(parse(&capitals).unwrap().triangles, [[0, 1, 2]]);
        let marked = [b"\xEF\xBB\xBF", &text[..]].concat();
        assert_eq!(parse(&marked).unwrap().triangles, [[0, 1, 2]]);
    }

    #[test]
    fn a_normal_that_is_no_number_is_no_fault_of_the_triangle() {
        let of = |normal: &str| {
            let text = format!(
                "solid a\nfacet {normal}\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n"
            );
            parse(text.as_bytes())
        };
        for normal in [
            "nan nan nan",
            "-nan(ind) 0 0",
            "-1.#IND -1.#IND 0",
            "inf 0 0",
        ] {
            let mesh = of(&format!("normal {normal}")).unwrap();
            assert_eq!(mesh.triangles, [[0, 1, 2]], "{normal}");
        }
        for broken in ["normal 0 0", "normal 0 0 1 0", "0 0 0 1"] {
            assert!(of(broken).is_err(), "{broken}");
        }
    }

    #[test]
    fn all_solids_of_a_text_are_read() {
        let solid = |name: &str, z: u8| {
            format!(
                "solid {name}\nfacet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 1 0 {z}\nvertex 0 1 {z}\nendloop\nendfacet\nendsolid {name}\n"
            )
        };
        let mesh = parse((solid("a", 0) + "\n" + &solid("", 1)).as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
        let fault = parse((solid("a", 0) + "facet normal 0 0 1\n").as_bytes()).unwrap_err();
        assert_eq!(
            fault,
            Fault::at(10, "`facet` stands outside of any `solid`; repair the line")
        );
    }

    #[test]
    fn a_binary_file_that_begins_like_a_text_is_read() {
        let mut bytes = binary(1, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        bytes[..8].copy_from_slice(b"solid a\n");
        assert_eq!(parse(&bytes).unwrap().triangles, [[0, 1, 2]]);
    }

    #[test]
    fn triangles_beyond_those_that_are_promised_are_named() {
        let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let text = parse(&binary(1, &[corners, corners].concat()))
            .unwrap_err()
            .text;
        assert_eq!(
            text,
            "is too long: 1 triangles are promised, but 50 bytes follow them; export the file again"
        );
        // Padding holds no triangle.
        let padded = [binary(1, &corners), vec![0; 7]].concat();
        assert_eq!(parse(&padded).unwrap().triangles.len(), 1);
    }

    #[test]
    fn a_file_too_short_for_a_header_is_said_to_be_so() {
        let text = parse(b"solid").unwrap_err().text;
        assert!(
            text.starts_with("is no STL file (it ends within the 84 bytes"),
            "{text}"
        );
    }

    #[test]
    fn a_cut_file_and_nan_are_named() {
        let text = parse(&binary(2, &[0.0; 9])).unwrap_err().text;
        assert_eq!(
            text,
            "is cut off: 2 triangles are promised, 1 are there; copy the file again"
        );
        let text = parse(&binary(1, &[f32::NAN; 9])).unwrap_err().text;
        assert!(text.contains("triangle 0: vertex 0 has x = NaN"), "{text}");
    }
}
