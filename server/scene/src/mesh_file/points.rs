//! Points without faces: lines of text as scanners write them (.xyz .asc .pts .csv .txt).

use nalgebra::Point3;

use super::read::{finite_vertex, without_mark};
use super::{Fault, RawMesh};

/// Points of a text: three numbers first on each line, or in the columns that a head line calls x, y and z. What else is on a line is skipped.
pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, Fault> {
    let text = String::from_utf8_lossy(without_mark(bytes));
    let mut columns = [0, 1, 2];
    let mut is_first = true;
    let mut mesh = RawMesh::default();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with(['#', '/', '%']) {
            continue;
        }
        let words: Vec<&str> = split(line).collect();
        if std::mem::take(&mut is_first) {
            if let Some(named) = head(&words) {
                columns = named;
                continue;
            }
            // The number of the points, which .pts files begin with.
            if words.len() == 1 && words[0].parse::<u64>().is_ok() {
                continue;
            }
        }
        let point = point(&words, columns, mesh.vertices.len());
        mesh.vertices
            .push(point.map_err(|text| Fault::at(number, text))?);
    }
    Ok(mesh)
}

/// Words between semicolons, commas or blanks. A file with semicolons may have commas in its numbers.
fn split(line: &str) -> impl Iterator<Item = &str> {
    let has = |mark: char| line.contains(mark);
    let mark = [';', ','].into_iter().find(|mark| has(*mark));
    let words = line.split(move |c: char| mark.map_or(c.is_whitespace(), |mark| c == mark));
    words
        .map(str::trim)
        .filter(move |word| mark.is_some() || !word.is_empty())
}

/// Where a head line has x, y and z; the first three columns, if it names others. `None` of a line that begins with a number.
fn head(words: &[&str]) -> Option<[usize; 3]> {
    if words.first()?.parse::<f64>().is_ok() {
        return None;
    }
    let of = |axis: &str| {
        let named = |word: &&str| {
            let word = word.trim_matches('"').to_ascii_lowercase();
            word.split(['[', '(', ' ']).next() == Some(axis)
        };
        words.iter().position(named)
    };
    let [x, y, z] = ["x", "y", "z"].map(of);
    Some(match (x, y, z) {
        (Some(x), Some(y), Some(z)) => [x, y, z],
        _ => [0, 1, 2],
    })
}

fn point(words: &[&str], columns: [usize; 3], number: usize) -> Result<Point3<f64>, String> {
    let mut coordinates = [0.0; 3];
    for (coordinate, column) in coordinates.iter_mut().zip(columns) {
        let word = words
            .get(column)
            .ok_or("has too few numbers for a point; write x, y and z")?;
        *coordinate = word.parse().map_err(|_| {
            let word: String = word.chars().take(40).collect();
            format!("`{word}` is no number; write the point's x, y and z with a point as the decimal sign")
        })?;
    }
    finite_vertex(number, coordinates)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(text: &str) -> Result<Vec<[f64; 3]>, String> {
        let mesh =
            parse(text.as_bytes()).map_err(|fault| format!("{:?} {}", fault.line, fault.text))?;
        Ok(mesh.vertices.iter().map(|p| (*p).into()).collect())
    }

    #[test]
    fn lines_of_every_kind_are_points() {
        let two = Ok(vec![[1.0, 2.0, 3.0], [-4.0, 0.5, 6e-3]]);
        for text in [
            "1 2 3\n-4 0.5 6e-3\n",
            "# scan\n\n1\t2 3 0 0 1\r\n  -4 .5 0.006 0 0 1",
            "2\n1 2 3 255\n-4 0.5 0.006 0\n",
            "x,y,z\n1,2,3\n-4,0.5,0.006\n",
            "1, 2, 3\n-4, 0.5, 0.006\n",
            "time;Z [m];\"Y\";X (m)\n0;3;2;1\n0;0.006;0.5;-4\n",
            "\u{feff}//X Y Z R G B\n1 2 3 4 5 6\n-4 0.5 0.006 7 8 9\n",
            "a b c\n1 2 3\n-4 0.5 0.006\n",
        ] {
            assert_eq!(read(text), two, "{text}");
        }
        for (text, fault) in [
            ("1 2\n", "Some(1) has too few numbers"),
            ("1 2 3\n4 5 six\n", "Some(2) `six` is no number"),
            ("1;2,5;3\n", "Some(1) `2,5` is no number"),
            ("1 2 3\n4 nan 6\n", "Some(2) vertex 1 has y = NaN"),
            ("1 2 3\nx y z\n", "Some(2) `x` is no number"),
        ] {
            let said = read(text).unwrap_err();
            assert!(said.starts_with(fault), "{said}");
        }
        assert_eq!(read(""), Ok(vec![]));
    }

    proptest! {
        #[test]
        fn damaged_lines_are_read_or_refused(tail in prop::collection::vec(any::<u8>(), 0..60)) {
            if let Ok(mesh) = parse(&[b"1 2 3\n", &tail[..]].concat()) {
                prop_assert!(mesh.vertices.iter().all(|v| v.iter().all(|c| c.is_finite())));
            }
        }
    }
}
