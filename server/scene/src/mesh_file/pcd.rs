//! Points in PCD files, as the Point Cloud Library writes them.
//!
//! Source: Point Cloud Library, *The PCD (Point Cloud Data) file format*, version 0.7.

use super::{Fault, RawMesh};

/// Most fields of a PCD point.
const MAX_FIELDS: usize = 256;

/// Points of a PCD file, text or binary; those without a return, which it writes as NaN, are left out and counted.
pub(super) fn parse(bytes: &[u8]) -> Result<(RawMesh, usize), Fault> {
    let head = PcdHead::of(bytes)?;
    let mut found = (RawMesh::default(), 0);
    let mut add = |coordinates: [f64; 3]| {
        if coordinates.iter().all(|c| c.is_finite()) {
            found.0.vertices.push(coordinates.into());
        } else {
            found.1 += 1;
        }
    };
    let cut_off = |there: usize| {
        let text = format!(
            "is cut off: {} points are promised, {there} are there; copy the file again",
            head.points
        );
        Err(Fault::new(text))
    };
    if head.is_text {
        let text = String::from_utf8_lossy(&bytes[head.length..]);
        let mut count = 0;
        for (number, line) in (head.lines + 1..).zip(text.lines()) {
            let words: Vec<&str> = line.split_whitespace().collect();
            if words.is_empty() {
                continue;
            }
            let at = |field: &PcdField| {
                let word = words.get(field.column).copied().unwrap_or_default();
                word.parse::<f64>().map_err(|_| {
                    let text = "has no number for x, y or z; repair the line";
                    Fault::at(number, text)
                })
            };
            let [x, y, z] = &head.axes;
            add([at(x)?, at(y)?, at(z)?]);
            count += 1;
        }
        return if count == head.points {
            Ok(found)
        } else {
            cut_off(count)
        };
    }
    let body = &bytes[head.length..];
    let there = body.len() / head.stride;
    if there < head.points {
        return cut_off(there);
    }
    for point in body.chunks_exact(head.stride).take(head.points) {
        add(head.axes.each_ref().map(|field| field.of(point)));
    }
    Ok(found)
}

/// One of x, y and z.
#[derive(Clone, Copy, Debug)]
struct PcdField {
    /// Of a text.
    column: usize,
    /// Of a binary point.
    offset: usize,
    is_double: bool,
}

impl PcdField {
    fn of(&self, point: &[u8]) -> f64 {
        let rest = point.get(self.offset..).unwrap_or_default();
        if self.is_double {
            rest.first_chunk()
                .map_or(f64::NAN, |b| f64::from_le_bytes(*b))
        } else {
            let single = rest.first_chunk().map(|b| f32::from_le_bytes(*b));
            single.map_or(f64::NAN, f64::from)
        }
    }
}

struct PcdHead {
    axes: [PcdField; 3],
    points: usize,
    /// Bytes of a binary point.
    stride: usize,
    is_text: bool,
    /// Of the head, bytes and lines.
    length: usize,
    lines: usize,
}

impl PcdHead {
    fn of(bytes: &[u8]) -> Result<Self, Fault> {
        let mut lists: [Vec<String>; 4] = Default::default();
        let (mut points, mut length) = (None, 0);
        for (number, line) in (1..).zip(bytes.split_inclusive(|b| *b == b'\n')) {
            length += line.len();
            let line = String::from_utf8_lossy(line);
            let mut words = line.split_whitespace();
            let key = words.next().unwrap_or_default();
            let fail = |text: &str| Err(Fault::at(number, text));
            match key {
                "FIELDS" | "SIZE" | "TYPE" | "COUNT" => {
                    let keys = ["FIELDS", "SIZE", "TYPE", "COUNT"];
                    for (list, _) in lists.iter_mut().zip(keys).filter(|(_, name)| *name == key) {
                        *list = words
                            .by_ref()
                            .take(MAX_FIELDS + 1)
                            .map(str::to_owned)
                            .collect();
                    }
                }
                "POINTS" => points = words.next().and_then(|word| word.parse().ok()),
                "DATA" => {
                    let is_text = match words.next() {
                        Some("ascii") => true,
                        Some("binary") => false,
                        Some("binary_compressed") => {
                            return fail(
                                "holds compressed points, which are not read; save it as binary or ascii (pcl_convert_pcd_ascii_binary FILE OUT 1)",
                            );
                        }
                        _ => return fail("has an unknown DATA; save it as binary or ascii"),
                    };
                    let Some(points) = points else {
                        return fail("the head names no POINTS; save the file again");
                    };
                    let Some((axes, stride)) = fields(&lists) else {
                        return fail(
                            "the head has no x, y and z of type F and size 4 or 8, or its lists differ in length; save the file again",
                        );
                    };
                    return Ok(Self {
                        axes,
                        points,
                        stride,
                        is_text,
                        length,
                        lines: number,
                    });
                }
                "" | "VERSION" | "WIDTH" | "HEIGHT" | "VIEWPOINT" => {}
                _ if key.starts_with('#') => {}
                _ => return fail("is no line of a PCD head; is it a PCD file?"),
            }
        }
        Err(Fault::new(
            "is no PCD file: its head has no DATA; save it again",
        ))
    }
}

/// Where x, y and z are, and how long a point is, bytes.
fn fields([names, sizes, types, counts]: &[Vec<String>; 4]) -> Option<([PcdField; 3], usize)> {
    let count = names.len();
    let is_whole = sizes.len() == count && types.len() == count;
    if count > MAX_FIELDS || !is_whole || !(counts.is_empty() || counts.len() == count) {
        return None;
    }
    let (mut column, mut offset) = (0, 0);
    let mut axes = [None; 3];
    for k in 0..count {
        let size: usize = sizes[k]
            .parse()
            .ok()
            .filter(|size| [1, 2, 4, 8].contains(size))?;
        let times: usize = counts.get(k).map_or(Some(1), |times| times.parse().ok())?;
        if times > MAX_FIELDS {
            return None;
        }
        for (axis, name) in axes.iter_mut().zip(["x", "y", "z"]) {
            if names[k] == name && types[k] == "F" && times == 1 && size >= 4 {
                *axis = Some(PcdField {
                    column,
                    offset,
                    is_double: size == 8,
                });
            }
        }
        column += times;
        offset += size * times;
    }
    let [x, y, z] = axes;
    Some(([x?, y?, z?], offset))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pcd(fields: &str, sizes: &str, points: usize, data: &str) -> Vec<u8> {
        let types = "F ".repeat(sizes.split_whitespace().count());
        format!("# .PCD v0.7\nVERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {data}\n").into_bytes()
    }

    #[test]
    fn pcd_is_read_as_text_and_binary_without_what_has_no_return() {
        let text = [
            &pcd("z x rgb y", "4 8 4 4", 3, "ascii"),
            &b"3 1 0 2\nnan 0 0 0\n6 4 0 5\n"[..],
        ]
        .concat();
        let mut binary = pcd("z x rgb y", "4 8 4 4", 3, "binary");
        for [x, y, z] in [[1.0_f32, 2.0, 3.0], [0.0, f32::NAN, 0.0], [4.0, 5.0, 6.0]] {
            binary.extend(z.to_le_bytes());
            binary.extend(f64::from(x).to_le_bytes());
            binary.extend([0; 4]);
            binary.extend(y.to_le_bytes());
        }
        for bytes in [&text, &binary] {
            let (mesh, left_out) = parse(bytes).unwrap();
            let points: Vec<[f64; 3]> = mesh.vertices.iter().map(|p| (*p).into()).collect();
            assert_eq!(
                (points, left_out),
                (vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], 1)
            );
        }
        binary.pop();
        for (bytes, fault) in [
            (binary, "3 points are promised, 2 are there"),
            (
                pcd("x y z", "4 4 4", 1, "ascii"),
                "1 points are promised, 0 are there",
            ),
            (pcd("x y z", "4 4 4", usize::MAX, "binary"), "is cut off"),
            (
                pcd("x y z", "4 4 4", 1, "binary_compressed"),
                "holds compressed points",
            ),
            (pcd("x y", "4 4", 1, "ascii"), "has no x, y and z"),
            (pcd("x y z", "4 4", 1, "ascii"), "has no x, y and z"),
            (b"ply\n".to_vec(), "is no line of a PCD head"),
            (b"VERSION 0.7\n".to_vec(), "has no DATA"),
        ] {
            let said = parse(&bytes).unwrap_err().text;
            assert!(said.contains(fault), "{said}");
        }
    }

    proptest! {
        #[test]
        fn a_damaged_file_is_read_or_refused(place in 0_usize..400, value: u8, cut in 0_usize..400) {
            let mut bytes = [&pcd("x y z", "4 4 4", 2, "binary"), &[7; 24][..]].concat();
            let place = place % bytes.len();
            bytes[place] = value;
            bytes.truncate(bytes.len().saturating_sub(cut % 30));
            if let Ok((mesh, _)) = parse(&bytes) {
                prop_assert!(mesh.vertices.iter().all(|v| v.iter().all(|c| c.is_finite())));
            }
        }
    }
}
