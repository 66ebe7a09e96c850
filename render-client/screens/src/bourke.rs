//! Paul Bourke's mesh files: text, a node on each line.
//!
//! The first number is 2 (a rectangular mesh), then the numbers of columns and rows, then for each node `x y u v i`, row by row: x from
//! minus the aspect ratio of the output (left) to the aspect ratio, y from -1 (below) to 1; u to the right and v up from the lower left of the
//! picture, 0 to 1; i is the share of light, and a node below 0 is not drawn. That i is a share of light, not of the signal, is this program's
//! choice: the format does not say.
//!
//! Source: P. Bourke, "Warping mesh format", <http://paulbourke.net/dataformats/meshwarp/>.

use crate::fault::Unnamed;
use crate::mesh::{Across, OutputMesh, OutputNode, Target};

/// Largest file, bytes.
pub(crate) const MAX_BYTES: u64 = 1 << 26;
/// Most nodes.
pub const MAX_NODES: usize = 1 << 20;
/// What rounding of printed decimals may put a share beyond 0 and 1.
const ROUNDING: f64 = 1e-3;
/// How far beyond the output a node may lie, in sizes of the output.
const BEYOND: f64 = 1.0;

/// Reads a mesh; also says on which line each node is. `aspect`: width over height of the output, as far as it is known; what lies far beyond it is
/// refused.
pub(crate) fn parse(text: &str, aspect: f64) -> Result<(OutputMesh, Vec<usize>), Unnamed> {
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty());
    let (at, columns, rows) = head(&mut lines)?;
    let count = columns * rows;
    let (mut nodes, mut places) = (Vec::new(), Vec::new()); // grow with the file, not with what it claims
    for (at, line) in lines {
        if nodes.len() == count {
            return Err(Unnamed::at(
                at,
                format!(
                    "goes on after {columns} x {rows} nodes; correct the second line or remove this"
                ),
            ));
        }
        nodes.push(node(line, aspect).map_err(|text| Unnamed::at(at, text))?);
        places.push(at);
    }
    if nodes.len() < count {
        let last = places.last().copied().unwrap_or(at);
        let text = format!(
            "ends after {} of {columns} x {rows} nodes; save it again",
            nodes.len()
        );
        return Err(Unnamed::at(last, text));
    }
    let mesh = OutputMesh {
        target: Target::Picture,
        across: Across::HalfHeight,
        columns,
        rows,
        nodes,
    };
    Ok((mesh, places))
}

/// The second line's place, and the columns and rows that it promises.
fn head<'t>(
    lines: &mut impl Iterator<Item = (usize, &'t str)>,
) -> Result<(usize, usize, usize), Unnamed> {
    let (at, kind) = lines.next().ok_or_else(|| {
        Unnamed::new("is empty; a mesh begins with 2, and a line with its columns and rows")
    })?;
    match kind {
        "2" => {}
        "1" => {
            return Err(Unnamed::at(
                at,
                "is a polar mesh (1), which needs a fisheye picture; make a rectangular one (2)",
            ));
        }
        _ => {
            return Err(Unnamed::at(
                at,
                "does not begin with the number 2 of a rectangular mesh; save it in Paul Bourke's format",
            ));
        }
    }
    let (at, size) = lines.next().ok_or_else(|| {
        Unnamed::at(
            at,
            "ends before its numbers of columns and rows; save it again",
        )
    })?;
    let numbers: Vec<Option<usize>> = size.split_whitespace().map(|n| n.parse().ok()).collect();
    match numbers[..] {
        [Some(columns), Some(rows)]
            if columns >= 2 && rows >= 2 && columns.saturating_mul(rows) <= MAX_NODES =>
        {
            Ok((at, columns, rows))
        }
        _ => Err(Unnamed::at(
            at,
            format!(
                "must have the numbers of columns and rows, each 2 at least, {MAX_NODES} nodes in all"
            ),
        )),
    }
}

fn node(line: &str, aspect: f64) -> Result<OutputNode, String> {
    let numbers: Vec<Option<f64>> = line
        .split_whitespace()
        .map(|n| n.parse().ok().filter(|value: &f64| value.is_finite()))
        .collect();
    let [Some(x), Some(y), Some(u), Some(v), Some(share)] = numbers[..] else {
        return Err("must have five finite numbers: x y u v i".to_owned());
    };
    let up = 0.5 + 0.5 * y;
    let shares = [0.5 + 0.5 * x / aspect, up];
    if shares.iter().any(|p| !(-BEYOND..=1.0 + BEYOND).contains(p)) {
        return Err(format!(
            "has a node at ({x}, {y}), far beyond the output, which ends at ({aspect:.4}, 1); is its aspect ratio that of the window?"
        ));
    }
    let within = |value: f64| (-ROUNDING..=1.0 + ROUNDING).contains(&value);
    if share >= 0.0 && !(within(u) && within(v)) {
        return Err(format!(
            "has the texture coordinates ({u}, {v}), but they are 0 to 1; leave a node out with an intensity below 0"
        ));
    }
    if share > 1.0 + ROUNDING {
        return Err(format!(
            "has the intensity {share}, but no light is added: 1 at most"
        ));
    }
    Ok(OutputNode {
        place: [x, up].map(|p| p as f32),
        target: [u.clamp(0.0, 1.0) as f32, v.clamp(0.0, 1.0) as f32, 0.0],
        share: share.min(1.0) as f32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "2\n2 2\n-1.5 -1 0 0 1\n1.5 -1 1 0 1\n-1.5 1 0 1 0.5\n1.5 1 1 1 -1\n";

    #[test]
    fn a_mesh_over_the_whole_output_is_read() {
        let (mesh, lines) = parse(SQUARE, 1.5).expect("a mesh");
        assert_eq!(
            (mesh.columns, mesh.rows, &lines[..]),
            (2, 2, &[3, 4, 5, 6][..])
        );
        assert_eq!(mesh.for_output(1.5).node(1, 0).place, [1.0, 0.0]);
        assert_eq!(mesh.node(0, 1).target, [0.0, 1.0, 0.0]);
        assert_eq!((mesh.node(0, 1).share, mesh.node(1, 1).share), (0.5, -1.0));
    }

    #[test]
    fn a_mesh_keeps_its_shape_in_an_output_of_another_one() {
        let (mesh, _) = parse(SQUARE, 1.5).expect("a mesh");
        let wide = mesh.for_output(3.0);
        assert_eq!(
            [wide.node(0, 0).place, wide.node(1, 1).place],
            [[0.25, 0.0], [0.75, 1.0]]
        );
        assert_eq!(wide.for_output(1.0), wide, "it is in shares now");
    }

    #[test]
    fn each_fault_is_told_with_its_line() {
        for (wrong, line, says) in [
            ("", None, "is empty"),
            ("1\n2 2\n", Some(1), "polar"),
            ("PF\n", Some(1), "rectangular"),
            ("2\n", Some(1), "ends before"),
            ("2\n1000000000 1000000000\n", Some(2), "nodes in all"),
            ("2\n2 1\n", Some(2), "2 at least"),
            ("2\n2 2\n0 0 0 0 1\n", Some(3), "ends after 1 of 2 x 2"),
            ("2\n2 2\n0 0 nan 0 1\n", Some(3), "five finite numbers"),
            ("2\n2 2\n0 0 0 0\n", Some(3), "five finite numbers"),
            (
                "2\n2 2\n0 0 1.2 0 1\n",
                Some(3),
                "texture coordinates (1.2, 0)",
            ),
            ("2\n2 2\n9 0 1 0 1\n", Some(3), "far beyond"),
            ("2\n2 2\n0 0 1 0 1.5\n", Some(3), "no light is added"),
        ] {
            let fault = parse(wrong, 1.5).expect_err(wrong);
            assert_eq!(fault.line, line, "{wrong}");
            assert!(fault.text.contains(says), "{wrong}: {}", fault.text);
        }
        let long = format!("{SQUARE}0 0 0 0 1\n");
        assert_eq!(parse(&long, 1.5).expect_err("long").line, Some(7));
    }
}
