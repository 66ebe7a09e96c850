//! PLY: text, binary little-endian, binary big-endian. Reads `vertex` x y z and `face` vertex_indices, skips the rest.
//!
//! Sizes promised by the header are held against the bytes that are there before anything is allocated.

use std::fmt::Write as _;

use super::polygon::Polygons;
use super::read::{finite_vertex, is_blank, without_mark};
use super::{Fault, RawMesh};

/// Longest header, bytes.
const MAX_HEADER_BYTES: usize = 64 * 1024;
/// Most properties of one element.
const MAX_PROPERTIES: usize = 256;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Text,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

#[derive(Debug)]
struct Property {
    name: String,
    /// Type of the count, if it is a list.
    count: Option<Scalar>,
    scalar: Scalar,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, Fault> {
    let (format, elements, body) = header(bytes)?;
    let header_lines = bytes[..bytes.len() - body.len()]
        .iter()
        .filter(|b| **b == b'\n')
        .count();
    let mut source = match format {
        Format::Text => Source::Text {
            rest: body,
            line: header_lines + 1,
        },
        Format::Little => Source::Binary {
            rest: body,
            little: true,
        },
        Format::Big => Source::Binary {
            rest: body,
            little: false,
        },
    };
    let mut mesh = RawMesh::default();
    let mut polygons = Polygons::default();
    for element in &elements {
        match element.name.as_str() {
            "vertex" => vertices(element, &mut source, &mut mesh)?,
            "face" => faces(element, &mut source, &mut mesh, &mut polygons)?,
            _ => {
                for number in 0..element.count {
                    element.row(number, &mut source, |source| {
                        let mut properties = element.properties.iter();
                        properties.try_for_each(|property| property.skip(source))
                    })?;
                }
            }
        }
    }
    if !is_blank(source.rest()) {
        let text =
            "has more after the last element than its header promises; export the file again";
        return Err(Fault {
            line: source.current_line(),
            text: text.to_owned(),
        });
    }
    let count = mesh.vertices.len();
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        if let Some(wrong) = triangle.iter().find(|i| **i as usize >= count) {
            let text = format!(
                "triangle {number} names vertex {wrong}, but the file has {count}; repair the mesh"
            );
            return Err(Fault::new(text));
        }
    }
    polygons.triangulate(&mut mesh)?;
    Ok(mesh)
}

/// Whether elements of this name have colours, which are not read.
pub(super) fn has_colours(bytes: &[u8], name: &str) -> bool {
    let coloured = |element: &Element| {
        let mut properties = element.properties.iter();
        element.name == name && properties.any(|property| property.name == "red")
    };
    header(bytes).is_ok_and(|(_, elements, _)| elements.iter().any(coloured))
}

/// What the header declares, and the bytes after it.
fn header(bytes: &[u8]) -> Result<(Format, Vec<Element>, &[u8]), Fault> {
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut rest = without_mark(bytes);
    let mut number = 0;
    loop {
        number += 1;
        let limit = rest.len().min(MAX_HEADER_BYTES);
        let Some(end) = rest[..limit].iter().position(|b| *b == b'\n') else {
            let text = if number == 1 {
                "is no PLY file; export it again"
            } else {
                "the header has no end; copy the file again"
            };
            return Err(Fault::at(number, text));
        };
        let line = String::from_utf8_lossy(&rest[..end]);
        rest = &rest[end + 1..];
        if bytes.len() - rest.len() > MAX_HEADER_BYTES {
            return Err(Fault::at(
                number,
                "the header is too long; is it a PLY file?",
            ));
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let fail = |text: &str| Err(Fault::at(number, text));
        match words.as_slice() {
            ["ply"] if number == 1 => {}
            _ if number == 1 => return fail("is no PLY file; export it again"),
            ["format", name, "1.0"] => {
                format = Some(match *name {
                    "ascii" => Format::Text,
                    "binary_little_endian" => Format::Little,
                    "binary_big_endian" => Format::Big,
                    _ => return fail("has an unknown format; use ascii or binary_little_endian"),
                });
            }
            ["comment" | "obj_info", ..] | [] => {}
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    return fail("the count of an element is no number; repair the header");
                };
                elements.push(Element {
                    name: (*name).to_owned(),
                    count,
                    properties: Vec::new(),
                });
            }
            ["property", words @ ..] => {
                let Some((property, element)) = property(words).zip(elements.last_mut()) else {
                    return fail("a property is not understood; repair the header");
                };
                if element.properties.len() >= MAX_PROPERTIES {
                    return fail("an element has too many properties; repair the header");
                }
                element.properties.push(property);
            }
            ["end_header"] => break,
            _ => return fail("a header line is not understood; repair the header"),
        }
    }
    let Some(format) = format else {
        return Err(Fault::at(
            number,
            "the header names no format; export the file again",
        ));
    };
    within_file(&elements, rest.len())?;
    Ok((format, elements, rest))
}

/// The property that is declared by the words after `property`.
fn property(words: &[&str]) -> Option<Property> {
    let (count, scalar, name) = match words {
        ["list", count, scalar, name] => (Some(Scalar::named(count)?), scalar, name),
        [scalar, name] => (None, scalar, name),
        _ => return None,
    };
    Some(Property {
        name: (*name).to_owned(),
        count,
        scalar: Scalar::named(scalar)?,
    })
}

/// Refuses elements that cannot all be in the `left` bytes after the header.
fn within_file(elements: &[Element], left: usize) -> Result<(), Fault> {
    for element in elements {
        // Every element takes at least a byte, so a count above the bytes left is a lie (an element without
        // properties takes none, and would be an endless loop instead).
        if element.count > left || (element.properties.is_empty() && element.count > 0) {
            let text = format!(
                "is cut off: {} `{}` are promised, {} bytes are there; copy the file again",
                element.count, element.name, left
            );
            return Err(Fault::new(text));
        }
    }
    Ok(())
}

fn vertices(element: &Element, source: &mut Source<'_>, mesh: &mut RawMesh) -> Result<(), Fault> {
    let axes = ["x", "y", "z"].map(|axis| {
        element
            .properties
            .iter()
            .position(|p| p.name == axis && p.count.is_none())
    });
    let [Some(x), Some(y), Some(z)] = axes else {
        return Err(Fault::new(
            "its vertices lack x, y or z; export the mesh again",
        ));
    };
    if u32::try_from(element.count).is_err() {
        return Err(Fault::new("has too many vertices; simplify the mesh"));
    }
    for number in 0..element.count {
        let mut coordinates = [0.0; 3];
        element.row(number, source, |source| {
            for (place, property) in element.properties.iter().enumerate() {
                let value = property.read(source)?;
                for (coordinate, wanted) in coordinates.iter_mut().zip([x, y, z]) {
                    if place == wanted {
                        *coordinate = value;
                    }
                }
            }
            Ok(())
        })?;
        let vertex = finite_vertex(number, coordinates).map_err(|text| Fault {
            line: source.finished_line(),
            text,
        })?;
        mesh.vertices.push(vertex);
    }
    Ok(())
}

fn faces(
    element: &Element,
    source: &mut Source<'_>,
    mesh: &mut RawMesh,
    polygons: &mut Polygons,
) -> Result<(), Fault> {
    let is_corners = |p: &Property| {
        p.count.is_some() && matches!(p.name.as_str(), "vertex_indices" | "vertex_index")
    };
    if !element.properties.iter().any(is_corners) {
        return Err(Fault::new(
            "its faces lack vertex_indices; export the mesh again",
        ));
    }
    let mut corners: Vec<u32> = Vec::new();
    for number in 0..element.count {
        element.row(number, source, |source| {
            for property in &element.properties {
                let Some(count) = property.count.filter(|_| is_corners(property)) else {
                    property.skip(source)?;
                    continue;
                };
                let listed = source.scalar(count)?;
                corners.clear();
                // A list longer than the file runs into its end: no allocation ahead of the bytes.
                for _ in 0..listed as u64 {
                    let index = source.scalar(property.scalar)?;
                    if index.fract() != 0.0 || !(0.0..f64::from(u32::MAX)).contains(&index) {
                        return Err(Broken::Index(index));
                    }
                    corners.push(index as u32);
                }
            }
            Ok(())
        })?;
        if corners.len() < 3 {
            let text = format!(
                "face {number} has {} corners, but needs three; repair the mesh",
                corners.len()
            );
            return Err(Fault {
                line: source.finished_line(),
                text,
            });
        }
        polygons.push(mesh, &corners, number, source.finished_line());
    }
    Ok(())
}

impl Element {
    /// One of its rows, by what reads its values.
    fn row(
        &self,
        number: usize,
        source: &mut Source<'_>,
        read: impl FnOnce(&mut Source<'_>) -> Result<(), Broken>,
    ) -> Result<(), Fault> {
        read(source)
            .and_then(|()| source.end_element())
            .map_err(|broken| broken.in_element(self, number, source))
    }
}

impl Property {
    fn read(&self, source: &mut Source<'_>) -> Result<f64, Broken> {
        match self.count {
            None => source.scalar(self.scalar),
            Some(_) => self.skip(source).map(|()| f64::NAN),
        }
    }

    fn skip(&self, source: &mut Source<'_>) -> Result<(), Broken> {
        let times = match self.count {
            None => 1,
            Some(count) => source.scalar(count)? as u64,
        };
        for _ in 0..times {
            source.scalar(self.scalar)?;
        }
        Ok(())
    }
}

/// Why a value could not be read.
enum Broken {
    End,
    Word(String),
    MissingInLine,
    LeftInLine,
    Index(f64),
}

impl Broken {
    fn in_element(&self, element: &Element, number: usize, source: &Source<'_>) -> Fault {
        let name = &element.name;
        let text = match self {
            Self::End => format!(
                "is cut off in {name} {number} of {}; copy the file again",
                element.count
            ),
            Self::Word(word) => {
                format!("`{word}` in {name} {number} is no number; repair the line")
            }
            Self::MissingInLine => format!("{name} {number} has too few numbers; repair the line"),
            Self::LeftInLine => format!("{name} {number} has too many numbers; repair the line"),
            Self::Index(index) => format!("{name} {number} names vertex {index}; repair the mesh"),
        };
        Fault {
            line: source.current_line(),
            text,
        }
    }
}

/// Where values come from.
enum Source<'b> {
    Text { rest: &'b [u8], line: usize },
    Binary { rest: &'b [u8], little: bool },
}

impl Source<'_> {
    fn rest(&self) -> &[u8] {
        match self {
            Self::Text { rest, .. } | Self::Binary { rest, .. } => rest,
        }
    }

    fn current_line(&self) -> Option<usize> {
        match self {
            Self::Text { line, .. } => Some(*line),
            Self::Binary { .. } => None,
        }
    }

    /// The line of the element that was just ended.
    fn finished_line(&self) -> Option<usize> {
        self.current_line()
            .map(|line| line.saturating_sub(1).max(1))
    }

    fn scalar(&mut self, scalar: Scalar) -> Result<f64, Broken> {
        match self {
            Self::Text { rest, .. } => {
                let blanks = rest
                    .iter()
                    .take_while(|b| **b != b'\n' && b.is_ascii_whitespace())
                    .count();
                let after = &rest[blanks..];
                let length = after
                    .iter()
                    .take_while(|b| !b.is_ascii_whitespace())
                    .count();
                if length == 0 {
                    return Err(if after.is_empty() {
                        Broken::End
                    } else {
                        Broken::MissingInLine
                    });
                }
                let word = String::from_utf8_lossy(&after[..length]);
                let value = word
                    .parse()
                    .map_err(|_| Broken::Word(word.chars().take(40).collect()))?;
                *rest = &after[length..];
                Ok(value)
            }
            Self::Binary { rest, little } => {
                let little = *little;
                Ok(match scalar {
                    Scalar::I8 => f64::from(i8::from_le_bytes(take(rest, little)?)),
                    Scalar::U8 => f64::from(u8::from_le_bytes(take(rest, little)?)),
                    Scalar::I16 => f64::from(i16::from_le_bytes(take(rest, little)?)),
                    Scalar::U16 => f64::from(u16::from_le_bytes(take(rest, little)?)),
                    Scalar::I32 => f64::from(i32::from_le_bytes(take(rest, little)?)),
                    Scalar::U32 => f64::from(u32::from_le_bytes(take(rest, little)?)),
                    Scalar::F32 => f64::from(f32::from_le_bytes(take(rest, little)?)),
                    Scalar::F64 => f64::from_le_bytes(take(rest, little)?),
                })
            }
        }
    }

    /// A text element ends with its line; nothing may be left on it.
    fn end_element(&mut self) -> Result<(), Broken> {
        if let Self::Text { rest, line } = self {
            let length = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
            if !rest[..length].iter().all(u8::is_ascii_whitespace) {
                return Err(Broken::LeftInLine);
            }
            *rest = rest.get(length + 1..).unwrap_or_default();
            *line += 1;
        }
        Ok(())
    }
}

/// The next `N` bytes, least significant first.
fn take<const N: usize>(rest: &mut &[u8], little: bool) -> Result<[u8; N], Broken> {
    let (bytes, after) = rest.split_first_chunk::<N>().ok_or(Broken::End)?;
    *rest = after;
    let mut bytes = *bytes;
    if !little {
        bytes.reverse();
    }
    Ok(bytes)
}

/// The mesh as binary little-endian PLY, vertices in double precision.
pub fn write_ply(mesh: &RawMesh) -> Vec<u8> {
    let mut header = String::from("ply\nformat binary_little_endian 1.0\n");
    let _ = writeln!(header, "element vertex {}", mesh.vertices.len()); // writing to a String cannot fail
    header.push_str("property double x\nproperty double y\nproperty double z\n");
    let _ = writeln!(header, "element face {}", mesh.triangles.len());
    header.push_str("property list uchar uint vertex_indices\nend_header\n");
    let mut bytes = header.into_bytes();
    for vertex in &mesh.vertices {
        vertex.iter().for_each(|c| bytes.extend(c.to_le_bytes()));
    }
    for triangle in &mesh.triangles {
        bytes.push(3);
        triangle.iter().for_each(|i| bytes.extend(i.to_le_bytes()));
    }
    bytes
}

#[cfg(test)]
#[path = "ply_tests.rs"]
mod tests;
