//! The sides of triangles, grouped by the edges on which they lie.

use god_object::geometry::connected;

/// One side of one triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    /// The edge: its vertices, ascending.
    pub(super) ends: [u32; 2],
    /// Whether the triangle runs along it from the lower vertex to the higher one.
    pub(super) forward: bool,
    pub(super) triangle: u32,
    /// The side runs from this corner to the next.
    pub(super) corner: u8,
}

impl Side {
    /// Its vertices in the order of the triangle.
    pub(super) fn directed(&self) -> [u32; 2] {
        let [low, high] = self.ends;
        if self.forward {
            [low, high]
        } else {
            [high, low]
        }
    }
}

/// All sides, those of an edge next to each other.
pub(super) fn sides(triangles: &[[u32; 3]]) -> Vec<Side> {
    let mut sides: Vec<Side> = triangles
        .iter()
        .zip(0..)
        .flat_map(|(t, triangle)| {
            (0..3_u8).map(move |corner| {
                let (from, to) = (t[usize::from(corner)], t[(usize::from(corner) + 1) % 3]);
                Side {
                    ends: [from.min(to), from.max(to)],
                    forward: from < to,
                    triangle,
                    corner,
                }
            })
        })
        .collect();
    sides.sort_unstable();
    sides
}

/// The sides of each edge.
pub(super) fn by_edge(sides: &[Side]) -> impl Iterator<Item = &[Side]> {
    sides.chunk_by(|a, b| a.ends == b.ends)
}

/// Sides that are alone at their edge.
pub(super) fn borders(triangles: &[[u32; 3]]) -> Vec<Side> {
    let sides = sides(triangles);
    by_edge(&sides)
        .filter(|group| group.len() == 1)
        .map(|group| group[0])
        .collect()
}

/// Pairs of triangles that share an edge, however many meet there.
pub(super) fn neighbours(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = sides(triangles);
    by_edge(&sides)
        .flat_map(|group| {
            group
                .windows(2)
                .map(|pair| [pair[0].triangle, pair[1].triangle])
        })
        .collect()
}

/// Sets of triangles that are connected through edges.
pub(super) fn components(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    connected(triangles.len(), neighbours(triangles).into_iter())
}
