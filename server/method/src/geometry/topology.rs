//! Edges of a closed triangle mesh, who neighbours whom, and which features can touch at all.
//!
//! A feature can be a local minimum of the distance to another surface only if its normal cone is not empty: an edge must be
//! convex, a vertex must have three convex edges (its normals make a spherical polygon with one side for each).
//! Flat edges and the vertices inside a flat face or along a straight ridge are represented by the face, the ridge
//! and their corners, so that cutting a face into more triangles changes nothing that is felt.

use nalgebra::{Point3, Vector3};

use super::flat_regions::mark_flat;
use super::mesh_error::MeshError;

/// Faces that meet at a smaller angle may be one face, rad ([`mark_flat`]). Single-precision files tilt millimetre triangles by
/// 3e-6 rad at 0.1 m from the origin; nobody feels a bend of 1e-5.
pub(crate) const FLAT_EDGE_ANGLE: f64 = 1e-5;
/// Fewest convex edges at a vertex whose normal cone has an interior.
pub(crate) const CORNER_EDGES: u8 = 3;

/// An edge and the two faces that meet there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Its ends, in the direction in which `faces[0]` runs along it.
    pub vertices: [u32; 2],
    /// The face to its left, seen from outside, and the one to its right.
    pub faces: [u32; 2],
    /// Signed angle between the two face normals, rad, in [-pi, pi]: positive where the edge is convex.
    pub convexity: f64,
    /// Its faces are of one flat region: it is no edge of the shape.
    pub flat: bool,
}

impl Edge {
    /// Whether the edge stands out, so that it can touch.
    #[inline]
    pub fn is_convex(&self) -> bool {
        self.convexity > 0.0 && !self.flat
    }
}

/// Edges and adjacency of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct Topology {
    pub(crate) edges: Vec<Edge>,
    /// Edge `k` of a triangle runs from corner `k` to corner `k + 1`.
    pub(crate) triangle_edges: Vec<[u32; 3]>,
    /// Neighbours of vertex v: `neighbours[ring_start[v]..ring_start[v + 1]]`.
    pub(crate) ring_start: Vec<u32>,
    pub(crate) neighbours: Vec<u32>,
    /// Triangle that owns a vertex; `u32::MAX` for a vertex without triangles.
    pub(crate) vertex_owner: Vec<u32>,
    /// Bits 0-2: corners that this triangle owns and that can touch; bits 3-5: edges likewise.
    pub(crate) owned: Vec<u8>,
}

/// One directed side of a triangle.
#[derive(Clone, Copy)]
pub(super) struct Side {
    pub(super) low: u32,
    pub(super) high: u32,
    pub(super) triangle: u32,
    corner: u32,
    pub(super) forward: bool,
}

impl Topology {
    /// Vertices that share an edge with vertex `v`.
    #[inline]
    pub(crate) fn ring(&self, v: u32) -> &[u32] {
        let (from, to) = (self.ring_start[v as usize], self.ring_start[v as usize + 1]);
        &self.neighbours[from as usize..to as usize]
    }

    /// Pairs the triangles' sides into edges; says which edge is open, disputed or crowded.
    pub(crate) fn build(
        vertices: &[Point3<f64>],
        triangles: &[[u32; 3]],
        face_normals: &[Vector3<f64>],
    ) -> Result<Self, MeshError> {
        let sides = sorted_sides(triangles);
        let mut edges = Vec::with_capacity(sides.len() / 2);
        let mut triangle_edges = vec![[0; 3]; triangles.len()];
        for group in sides.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high)) {
            let (left, right) = pair_of(group)?;
            let index = edges.len() as u32;
            for side in [left, right] {
                triangle_edges[side.triangle as usize][side.corner as usize] = index;
            }
            let ends = [left.low, left.high];
            let along = vertices[ends[1] as usize] - vertices[ends[0] as usize];
            let faces = [left.triangle, right.triangle];
            let normals = faces.map(|f| face_normals[f as usize]);
            edges.push(Edge {
                vertices: ends,
                faces,
                convexity: signed_angle(&normals, &along),
                flat: false,
            });
        }
        mark_flat(
            &mut edges,
            vertices,
            triangles,
            face_normals,
            &triangle_edges,
        );
        let (ring_start, neighbours) = rings(vertices.len(), &edges);
        let (vertex_owner, owned) = owners(vertices.len(), triangles, &edges, &triangle_edges);
        Ok(Self {
            edges,
            triangle_edges,
            ring_start,
            neighbours,
            vertex_owner,
            owned,
        })
    }
}

/// The sides of all triangles, those of one edge next to each other.
pub(super) fn sorted_sides(triangles: &[[u32; 3]]) -> Vec<Side> {
    let mut sides = Vec::with_capacity(3 * triangles.len());
    for (triangle, corners) in triangles.iter().enumerate() {
        for corner in 0..3 {
            let (from, to) = (corners[corner], corners[(corner + 1) % 3]);
            sides.push(Side {
                low: from.min(to),
                high: from.max(to),
                triangle: triangle as u32,
                corner: corner as u32,
                forward: from < to,
            });
        }
    }
    sides.sort_unstable_by_key(|s| (s.low, s.high, s.triangle, s.corner));
    sides
}

/// The two sides of an edge, the one that runs from the lower to the higher vertex first.
fn pair_of(group: &[Side]) -> Result<(Side, Side), MeshError> {
    let (from, to) = (group[0].low, group[0].high);
    match *group {
        [only] => Err(MeshError::Open {
            from,
            to,
            triangle: only.triangle,
        }),
        [a, b] if a.forward && !b.forward => Ok((a, b)),
        [a, b] if b.forward && !a.forward => Ok((b, a)),
        [a, b] => Err(MeshError::Orientation {
            from,
            to,
            first: a.triangle,
            second: b.triangle,
        }),
        _ => Err(MeshError::NonManifold {
            from,
            to,
            count: group.len(),
        }),
    }
}

/// The angle from the first normal to the second about the edge's direction: positive where the edge is convex.
fn signed_angle(normals: &[Vector3<f64>; 2], along: &Vector3<f64>) -> f64 {
    let length = along.norm();
    let sine = normals[0].cross(&normals[1]).dot(along) / length;
    sine.atan2(normals[0].dot(&normals[1]))
}

fn rings(vertices: usize, edges: &[Edge]) -> (Vec<u32>, Vec<u32>) {
    let mut start = vec![0_u32; vertices + 1];
    for v in edges.iter().flat_map(|e| e.vertices) {
        start[v as usize + 1] += 1;
    }
    for v in 0..vertices {
        start[v + 1] += start[v];
    }
    let mut next = start.clone();
    let mut neighbours = vec![0; 2 * edges.len()];
    for edge in edges {
        let [a, b] = edge.vertices;
        for (v, other) in [(a, b), (b, a)] {
            neighbours[next[v as usize] as usize] = other;
            next[v as usize] += 1;
        }
    }
    (start, neighbours)
}

/// Gives each feature that can touch to one triangle, so that a pair of features is met once.
fn owners(
    vertices: usize,
    triangles: &[[u32; 3]],
    edges: &[Edge],
    triangle_edges: &[[u32; 3]],
) -> (Vec<u32>, Vec<u8>) {
    let mut convex_edges = vec![0_u8; vertices];
    for edge in edges.iter().filter(|e| e.is_convex()) {
        for v in edge.vertices {
            convex_edges[v as usize] = convex_edges[v as usize].saturating_add(1);
        }
    }
    let mut vertex_owner = vec![u32::MAX; vertices];
    let mut owned = vec![0_u8; triangles.len()];
    for (triangle, corners) in triangles.iter().enumerate() {
        for corner in 0..3 {
            let v = corners[corner] as usize;
            if vertex_owner[v] == u32::MAX {
                vertex_owner[v] = triangle as u32;
                if convex_edges[v] >= CORNER_EDGES {
                    owned[triangle] |= 1 << corner;
                }
            }
            let edge = &edges[triangle_edges[triangle][corner] as usize];
            if edge.faces[0] == triangle as u32 && edge.is_convex() {
                owned[triangle] |= 8 << corner;
            }
        }
    }
    (vertex_owner, owned)
}
