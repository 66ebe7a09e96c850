//! Closest points of points, segments and triangles, with the features on which they lie.

mod edge_edge;
mod point_triangle;
mod triangle_intersection;
mod triangle_triangle;

pub use edge_edge::{ClosestOnEdges, closest_on_edges};
pub use point_triangle::{ClosestOnTriangle, barycentric, closest_on_triangle};
pub use triangle_intersection::triangles_intersect;
pub use triangle_triangle::{ClosestOnTriangles, closest_on_triangles};

/// A feature of one triangle, by its corner or side (side `k` runs from corner `k` to corner `k + 1`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriangleFeature {
    /// A corner, 0 to 2.
    Corner(u8),
    /// A side, 0 to 2.
    Side(u8),
    /// The inside.
    Face,
}
