//! Why a mesh is refused: one sentence each, with the place and what to do.

use super::parts::InvertedPart;

/// What is wrong with a mesh.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// No triangles.
    #[error("the mesh has no triangles: give a closed surface of at least four")]
    Empty,
    /// More vertices, triangles or edges than 32-bit indices name.
    #[error(
        "the mesh has {count} vertices or triangles, more than the {limit} that indices can name: reduce it"
    )]
    TooLarge {
        /// What was given.
        count: usize,
        /// The most that is allowed.
        limit: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not a finite number: repair the file")]
    VertexNotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error(
        "triangle {triangle} names vertex {vertex}, but there are only {vertices} vertices: repair the file"
    )]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A triangle without area, to rounding.
    #[error("triangle {triangle} has no area: remove it or merge its vertices")]
    ZeroArea {
        /// Index of the triangle.
        triangle: usize,
    },
    /// An edge with one triangle only.
    #[error(
        "the surface is open at the edge between vertices {from} and {to} of triangle {triangle}: close the hole or merge duplicate vertices"
    )]
    Open {
        /// First vertex of the edge.
        from: u32,
        /// Second vertex of the edge.
        to: u32,
        /// The one triangle there.
        triangle: u32,
    },
    /// Two triangles run along an edge in the same direction.
    #[error(
        "triangles {first} and {second} disagree about outside along the edge between vertices {from} and {to}: flip one of them"
    )]
    Orientation {
        /// First vertex of the edge.
        from: u32,
        /// Second vertex of the edge.
        to: u32,
        /// One triangle.
        first: u32,
        /// The other triangle.
        second: u32,
    },
    /// More than two triangles at an edge.
    #[error(
        "{count} triangles share the edge between vertices {from} and {to}, but a closed surface has two there: split the surfaces apart"
    )]
    NonManifold {
        /// First vertex of the edge.
        from: u32,
        /// Second vertex of the edge.
        to: u32,
        /// How many triangles meet.
        count: usize,
    },
    /// The surface is inside out.
    #[error(
        "the surface is inside out (its volume is {volume} m^3): reverse the corner order of every triangle"
    )]
    InsideOut {
        /// Signed volume, m^3.
        volume: f64,
    },
    /// One closed part of the surface is inside out, and no cavity of another part.
    #[error(
        "the closed part with triangle {triangle}, of {triangles} triangles about ({x}, {y}, {z}) m, is inside out: reverse the corner order of its triangles",
        triangle = .0.triangle, triangles = .0.triangles, x = .0.center.x, y = .0.center.y, z = .0.center.z
    )]
    PartInsideOut(InvertedPart),
}
