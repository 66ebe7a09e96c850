//! Meshes that fold: where a part of the output would show what another part shows, or nothing can be told.

use crate::mesh::{OutputMesh, Target};

/// Least area of a triangle, in shares of output or picture: below a hundredth of a pixel of 16,384 x 16,384.
const LEAST_AREA: f64 = 3e-11;
/// Least area of a triangle of a surface, m²: a tenth of a millimetre each way.
const LEAST_SURFACE: f64 = 5e-9;
/// Cosine of the sharpest bend between neighbours of a surface: 120 degrees. Walls meet at less; a fold turns by 180.
const SHARPEST: f64 = -0.5;

/// The first fault of a mesh: a node of it, and what is wrong there.
pub(crate) fn fold(mesh: &OutputMesh) -> Option<(usize, String)> {
    match mesh.target {
        Target::Picture => in_picture(mesh),
        Target::Surface => on_surface(mesh),
    }
}

/// All triangles turn the same way round, in the output and in the picture; a mesh that is mirrored does so, too.
fn in_picture(mesh: &OutputMesh) -> Option<(usize, String)> {
    let area = |[a, b, c]: [[f32; 2]; 3]| {
        let side = |p: [f32; 2]| [0, 1].map(|i| f64::from(p[i]) - f64::from(a[i]));
        let (u, v) = (side(b), side(c));
        0.5 * (u[0] * v[1] - u[1] * v[0])
    };
    let mut turns = [0.0; 2];
    for corners in mesh.triangles() {
        let nodes = corners.map(|i| mesh.nodes[i as usize]);
        let areas = [
            area(nodes.map(|node| node.place)),
            area(nodes.map(|node| [node.target[0], node.target[1]])),
        ];
        for (turn, (area, of)) in turns
            .iter_mut()
            .zip(areas.into_iter().zip(["output", "picture"]))
        {
            if area.abs() < LEAST_AREA {
                let text =
                    format!("a triangle of the mesh has no size in the {of}; spread its nodes");
                return Some((corners[0] as usize, text));
            }
            if *turn == 0.0 {
                *turn = area;
            } else if *turn * area < 0.0 {
                let text = format!("the mesh folds over in the {of}; order its nodes row by row");
                return Some((corners[0] as usize, text));
            }
        }
    }
    None
}

/// No cell of a surface turns back on the one beside it.
fn on_surface(mesh: &OutputMesh) -> Option<(usize, String)> {
    let point = |column: usize, row: usize| mesh.node(column, row).target.map(f64::from);
    let normal = |column: usize, row: usize| {
        let (low, high) = (point(column - 1, row - 1), point(column, row));
        let (right, left) = (point(column, row - 1), point(column - 1, row));
        cross(minus(high, low), minus(left, right))
    };
    for row in 1..mesh.rows {
        for column in 1..mesh.columns {
            let own = normal(column, row);
            let node = row * mesh.columns + column;
            let has_size = 0.5 * dot(own, own).sqrt() >= LEAST_SURFACE; // false for an overflow
            if !has_size {
                let text = "a part of the surface has no size; give each value a point of its own, in metres";
                return Some((node, text.to_owned()));
            }
            let before = [
                (column > 1).then(|| normal(column - 1, row)),
                (row > 1).then(|| normal(column, row - 1)),
            ];
            for other in before.into_iter().flatten() {
                let most = SHARPEST * (dot(own, own) * dot(other, other)).sqrt();
                if dot(own, other) < most {
                    let text = "the surface folds back on itself (by more than 120 degrees); measure again, or order its points row by row";
                    return Some((node, text.to_owned()));
                }
            }
        }
    }
    None
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::OutputNode;

    fn picture(change: impl Fn(&mut OutputNode)) -> OutputMesh {
        let at = |c: usize, r: usize| [(c as f32 + 0.5) / 4.0, (r as f32 + 0.5) / 4.0, 0.0];
        let mut mesh = OutputMesh::of_parts(Target::Picture, 4, 4, at);
        mesh.nodes.iter_mut().for_each(change);
        mesh
    }

    #[test]
    fn a_mirrored_mesh_is_none_that_folds() {
        assert_eq!(fold(&picture(|_| {})), None);
        assert_eq!(fold(&picture(|n| n.target[0] = 1.0 - n.target[0])), None);
        assert_eq!(fold(&picture(|n| n.place[1] = 1.0 - n.place[1])), None);
    }

    #[test]
    fn a_node_beyond_its_neighbour_folds_the_mesh() {
        let mut mesh = picture(|_| {});
        mesh.nodes[14].target[0] = 0.95;
        assert!(
            fold(&mesh)
                .expect("folds")
                .1
                .contains("folds over in the picture")
        );
        let mut mesh = picture(|_| {});
        mesh.nodes[14].place[0] = 0.95;
        assert!(
            fold(&mesh)
                .expect("folds")
                .1
                .contains("folds over in the output")
        );
        let flat = picture(|n| n.target[1] = 0.5);
        assert!(
            fold(&flat)
                .expect("flat")
                .1
                .contains("no size in the picture")
        );
    }

    #[test]
    fn walls_may_meet_and_a_surface_may_not_turn_back() {
        let bent = |degrees: f64| {
            let turn = degrees.to_radians();
            OutputMesh::of_parts(Target::Surface, 6, 3, |c, r| {
                let along = c as f64 - 3.0;
                let (x, y) = match along > 0.0 {
                    true => (along * turn.cos(), along * turn.sin()),
                    false => (along, 0.0),
                };
                [x as f32, y as f32, r as f32]
            })
        };
        assert_eq!(fold(&bent(0.0)), None);
        assert_eq!(fold(&bent(90.0)), None);
        assert!(fold(&bent(179.0)).expect("folds").1.contains("folds back"));
        let dot = OutputMesh::of_parts(Target::Surface, 3, 3, |_, _| [1.0, 2.0, 3.0]);
        assert!(fold(&dot).expect("a dot").1.contains("no size"));
    }
}
