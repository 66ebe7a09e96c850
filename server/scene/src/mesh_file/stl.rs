//! STL, binary and text, by the crate `stl_io`; corners are welded where their coordinates are exactly equal.

use std::io::Cursor;

use super::read::finite_vertex;
use super::{Fault, RawMesh};

/// Bytes before the first triangle of a binary file, and bytes per triangle.
const HEADER_BYTES: usize = 84;
const TRIANGLE_BYTES: usize = 50;

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, Fault> {
    let mut cursor = Cursor::new(bytes);
    let reader = stl_io::create_stl_reader(&mut cursor).map_err(|e| {
        Fault::new(format!(
            "is no STL file ({}); export it again",
            no_header(&e)
        ))
    })?;
    let mut mesh = RawMesh::default();
    for (number, triangle) in reader.enumerate() {
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
    Ok(mesh.welded())
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
        Some(promised)
            if error.kind() == std::io::ErrorKind::UnexpectedEof
                && !bytes.starts_with(b"solid") =>
        {
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
