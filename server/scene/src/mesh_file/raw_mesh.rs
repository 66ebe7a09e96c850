//! Vertices and triangles as a file gives them, before anything is known about the surface they make.

use std::collections::HashMap;

use god_object::Mesh;
use nalgebra::Point3;

/// Vertices and triangles, not yet checked for being a closed surface.
///
/// Whoever holds one from this crate may rely on: all coordinates finite, all indices in range.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawMesh {
    /// Corners, m, in the mesh's own frame.
    pub vertices: Vec<Point3<f64>>,
    /// Three places in `vertices` each, anticlockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl From<&Mesh> for RawMesh {
    fn from(mesh: &Mesh) -> Self {
        Self {
            vertices: mesh.vertices().to_vec(),
            triangles: mesh.triangles().to_vec(),
        }
    }
}

impl RawMesh {
    /// The same mesh with every coordinate multiplied by `factor`, which must be positive.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        for vertex in &mut self.vertices {
            vertex.coords *= factor;
        }
        self
    }

    /// Smallest and largest corner of the box around the mesh; `None` if it has no vertex.
    pub fn bounds(&self) -> Option<(Point3<f64>, Point3<f64>)> {
        let first = *self.vertices.first()?;
        Some(
            self.vertices
                .iter()
                .fold((first, first), |(low, high), v| (low.inf(v), high.sup(v))),
        )
    }

    /// Appends a convex polygon as a fan of triangles around its first corner.
    pub(crate) fn push_polygon(&mut self, corners: &[u32]) {
        for pair in corners.windows(2).skip(1) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
        }
    }

    /// Without the vertices that no triangle names, the others in their order.
    #[must_use]
    pub(crate) fn without_unused(self) -> Self {
        let mut used = vec![false; self.vertices.len()];
        for v in self.triangles.iter().flatten() {
            used[*v as usize] = true;
        }
        let mut vertices = Vec::with_capacity(self.vertices.len());
        let mut new_place = vec![u32::MAX; self.vertices.len()];
        for (v, point) in self.vertices.iter().enumerate().filter(|(v, _)| used[*v]) {
            new_place[v] = vertices.len() as u32; // at most the old count, which was a u32
            vertices.push(*point);
        }
        let triangles = self.triangles.iter();
        Self {
            triangles: triangles
                .map(|t| t.map(|v| new_place[v as usize]))
                .collect(),
            vertices,
        }
    }

    /// Some of the triangles, in this order, and the vertices that they name.
    #[must_use]
    pub(crate) fn some(&self, triangles: &[u32]) -> Self {
        let mut places: HashMap<u32, u32> = HashMap::new();
        let mut some = Self::default();
        for t in triangles {
            let corners = self.triangles[*t as usize].map(|v| {
                *places.entry(v).or_insert_with(|| {
                    some.vertices.push(self.vertices[v as usize]);
                    some.vertices.len() as u32 - 1 // at most the old count, which was a u32
                })
            });
            some.triangles.push(corners);
        }
        some
    }

    /// Appends another mesh, with vertices of its own.
    pub(crate) fn append(&mut self, other: &Self) {
        let first = self.vertices.len() as u32; // the caller sees to it that all have a number
        self.vertices.extend(&other.vertices);
        let moved = other.triangles.iter().map(|t| t.map(|v| first + v));
        self.triangles.extend(moved);
    }

    /// Merges vertices whose coordinates are exactly equal (+0 and -0 are equal), in order of first appearance.
    ///
    /// No tolerance: formats without indices repeat a corner's digits exactly, and a tolerance would close holes that
    /// are there or tear fine features.
    #[must_use]
    pub(crate) fn welded(self) -> Self {
        let mut places: HashMap<[u64; 3], u32> = HashMap::with_capacity(self.vertices.len());
        let mut vertices = Vec::new();
        let mut new_place = Vec::with_capacity(self.vertices.len());
        for vertex in &self.vertices {
            let key = [vertex.x, vertex.y, vertex.z].map(|c| (c + 0.0).to_bits());
            let next = vertices.len() as u32; // at most the old count, which was a u32
            let place = *places.entry(key).or_insert(next);
            if place == next {
                vertices.push(*vertex);
            }
            new_place.push(place);
        }
        let triangles = self
            .triangles
            .iter()
            .map(|t| t.map(|i| new_place[i as usize]))
            .collect();
        Self {
            vertices,
            triangles,
        }
    }
}
