//! Wavefront OBJ: `v` and `f` lines, in double precision, with line numbers; `usemtl` and `mtllib`; `vt` lines where they are asked for.

use std::borrow::Cow;
use std::collections::HashMap;
use std::str::SplitWhitespace;

use god_object::surface::CornerCoordinates;

use super::body_textures::Corners;
use super::material::{Material, Materials};
use super::pieces::Pieces;
use super::polygon::{Polygons, triangles};
use super::read::{finite_vertex, without_mark};
use super::{Fault, RawMesh};

/// Most corners of one face. More is a broken line.
const MAX_FACE_CORNERS: usize = 10_000;
/// The place of a texture coordinate that a corner does not have: there are fewer.
const NO_COORDINATE: u32 = u32::MAX;

/// The mesh; which material each face names goes to `materials`, its object and groups to `pieces`.
pub(super) fn parse(
    bytes: &[u8],
    materials: &mut Materials,
    pieces: &mut Pieces,
) -> Result<RawMesh, Fault> {
    let text = String::from_utf8_lossy(without_mark(bytes)); // names in comments and groups may be in any encoding
    let mut mesh = RawMesh::default();
    let (mut polygons, mut faces) = (Polygons::default(), 0);
    let mut places: HashMap<String, usize> = HashMap::new();
    let mut material = None;
    let (mut object, mut groups) = (Vec::new(), Vec::new());
    // Faces may name vertices that come later: remember the line, check at the end.
    let mut first_line_of_largest = (0u32, 0usize);
    for (number, line) in lines(&text) {
        let mut words = words(&line);
        let fail = |text: String| Fault::at(number, text);
        match words.next() {
            Some("v") => {
                // Red, green and blue behind the coordinates, as scanners write them.
                materials.vertex_colours |= words.clone().nth(5).is_some();
                let vertex = vertex(mesh.vertices.len(), words).map_err(fail)?;
                mesh.vertices.push(vertex);
            }
            Some("f") => {
                let corners = face(words, mesh.vertices.len()).map_err(fail)?;
                let largest = corners.iter().copied().max().unwrap_or(0);
                if largest > first_line_of_largest.0 || first_line_of_largest.1 == 0 {
                    first_line_of_largest = (largest, number);
                }
                faces += 1;
                polygons.push(&mut mesh, &corners, faces, Some(number));
                materials.push(material, corners.len() - 2);
                pieces.grow(corners.len() - 2);
            }
            // What was said last is the piece's own name: some programs write groups into objects, others the other way round.
            Some(key @ "o") => {
                object = vec![named(&line, key).to_owned()];
                pieces.begin([&object[..], &groups].concat());
            }
            Some("g") => {
                groups = words.map(str::to_owned).collect();
                pieces.begin([&groups[..], &object].concat());
            }
            // Names may hold blanks.
            Some(key @ "usemtl") => {
                let name = named(&line, key);
                let place = places.entry(name.to_owned()).or_insert_with(|| {
                    materials.list.push(Material {
                        name: name.to_owned(),
                        ..Material::default()
                    });
                    materials.list.len() - 1
                });
                material = Some(*place);
            }
            Some("mtllib") => materials.libraries.extend(named_libraries(&line)),
            _ => {}
        }
    }
    vertices_are_there(first_line_of_largest, mesh.vertices.len())?;
    polygons.triangulate(&mut mesh)?;
    Ok(mesh)
}

/// Refuses a largest index that names no vertex, with its line; line 0 is of a file without faces.
fn vertices_are_there((largest, line): (u32, usize), count: usize) -> Result<(), Fault> {
    if line == 0 || (largest as usize) < count {
        return Ok(());
    }
    let text = format!(
        "a face names vertex {}, but the file has {count}; repair the mesh",
        largest + 1
    );
    Err(Fault::at(line, text))
}

/// The libraries of materials that the file names.
pub(super) fn libraries(bytes: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(without_mark(bytes));
    lines(&text)
        .filter(|(_, line)| line.split_whitespace().next() == Some("mtllib"))
        .flat_map(|(_, line)| named_libraries(&line))
        .collect()
}

/// The lines, counted from 1. One that ends in a backslash goes on in the next, and has the number of its first.
fn lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (index, line) = lines.next()?;
        let Some(begun) = continued(line) else {
            return Some((index + 1, Cow::Borrowed(line)));
        };
        let mut whole = begun.to_owned();
        for (_, line) in lines.by_ref() {
            whole.push(' ');
            let more = continued(line);
            whole.push_str(more.unwrap_or(line));
            if more.is_none() {
                break;
            }
        }
        Some((index + 1, Cow::Owned(whole)))
    })
}

/// What a line has before the backslash at its end; `None` without one. At the end of a comment it is the end of a folder's name.
fn continued(line: &str) -> Option<&str> {
    let begun = line.trim_end().strip_suffix('\\')?;
    (!begun.contains('#')).then_some(begun)
}

/// The name that follows the key of a line.
fn named<'l>(line: &'l str, key: &str) -> &'l str {
    name(line.trim_start().trim_start_matches(key))
}

/// A name without the comment behind it. It may hold blanks and a `#`, as in `Material #25`; a comment's `#` has a blank on either side.
pub(super) fn name(text: &str) -> &str {
    text.split(" # ").next().unwrap_or(text).trim()
}

/// The libraries that a `mtllib` line names. Where there are several, all but the last end in `.mtl`: names may hold blanks.
fn named_libraries(line: &str) -> Vec<String> {
    const ENDING: &str = ".mtl ";
    let names = named(line, "mtllib");
    let ends = names.to_ascii_lowercase();
    let mut begin = 0;
    let mut found = Vec::new();
    for (place, _) in ends.match_indices(ENDING) {
        let end = place + ENDING.len();
        found.push(names[begin..end].trim().to_owned());
        begin = end;
    }
    found.push(names[begin..].trim().to_owned());
    found
}

/// Texture coordinates of every triangle that [`parse`] gives, in its order. v of the file runs up the picture; here it runs down.
pub(super) fn parse_texture_coordinates(bytes: &[u8]) -> Result<Vec<CornerCoordinates>, Fault> {
    coordinates(bytes, None)
}

/// The same of a mesh that may have them in part only: the others are not finite. None where a face is no face.
pub(super) fn coordinates_of_pictures(bytes: &[u8]) -> Vec<Corners> {
    let found = coordinates(bytes, Some([f64::NAN; 2])).unwrap_or_default();
    let single = |corners: CornerCoordinates| corners.map(|pair| pair.map(|x| x as f32));
    found.into_iter().map(single).collect()
}

/// What stands in a line before a comment.
fn words(line: &str) -> SplitWhitespace<'_> {
    line.split('#')
        .next()
        .unwrap_or_default()
        .split_whitespace()
}

/// `stand_in` is for what a corner does not have; without it that is refused.
fn coordinates(bytes: &[u8], stand_in: Option<[f64; 2]>) -> Result<Vec<CornerCoordinates>, Fault> {
    let text = String::from_utf8_lossy(without_mark(bytes));
    let mut vertices = Vec::new();
    let mut pairs: Vec<[f64; 2]> = Vec::new();
    // Faces may name vertices and pairs that come later.
    let mut faces: Vec<(usize, Vec<u32>, Vec<u32>)> = Vec::new();
    for (number, line) in lines(&text) {
        let mut words = words(&line);
        let fail = |text: String| Fault::at(number, text);
        match words.next() {
            Some("v") => vertices.push(vertex(vertices.len(), words).map_err(fail)?),
            Some("vt") => {
                let [u, v] =
                    [words.next(), words.next()].map(|word| word.unwrap_or("0").parse::<f64>());
                pairs.push(match (u, v, stand_in) {
                    (Ok(u), Ok(v), _) => [u, 1.0 - v],
                    (_, _, Some(pair)) => pair,
                    _ => {
                        let text = "a texture coordinate is no number; repair the line";
                        return Err(Fault::at(number, text));
                    }
                });
            }
            Some("f") => {
                let corners = face(words.clone(), vertices.len()).map_err(fail)?;
                let of_corner = |word| match (coordinate_of(word, pairs.len()), stand_in) {
                    (Err(_), Some(_)) => Ok(NO_COORDINATE),
                    (found, _) => found,
                };
                let of_corners = words.map(of_corner);
                let of_corners = of_corners.collect::<Result<_, _>>().map_err(fail)?;
                faces.push((number, corners, of_corners));
            }
            _ => {}
        }
    }
    let mut found = Vec::new();
    for (number, corners, of_corners) in faces {
        let missing = |what: &str, index: u32, count: usize| {
            let text = format!(
                "a face names {what} {}, but the file has {count}; repair the mesh",
                index + 1
            );
            Fault::at(number, text)
        };
        let placed = |corner: u32| {
            let point = vertices.get(corner as usize).copied();
            point.ok_or_else(|| missing("vertex", corner, vertices.len()))
        };
        let pair = |corner: u32| {
            let pair = pairs.get(corner as usize).copied().or(stand_in);
            pair.ok_or_else(|| missing("texture coordinate", corner, pairs.len()))
        };
        let of_corners: Vec<_> = of_corners.into_iter().map(pair).collect::<Result<_, _>>()?;
        let points: Vec<_> = corners.into_iter().map(placed).collect::<Result<_, _>>()?;
        let cut = triangles(&points).map_err(|why| Fault::at(number, format!("a face {why}")))?;
        found.extend(cut.into_iter().map(|t| t.map(|corner| of_corners[corner])));
    }
    Ok(found)
}

/// The second of `v/vt/vn`, counted from 0.
fn coordinate_of(word: &str, pairs_so_far: usize) -> Result<u32, String> {
    let second = word.split('/').nth(1).filter(|text| !text.is_empty());
    let Some(second) = second else {
        return Err(format!(
            "`{word}` names no texture coordinate; export the mesh with them, or use mapping = \"triplanar\""
        ));
    };
    let index: i64 = second
        .parse()
        .map_err(|_| format!("`{word}` is no index of a texture coordinate; repair the line"))?;
    place_of(index, pairs_so_far)
        .filter(|place| *place != NO_COORDINATE)
        .ok_or_else(|| format!("`{word}` names no texture coordinate; indices start at 1"))
}

/// The place of an index, which counts from 1, or back from the last of `so_far` where it is negative.
fn place_of(index: i64, so_far: usize) -> Option<u32> {
    let before = if index > 0 { -1 } else { so_far as i64 };
    u32::try_from(before + index).ok().filter(|_| index != 0)
}

fn vertex<'w>(
    number: usize,
    mut words: impl Iterator<Item = &'w str>,
) -> Result<nalgebra::Point3<f64>, String> {
    let mut coordinates = [0.0; 3];
    for coordinate in &mut coordinates {
        let word = words
            .next()
            .ok_or("a vertex needs three coordinates; repair the line")?;
        *coordinate = word
            .parse()
            .map_err(|_| format!("`{word}` is no number; repair the line"))?;
    }
    if number >= u32::MAX as usize {
        return Err("too many vertices; simplify the mesh".into());
    }
    finite_vertex(number + 1, coordinates)
}

fn face<'w>(
    words: impl Iterator<Item = &'w str>,
    vertices_so_far: usize,
) -> Result<Vec<u32>, String> {
    let mut corners = Vec::new();
    for word in words {
        // v, v/vt, v//vn, v/vt/vn.
        let first = word.split('/').next().unwrap_or_default();
        let index: i64 = first
            .parse()
            .map_err(|_| format!("`{word}` is no vertex index; repair the line"))?;
        let place = place_of(index, vertices_so_far);
        corners.push(place.ok_or_else(|| format!("`{word}` names no vertex; indices start at 1"))?);
        if corners.len() > MAX_FACE_CORNERS {
            return Err(format!(
                "a face has more than {MAX_FACE_CORNERS} corners; repair the line"
            ));
        }
    }
    if corners.len() < 3 {
        return Err(format!(
            "a face has {} corners, but needs three; repair the line",
            corners.len()
        ));
    }
    Ok(corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(bytes: &[u8]) -> Result<RawMesh, Fault> {
        super::parse(bytes, &mut Materials::default(), &mut Pieces::default())
    }

    #[test]
    fn polygons_slashes_and_negative_indices_are_understood() {
        let mesh =
            parse(b"# square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1e-9\nf 1/1/1 2//2 3 -1\n").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.vertices[3].z, 1e-9);
    }

    #[test]
    fn names_end_where_a_comment_or_the_next_library_begins() {
        let text = "mtllib a.mtl My Part.MTL b # both\nmtllib my part.mtl\nmtllib \u{130}.mtl c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n\
                    usemtl steel # bare\nf 1 2 3\nusemtl Material #25\nf 1 3 2\nusemtl steel\nf 1 2 3\n";
        let libraries = [
            "a.mtl",
            "My Part.MTL",
            "b",
            "my part.mtl",
            "\u{130}.mtl",
            "c.mtl",
        ];
        assert_eq!(super::libraries(text.as_bytes()), libraries);
        let mut materials = Materials::default();
        assert!(super::parse(text.as_bytes(), &mut materials, &mut Pieces::default()).is_ok());
        assert_eq!(materials.libraries, libraries);
        let names: Vec<&str> = materials.list.iter().map(|one| one.name.as_str()).collect();
        assert_eq!(names, ["steel", "Material #25"]);
    }

    #[test]
    fn a_line_that_ends_in_a_backslash_goes_on_in_the_next() {
        let text = "# C:\\parts\\\nv 0 0 0\nv 1 \\\r\n0 0\nv 0 1 0\nvt 0 0\nf 1/1 \\\n2/1 \\\n3/1\nf 1/1 2/1 \\";
        let fault = parse(text.as_bytes()).unwrap_err();
        assert_eq!(
            fault,
            Fault::at(10, "a face has 2 corners, but needs three; repair the line")
        );
        let whole = text.trim_end_matches("f 1/1 2/1 \\");
        assert_eq!(parse(whole.as_bytes()).unwrap().triangles, [[0, 1, 2]]);
        let coordinates = parse_texture_coordinates(whole.as_bytes()).unwrap();
        assert_eq!(coordinates, [[[0.0, 1.0]; 3]]);
    }

    #[test]
    fn a_mark_before_the_text_is_skipped() {
        let text = "\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert_eq!(parse(text.as_bytes()).unwrap().vertices.len(), 3);
        let text = "\u{feff}vt 0 0\nv 0 0 0\nf 1/1 1/1 1/1\n";
        assert!(parse_texture_coordinates(text.as_bytes()).is_ok());
    }

    #[test]
    fn texture_coordinates_follow_the_fan_of_triangles() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nf 1/1 2/2/7 3/3 4/-1\nvt 1 1\nvt 0 0.25\n";
        // -1 is the last one so far.
        let fan = parse_texture_coordinates(text.as_bytes()).unwrap();
        assert_eq!(
            fan,
            [
                [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]],
                [[0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]
            ]
        );
    }

    #[test]
    fn concave_faces_are_covered_and_their_texture_coordinates_follow() {
        let text = "v 2 -1 0\nv 1 0 0\nv 2 1 0\nv 0 0 0\nvt 0 1\nvt 1 1\nvt 2 1\nvt 3 1\nf 1/1 2/2 3/3 4/4\n";
        let turned = text.replace("1/1 2/2 3/3 4/4", "4/4 1/1 2/2 3/3");
        for (text, expected) in [
            (text, [[3, 0, 1], [1, 2, 3]]),
            (&turned, [[3, 0, 1], [3, 1, 2]]),
        ] {
            assert_eq!(parse(text.as_bytes()).unwrap().triangles, expected);
            let of_corners = parse_texture_coordinates(text.as_bytes()).unwrap();
            assert_eq!(of_corners, expected.map(|t| t.map(|c| [f64::from(c), 0.0])));
        }
    }

    #[test]
    fn faces_without_texture_coordinates_are_named_by_line() {
        for (text, line, expected) in [
            (
                "vt 0 0\nf 1/1 2//1 3/1\n",
                2,
                "`2//1` names no texture coordinate",
            ),
            (
                "f 1/1 2/1 3/1\n",
                1,
                "a face names texture coordinate 1, but the file has 0",
            ),
            ("vt 0 x\n", 1, "a texture coordinate is no number"),
            ("vt 0 0\nf 1/0 2/1 3/1\n", 2, "indices start at 1"),
        ] {
            let fault = parse_texture_coordinates(text.as_bytes()).unwrap_err();
            assert_eq!(fault.line, Some(line));
            assert!(fault.text.contains(expected), "{}", fault.text);
        }
    }

    #[test]
    fn faults_name_line_and_vertex() {
        let bow = "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 4\n";
        for (text, line, expected) in [
            ("v 0 0 0\nv 0 nan 0\n", 2, "vertex 2 has y = NaN"),
            (
                "v 0 0 0\nf 1 2 3\n",
                2,
                "a face names vertex 3, but the file has 1;",
            ),
            (
                "v 0 0 0\nf 1 1\n",
                2,
                "a face has 2 corners, but needs three;",
            ),
            ("v 0 0\n", 1, "a vertex needs three coordinates;"),
            (bow, 5, "face 1 of 4 corners is no simple polygon"),
        ] {
            let Fault { line: at, text } = parse(text.as_bytes()).unwrap_err();
            assert!(at == Some(line) && text.starts_with(expected), "{text}");
        }
    }
}
