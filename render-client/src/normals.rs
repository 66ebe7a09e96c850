//! Vertex normals with creases: round where the mesh is a polygonised curve, sharp at real edges.
//!
//! At each corner of each triangle the normals of those neighbours are averaged whose faces turn
//! away from the triangle's own by less than [`CREASE_DEGREES`], each weighted by its angle at the
//! vertex (so that the way a flat face was cut into triangles does not show).
//!
//! Source of the weighting: Thürmer and Wüthrich 1998, "Computing vertex normals from polygonal facets".

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::Vector3;
use taut_proto::Look;

use crate::stage::TriangleMesh;
use crate::textures::MeshTextures;

/// Faces that meet at a larger angle than this, in degrees, have a sharp edge between them.
/// A 72-gon's faces meet at 5 degrees, a 12-gon's at 30, those of a chamfer at 45.
pub const CREASE_DEGREES: f32 = 35.0;

/// Vertices with normals, and the triangles over them.
#[derive(Clone, Debug, PartialEq)]
pub struct Shaded {
    /// Position, unit normal and look: a place in `looks`, or [`NO_LOOK`].
    pub vertices: Vec<([f32; 3], [f32; 3], u32)>,
    /// Three places in `vertices` per triangle.
    pub indices: Vec<u32>,
    /// How vertices look that do not look as the body does.
    pub looks: Vec<Look>,
    /// Place of each vertex in the texture of its look; none where no look has one.
    pub coordinates: Vec<[f32; 2]>,
    /// Textures of the looks.
    pub textures: Option<Arc<MeshTextures>>,
}

/// Of a vertex that looks as its body does.
pub const NO_LOOK: u32 = u32::MAX;

/// The mesh with a normal at every corner; vertices are doubled along creases, between looks and along the seams of textures only.
///
/// Triangles that name a vertex that is not there are left out.
pub fn shade(mesh: &TriangleMesh) -> Shaded {
    let welded = weld(mesh);
    let corner = |index: u32| Vector3::from(mesh.vertices[index as usize]);
    let known = |t: &[u32; 3]| t.iter().all(|&i| (i as usize) < mesh.vertices.len());
    let (numbers, triangles): (Vec<usize>, Vec<[u32; 3]>) = mesh
        .triangles
        .iter()
        .enumerate()
        .filter(|(_, triangle)| known(triangle))
        .unzip();
    let faces: Vec<Vector3<f32>> = triangles
        .iter()
        .map(|&[a, b, c]| direction((corner(b) - corner(a)).cross(&(corner(c) - corner(a)))))
        .collect();

    // Which faces meet at a place, with their angles there.
    let around = Around::new(&triangles, &welded, |[here, next, last]| {
        let angle = (corner(next) - corner(here)).angle(&(corner(last) - corner(here)));
        if angle.is_finite() { angle } else { 0.0 }
    });

    let smooth = CREASE_DEGREES.to_radians().cos();
    // The shaded vertices of a place as a list: the newest, and before each the one before it.
    let mut newest = vec![NONE; mesh.vertices.len()];
    let mut before: Vec<u32> = Vec::with_capacity(mesh.vertices.len());
    let looks = mesh.looks.iter().flat_map(|looks| looks.list.clone());
    let mut shaded = Shaded {
        vertices: Vec::with_capacity(mesh.vertices.len()),
        indices: Vec::with_capacity(3 * triangles.len()),
        looks: looks.collect(),
        coordinates: Vec::new(),
        textures: mesh.textures.clone(),
    };
    for ((number, triangle), own) in numbers.into_iter().zip(&triangles).zip(&faces) {
        let look = look_of(mesh, number);
        let corners = coordinates_of(mesh, number, look);
        for (corner, &vertex) in triangle.iter().enumerate() {
            let laid = corners.map(|corners| corners[corner]);
            let place = welded[vertex as usize];
            let normal: [f32; 3] = around.normal(place, &faces, own, smooth).into();
            let mut index = newest[place as usize];
            let differs = |index: u32| {
                let (_, other, of) = shaded.vertices[index as usize];
                let elsewhere = laid.is_some_and(|at| shaded.coordinates[index as usize] != at);
                other != normal || of != look || elsewhere
            };
            while index != NONE && differs(index) {
                index = before[index as usize];
            }
            if index == NONE {
                index = shaded.vertices.len() as u32;
                let vertex = (mesh.vertices[place as usize], normal, look);
                shaded.vertices.push(vertex);
                shaded.coordinates.extend(laid);
                before.push(std::mem::replace(&mut newest[place as usize], index));
            }
            shaded.indices.push(index);
        }
    }
    shaded
}

/// Of the triangle with this number, as in [`Shaded::vertices`].
fn look_of(mesh: &TriangleMesh, number: usize) -> u32 {
    let looks = mesh.looks.as_ref();
    let place = looks.and_then(|looks| looks.of_triangles.get(number));
    place.map_or(NO_LOOK, |place| u32::from(*place))
}

/// Of the triangle's corners, in the texture of its `look`; `None` where no look has one.
fn coordinates_of(mesh: &TriangleMesh, number: usize, look: u32) -> Option<[[f32; 2]; 3]> {
    let textures = mesh.textures.as_ref()?;
    let textured = textures.of_look(look).is_some();
    let corners = textures.coordinates.get(number).filter(|_| textured);
    Some(corners.copied().unwrap_or_default())
}

impl Shaded {
    /// Brings vertices and triangles into the order in which they are drawn fastest: what a graphics card has just computed it does not compute
    /// again. Files such as scans have them in no order.
    pub fn in_drawing_order(self) -> Self {
        let Self {
            mut vertices,
            indices,
            looks,
            mut coordinates,
            textures,
        } = self;
        let mut indices = meshopt::optimize_vertex_cache(&indices, vertices.len());
        if coordinates.is_empty() {
            let used = meshopt::optimize_vertex_fetch_in_place(&mut indices, &mut vertices);
            vertices.truncate(used);
        } else {
            let mut both: Vec<_> = vertices.into_iter().zip(coordinates).collect();
            let used = meshopt::optimize_vertex_fetch_in_place(&mut indices, &mut both);
            both.truncate(used);
            (vertices, coordinates) = both.into_iter().unzip();
        }
        Self {
            vertices,
            indices,
            looks,
            coordinates,
            textures,
        }
    }
}

/// The end of a list.
const NONE: u32 = u32::MAX;

/// The faces that meet at each place, with their weights, in one piece of memory.
struct Around {
    /// Where the faces of a place begin; one more at the end.
    starts: Vec<u32>,
    faces: Vec<(u32, f32)>,
}

impl Around {
    /// `weight` of a corner, which comes first, of a triangle.
    fn new(triangles: &[[u32; 3]], place: &[u32], weight: impl Fn([u32; 3]) -> f32) -> Self {
        let mut starts = vec![0; place.len() + 1];
        for vertex in triangles.iter().flatten() {
            starts[place[*vertex as usize] as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut free = starts.clone();
        let mut faces = vec![(0, 0.0); 3 * triangles.len()];
        for (face, triangle) in triangles.iter().enumerate() {
            for k in 0..3 {
                let corner = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                let slot = &mut free[place[corner[0] as usize] as usize];
                faces[*slot as usize] = (face as u32, weight(corner));
                *slot += 1;
            }
        }
        Self { starts, faces }
    }

    /// Of the faces at a place that turn away from `own` by no more than the angle whose cosine is `smooth`.
    fn normal(
        &self,
        place: u32,
        faces: &[Vector3<f32>],
        own: &Vector3<f32>,
        smooth: f32,
    ) -> Vector3<f32> {
        let place = place as usize;
        let here = &self.faces[self.starts[place] as usize..self.starts[place + 1] as usize];
        let sum = here
            .iter()
            .filter(|(face, _)| faces[*face as usize].dot(own) >= smooth)
            .map(|(face, weight)| faces[*face as usize] * *weight)
            .sum::<Vector3<f32>>();
        if sum.norm_squared() > 0.0 {
            direction(sum)
        } else {
            *own
        }
    }
}

/// For each vertex the first vertex at exactly the same place: files such as STL repeat them.
fn weld(mesh: &TriangleMesh) -> Vec<u32> {
    let mut first: HashMap<[u32; 3], u32> = HashMap::with_capacity(mesh.vertices.len());
    let place = |(index, vertex): (usize, &[f32; 3])| {
        let bits = vertex.map(|x| (x + 0.0).to_bits()); // -0 and 0 are one place
        *first.entry(bits).or_insert(index as u32)
    };
    mesh.vertices.iter().enumerate().map(place).collect()
}

/// The unit vector along `v`; zero for a zero vector (a degenerate face, which is not seen).
fn direction(v: Vector3<f32>) -> Vector3<f32> {
    v.try_normalize(0.0).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::renderer::shapes;

    #[test]
    fn a_cylinder_of_72_facets_is_round_around_and_sharp_at_its_ends() {
        let shaded = shade(&shapes::cylinder(0.01, 0.03, 72));
        let half_facet = (2.5f32).to_radians();
        for (position, normal, _) in &shaded.vertices {
            let on_side = normal[1].abs() < 0.5;
            if on_side {
                let radial = Vector3::new(position[0], 0.0, position[2]).normalize();
                assert!(radial.dot(&Vector3::from(*normal)) > half_facet.cos());
            } else {
                assert!((normal[1].abs() - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_box_has_three_normals_at_each_corner() {
        let shaded = shade(&shapes::cuboid([1.0, 2.0, 3.0]));
        assert_eq!(shaded.vertices.len(), 24);
        for (_, normal, _) in &shaded.vertices {
            assert_eq!(normal.iter().filter(|x| x.abs() == 1.0).count(), 1);
        }
    }

    #[test]
    fn repeated_vertices_are_smoothed_like_shared_ones() {
        let mesh = shapes::sphere(1.0, 16);
        let loose = TriangleMesh {
            vertices: mesh
                .triangles
                .iter()
                .flatten()
                .map(|&i| mesh.vertices[i as usize])
                .collect(),
            triangles: (0..mesh.triangles.len() as u32)
                .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
                .collect(),
            looks: None,
            textures: None,
        };
        for (position, normal, _) in &shade(&loose).vertices {
            assert!(Vector3::from(*position).dot(&Vector3::from(*normal)) > 0.99);
        }
    }

    /// Corners of all triangles, each triangle from its least corner on.
    fn corners(shaded: &Shaded) -> Vec<[[u32; 6]; 3]> {
        let corner = |i: &u32| {
            let ([a, b, c], [d, e, f], _) = shaded.vertices[*i as usize];
            [a, b, c, d, e, f].map(f32::to_bits)
        };
        let triangle = |t: &[u32]| {
            let [a, b, c] = [corner(&t[0]), corner(&t[1]), corner(&t[2])];
            [[a, b, c], [b, c, a], [c, a, b]].into_iter().min()
        };
        let mut all: Vec<_> = shaded.indices.chunks(3).filter_map(triangle).collect();
        all.sort_unstable();
        all
    }

    /// Vertices that are computed for a triangle by a card that keeps the last 16.
    fn computed(shaded: &Shaded) -> f64 {
        let mut kept = std::collections::VecDeque::new();
        let mut computed = 0;
        for vertex in &shaded.indices {
            if !kept.contains(vertex) {
                computed += 1;
                kept.push_back(*vertex);
                if kept.len() > 16 {
                    kept.pop_front();
                }
            }
        }
        3.0 * f64::from(computed) / shaded.indices.len() as f64
    }

    #[test]
    fn the_drawing_order_has_the_same_triangles_and_computes_few_vertices_again() {
        let mut mesh = shapes::sphere(1.0, 64);
        let count = mesh.triangles.len();
        mesh.triangles = (0..count)
            .map(|i| mesh.triangles[i * 1_009 % count]) // a prime: each once, none beside its neighbour
            .collect();
        let scattered = shade(&mesh);
        let ordered = scattered.clone().in_drawing_order();
        assert_eq!(corners(&scattered), corners(&ordered));
        let (before, after) = (computed(&scattered), computed(&ordered));
        assert!(before > 2.5 && after < 0.8, "{before} and {after}");
    }

    #[test]
    fn what_has_no_triangle_has_no_order() {
        for vertices in [vec![], vec![[0.0; 3]]] {
            let mesh = TriangleMesh {
                vertices,
                triangles: vec![],
                looks: None,
                textures: None,
            };
            assert_eq!(shade(&mesh).in_drawing_order(), shade(&mesh));
        }
    }

    #[test]
    fn a_triangle_that_names_a_missing_vertex_is_left_out() {
        let mesh = TriangleMesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 1, 9]],
            looks: None,
            textures: None,
        };
        assert_eq!(shade(&mesh).indices.len(), 3);
    }
}
