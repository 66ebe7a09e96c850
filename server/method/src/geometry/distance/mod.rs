//! Closest points of points, segments and triangles.

mod edge_edge;
mod point_triangle;
mod triangle_intersection;
mod triangle_triangle;

pub use point_triangle::{ClosestOnTriangle, barycentric, closest_on_triangle};
pub use triangle_intersection::triangles_intersect;
pub use triangle_triangle::{ClosestOnTriangles, closest_on_triangles};
