//! The mesh that a picture is drawn with: places of the output, and what each of them shows.

use std::borrow::Cow;

use bytemuck::{Pod, Zeroable};

/// Most nodes of a grid: one for each pixel of 2560 x 1600. Smooth surfaces need a hundredth of that.
pub(crate) const MAX_NODES: usize = 1 << 22;

/// Tangent of the angle off its axis that the picture of a surface reaches at most: 80 degrees. Beyond, a flat picture has no room.
pub const MAX_TANGENT: f64 = 5.671;

/// What the targets of a mesh are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Places of the picture of a flat screen: shares of its width and height, and 0.
    Picture,
    /// Points of a surface, m, workbench frame.
    Surface,
}

/// What the first number of the places of a mesh counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Across {
    /// Shares of the output's width, from its left edge.
    Width,
    /// Halves of the output's height, from its middle to the right: such a mesh is for outputs of one shape.
    HalfHeight,
}

/// One node. Its layout is that of a vertex.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct OutputNode {
    /// Where in the output, shares of its width (else see [`Across`]) and height from the lower left; may lie beyond its edges.
    pub place: [f32; 2],
    /// What it shows there: see [`Target`].
    pub target: [f32; 3],
    /// Share of the light, 0 to 1; below 0 nothing is drawn at this node.
    pub share: f32,
}

/// A grid of nodes, row by row from the lower left.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputMesh {
    /// What its nodes show.
    pub target: Target,
    /// What their places count across the output.
    pub across: Across,
    /// Nodes in a row, at least 2.
    pub columns: usize,
    /// Rows, at least 2.
    pub rows: usize,
    /// `columns` times `rows`.
    pub nodes: Vec<OutputNode>,
}

impl OutputMesh {
    /// The whole picture of a flat screen over the whole output.
    #[must_use]
    pub fn identity() -> Self {
        let node = |x: f32, y: f32| OutputNode {
            place: [x, y],
            target: [x, y, 0.0],
            share: 1.0,
        };
        Self {
            target: Target::Picture,
            across: Across::Width,
            columns: 2,
            rows: 2,
            nodes: vec![
                node(0.0, 0.0),
                node(1.0, 0.0),
                node(0.0, 1.0),
                node(1.0, 1.0),
            ],
        }
    }

    /// The grid whose nodes are the middles of `columns` x `rows` equal parts of the output, with a border carried on
    /// linearly to its edges. Nothing is drawn at a node whose target is NaN, nor at a border that would be carried on from one.
    pub(crate) fn of_parts(
        target: Target,
        columns: usize,
        rows: usize,
        at: impl Fn(usize, usize) -> [f32; 3],
    ) -> Self {
        // From the border: half a part beyond the last middle.
        let beyond = |edge: [f32; 3], inner: [f32; 3]| {
            std::array::from_fn(|i| edge[i] + 0.5 * (edge[i] - inner[i]))
        };
        let along_row = |column: usize, row: usize| match column {
            0 => beyond(at(0, row), at(1, row)),
            _ if column > columns => beyond(at(columns - 1, row), at(columns - 2, row)),
            _ => at(column - 1, row),
        };
        let value = |column: usize, row: usize| match row {
            0 => beyond(along_row(column, 0), along_row(column, 1)),
            _ if row > rows => beyond(along_row(column, rows - 1), along_row(column, rows - 2)),
            _ => along_row(column, row - 1),
        };
        let share_of = |index: usize, count: usize| match index {
            0 => 0.0,
            _ if index > count => 1.0,
            _ => ((index as f64 - 0.5) / count as f64) as f32,
        };
        let places =
            (0..rows + 2).flat_map(|row| (0..columns + 2).map(move |column| (column, row)));
        let node = |(column, row)| {
            let target = value(column, row);
            let is_drawn = !target.iter().any(|x| x.is_nan());
            OutputNode {
                place: [share_of(column, columns), share_of(row, rows)],
                target: if is_drawn { target } else { [0.0; 3] },
                share: if is_drawn { 1.0 } else { -1.0 },
            }
        };
        Self {
            target,
            across: Across::Width,
            columns: columns + 2,
            rows: rows + 2,
            nodes: places.map(node).collect(),
        }
    }

    /// The mesh with all places as shares of an output that is `aspect` times as wide as high.
    #[must_use]
    pub fn for_output(&self, aspect: f64) -> Cow<'_, Self> {
        match self.across {
            Across::Width => Cow::Borrowed(self),
            Across::HalfHeight => {
                let mut mesh = self.clone();
                mesh.across = Across::Width;
                for node in &mut mesh.nodes {
                    node.place[0] = (0.5 + 0.5 * f64::from(node.place[0]) / aspect) as f32;
                }
                Cow::Owned(mesh)
            }
        }
    }

    /// The node of a column and a row, both from 0 at the lower left.
    #[must_use]
    pub fn node(&self, column: usize, row: usize) -> &OutputNode {
        &self.nodes[row * self.columns + column]
    }

    /// Two triangles for each cell, counter-clockwise in columns and rows, without those at nodes that are not drawn.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let cells =
            (1..self.rows).flat_map(|row| (1..self.columns).map(move |column| (column, row)));
        let both = cells.flat_map(|(column, row)| {
            let place = |column: usize, row: usize| (row * self.columns + column) as u32;
            let [a, b] = [place(column - 1, row - 1), place(column, row - 1)];
            let [c, d] = [place(column - 1, row), place(column, row)];
            [[a, b, d], [a, d, c]]
        });
        both.filter(|corners| corners.iter().all(|&i| self.nodes[i as usize].share >= 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_that_is_linear_is_carried_on_to_the_edges_of_the_output() {
        let (columns, rows) = (4, 3);
        let at = |c: usize, r: usize| {
            [
                (c as f32 + 0.5) / columns as f32,
                (r as f32 + 0.5) / rows as f32,
                7.0,
            ]
        };
        let mesh = OutputMesh::of_parts(Target::Picture, columns, rows, at);
        assert_eq!((mesh.columns, mesh.rows, mesh.nodes.len()), (6, 5, 30));
        for node in &mesh.nodes {
            assert!((node.place[0] - node.target[0]).abs() < 1e-6, "{node:?}");
            assert!((node.place[1] - node.target[1]).abs() < 1e-6, "{node:?}");
        }
        assert_eq!(mesh.node(0, 0).place, [0.0, 0.0]);
        assert_eq!(mesh.node(5, 4).place, [1.0, 1.0]);
        assert_eq!(mesh.triangles().count(), 2 * 5 * 4);
    }

    #[test]
    fn nothing_is_drawn_at_a_node_below_zero() {
        let mut mesh = OutputMesh::identity();
        mesh.nodes[1].share = -1.0;
        assert_eq!(mesh.triangles().collect::<Vec<_>>(), [[0, 3, 2]]);
    }
}
