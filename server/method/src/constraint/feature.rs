//! Features of a mesh and pairs of them: the persistent names of contacts.

/// A vertex, an edge or a face of a mesh, by its index there, or a part of a primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Feature {
    /// Index into [`Mesh::vertices`](crate::Mesh::vertices).
    Vertex(u32),
    /// Index into [`Mesh::edges`](crate::Mesh::edges).
    Edge(u32),
    /// Index into [`Mesh::triangles`](crate::Mesh::triangles).
    Face(u32),
    /// The surface of a sphere or a half-space.
    Whole,
    /// The side of a capsule or a cylinder.
    Side,
    /// An end of a capsule or a cap of a cylinder: 0 or 1.
    Cap(u8),
    /// A rim of a cylinder, 0 or 1, and the place on it: 0 the lowest or nearest point, 1 and 2 the nearest to an edge, from 3 the points fixed to the
    /// body.
    Rim(u8, u8),
}

/// Two features that face each other. It names a contact through time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FeaturePair {
    /// Index of the obstacle in the world.
    pub obstacle: u16,
    /// Feature of the god-object's body.
    pub on_body: Feature,
    /// Feature of the obstacle.
    pub on_obstacle: Feature,
}
