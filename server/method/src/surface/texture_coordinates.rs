//! Texture coordinates of a mesh: an affine map from space to the picture for each triangle.
//!
//! | symbol  | name in code | unit | meaning                                                                    |
//! |---------|--------------|------|----------------------------------------------------------------------------|
//! | u, v    | `place`      | –    | 0 to 1 over the picture: u along its rows, v from its first row to its last |
//! | grad u  | `along[0]`   | 1/m  | gradient of u in the triangle's plane, obstacle frame                      |
//!
//! A point that has left its triangle since contacts were collected is mapped by that triangle's map: continuous as long as the
//! picture lies evenly there. At a seam the triangle that owns the feature decides. Source: Ortega et al. 2007, Section 6.2.

use nalgebra::{Point3, Vector3};

use crate::constraint::Feature;
use crate::geometry::Mesh;

/// u and v of a triangle's three corners.
pub type CornerCoordinates = [[f64; 2]; 3];

/// Why numbers are no texture coordinates of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TextureCoordinatesError {
    /// There are not three pairs for each triangle.
    #[error("there are texture coordinates for {given} triangles, but the mesh has {triangles}")]
    Count {
        /// Triangles with coordinates.
        given: usize,
        /// Triangles of the mesh.
        triangles: usize,
    },
    /// A coordinate is not a finite number.
    #[error("a texture coordinate of triangle {triangle} is not a finite number")]
    NotFinite {
        /// Its index.
        triangle: usize,
    },
}

/// The map of one triangle: `place = origin + along . p`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TriangleMap {
    origin: [f64; 2],
    /// Gradients of u and v, 1/m.
    pub(super) along: [Vector3<f64>; 2],
}

impl TriangleMap {
    fn new(corners: &[Point3<f64>; 3], coordinates: &CornerCoordinates) -> Self {
        let [first, second] = [corners[1] - corners[0], corners[2] - corners[0]];
        let across = first.cross(&second);
        let square = across.norm_squared();
        let gradient = |k: usize| {
            let [by_first, by_second] = [1, 2].map(|i| coordinates[i][k] - coordinates[0][k]);
            (second.cross(&across) * by_first + across.cross(&first) * by_second) / square
        };
        let along = [0, 1].map(gradient);
        let origin = [0, 1].map(|k| coordinates[0][k] - along[k].dot(&corners[0].coords));
        Self { origin, along }
    }

    /// u and v at a point, obstacle frame.
    pub(super) fn place(&self, point: &Point3<f64>) -> [f64; 2] {
        [0, 1].map(|k| self.origin[k] + self.along[k].dot(&point.coords))
    }
}

/// Texture coordinates of every triangle of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureCoordinates {
    maps: Vec<TriangleMap>,
    /// A triangle at each vertex and at each edge.
    of_vertex: Vec<u32>,
    of_edge: Vec<u32>,
}

impl TextureCoordinates {
    /// Coordinates of the corners of each triangle of `mesh`, in its order.
    ///
    /// # Errors
    /// The numbers do not fit the mesh, or are not finite.
    pub fn new(
        mesh: &Mesh,
        coordinates: &[CornerCoordinates],
    ) -> Result<Self, TextureCoordinatesError> {
        let triangles = mesh.triangles().len();
        if coordinates.len() != triangles {
            return Err(TextureCoordinatesError::Count {
                given: coordinates.len(),
                triangles,
            });
        }
        let broken = |of: &CornerCoordinates| of.iter().flatten().any(|x| !x.is_finite());
        if let Some(triangle) = coordinates.iter().position(broken) {
            return Err(TextureCoordinatesError::NotFinite { triangle });
        }
        let vertices = 0..mesh.vertices().len() as u32;
        Ok(Self {
            maps: (0_u32..)
                .zip(coordinates)
                .map(|(t, of)| TriangleMap::new(&mesh.corners(t), of))
                .collect(),
            of_vertex: vertices
                .map(|v| mesh.vertex_owner(v).unwrap_or(u32::MAX))
                .collect(),
            of_edge: mesh.edges().iter().map(|edge| edge.faces[0]).collect(),
        })
    }

    /// The map at a feature; `None` for one that the mesh does not have.
    pub(super) fn at(&self, feature: Feature) -> Option<&TriangleMap> {
        let triangle = match feature {
            Feature::Face(index) => index,
            Feature::Edge(index) => *self.of_edge.get(index as usize)?,
            Feature::Vertex(index) => *self.of_vertex.get(index as usize)?,
            Feature::Whole | Feature::Side | Feature::Cap(_) | Feature::Rim(..) => return None,
        };
        self.maps.get(triangle as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_map_meets_its_corners_and_does_not_change_along_the_normal(
            points in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)),
            coordinates in prop::array::uniform3(prop::array::uniform2(-2.0..2.0f64)),
        ) {
            let corners = points.map(Point3::from);
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            prop_assume!(normal.norm() > 1e-2);
            let map = TriangleMap::new(&corners, &coordinates);
            for (corner, expected) in corners.iter().zip(&coordinates) {
                for at in [*corner, corner + normal] {
                    let place = map.place(&at);
                    prop_assert!((0..2).all(|k| (place[k] - expected[k]).abs() < 1e-9));
                }
            }
        }
    }
}
