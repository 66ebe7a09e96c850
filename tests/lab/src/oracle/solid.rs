//! Shapes as the oracle sees them: a core of vertices, edges and faces, and a radius around it.
//!
//! A mesh is its own core, with radius 0; a sphere is a vertex, a capsule or a cylinder an edge, with their radius; a half-space is a
//! large face. Distances between cores, less the radii, are distances between the shapes.

use std::collections::HashMap;

use god_object::{Mesh, Pose, Primitive};
use nalgebra::{Point3, Vector3};

/// Half the side of the face that stands for a half-space, m.
const PLANE: f64 = 10.0;

/// A triangle, a segment or a point, with what of it others may touch.
#[derive(Clone, Debug, Default)]
pub(super) struct Cell {
    /// Corners.
    pub(super) points: Vec<u32>,
    /// Those of them that are features.
    pub(super) vertices: Vec<u32>,
    /// Its edges.
    pub(super) edges: Vec<u32>,
    /// Corners of its face, counter-clockwise seen from outside.
    pub(super) face: Option<[u32; 3]>,
    /// Of the solid around it, m.
    pub(super) radius: f64,
    /// The ends of the solid are flat: its vertices are inside, and what would touch there is not modelled.
    pub(super) flat_ends: bool,
}

/// An edge.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    /// Its vertices.
    pub(super) ends: [u32; 2],
    /// The vertices opposite to it in the triangles beside it.
    pub(super) opposite: Vec<u32>,
}

/// Any number of shapes in one frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Solid {
    pub(super) points: Vec<Point3<f64>>,
    pub(super) edges: Vec<Edge>,
    pub(super) cells: Vec<Cell>,
    /// The vertices that share an edge with each vertex.
    pub(super) adjacent: Vec<Vec<u32>>,
}

impl Solid {
    /// Adds a shape at a pose.
    pub(super) fn add(&mut self, mesh: &Mesh, primitive: Option<&Primitive>, pose: &Pose) {
        match primitive {
            None => self.add_mesh(mesh, pose),
            Some(Primitive::Sphere { center, radius }) => {
                let vertex = self.point(pose * center);
                self.cells.push(Cell {
                    points: vec![vertex],
                    vertices: vec![vertex],
                    radius: *radius,
                    ..Cell::default()
                });
            }
            Some(Primitive::Capsule { ends, radius }) => {
                self.add_segment(ends, *radius, pose, false)
            }
            Some(Primitive::Cylinder { ends, radius }) => {
                self.add_segment(ends, *radius, pose, true)
            }
            Some(Primitive::Plane { normal, point }) => {
                self.add_plane(&(pose.rotation * normal), &(pose * point));
            }
        }
    }

    /// Distance of the farthest point from the origin, m.
    pub(super) fn radius(&self) -> f64 {
        let of = |cell: &Cell| {
            let points = cell
                .points
                .iter()
                .map(|i| self.points[*i as usize].coords.norm());
            points.fold(0.0, f64::max) + cell.radius
        };
        self.cells.iter().map(of).fold(0.0, f64::max)
    }

    fn point(&mut self, point: Point3<f64>) -> u32 {
        self.points.push(point);
        self.adjacent.push(Vec::new());
        (self.points.len() - 1) as u32
    }

    fn add_mesh(&mut self, mesh: &Mesh, pose: &Pose) {
        let first = self.points.len() as u32;
        for vertex in mesh.vertices() {
            self.point(pose * vertex);
        }
        let mut known: HashMap<[u32; 2], u32> = HashMap::new();
        for triangle in mesh.triangles() {
            let corners = triangle.map(|i| i + first);
            let mut cell = Cell {
                points: corners.into(),
                vertices: corners.into(),
                face: Some(corners),
                ..Cell::default()
            };
            for k in 0..3 {
                let [from, to, opposite] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
                let ends = [from.min(to), from.max(to)];
                let edge = *known.entry(ends).or_insert_with(|| {
                    self.edges.push(Edge {
                        ends,
                        opposite: Vec::new(),
                    });
                    self.adjacent[from as usize].push(to);
                    self.adjacent[to as usize].push(from);
                    (self.edges.len() - 1) as u32
                });
                self.edges[edge as usize].opposite.push(opposite);
                cell.edges.push(edge);
            }
            self.cells.push(cell);
        }
    }

    fn add_segment(&mut self, ends: &[Point3<f64>; 2], radius: f64, pose: &Pose, flat_ends: bool) {
        let ends = ends.map(|end| self.point(pose * end));
        self.edges.push(Edge {
            ends,
            opposite: Vec::new(),
        });
        self.cells.push(Cell {
            points: ends.into(),
            vertices: ends.into(),
            edges: vec![(self.edges.len() - 1) as u32],
            face: None,
            radius,
            flat_ends,
        });
    }

    fn add_plane(&mut self, normal: &Vector3<f64>, point: &Point3<f64>) {
        let across = normal.cross(&Vector3::ith(normal.iamin(), 1.0));
        let (u, v) = (
            across / across.norm(),
            normal.cross(&across) / across.norm(),
        );
        // A triangle that holds a disc of the radius PLANE about the point, anticlockwise about the normal.
        let corners = [(-3.0, -1.0), (3.0, -1.0), (0.0, 3.0)]
            .map(|(x, y)| self.point(point + u * (x * PLANE) + v * (y * PLANE)));
        self.cells.push(Cell {
            points: corners.into(),
            face: Some(corners),
            ..Cell::default()
        });
    }
}

#[cfg(test)]
mod tests {
    use taut_method_tests::solids::mesh;
    use taut_scene::shapes::cuboid;

    use super::*;

    #[test]
    fn each_edge_of_a_mesh_has_two_triangles_and_euler_is_right() {
        let mut solid = Solid::default();
        solid.add(&mesh(cuboid([1.0, 2.0, 3.0])), None, &Pose::identity());
        assert!(solid.edges.iter().all(|edge| edge.opposite.len() == 2));
        let (v, e, f) = (solid.points.len(), solid.edges.len(), solid.cells.len());
        assert_eq!(v + f - e, 2);
        assert!((solid.radius() - 14.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn the_face_of_a_half_space_looks_out_of_it() {
        let mut solid = Solid::default();
        let normal = Vector3::new(0.48, -0.6, 0.64);
        let plane = Primitive::Plane {
            normal,
            point: Point3::new(0.1, 0.2, 0.3),
        };
        solid.add(&mesh(cuboid([1.0; 3])), Some(&plane), &Pose::identity());
        let [a, b, c] = solid.cells[0]
            .face
            .expect("a face")
            .map(|i| solid.points[i as usize]);
        let out = (b - a).cross(&(c - a));
        assert!((out / out.norm() - normal).norm() < 1e-12);
    }
}
