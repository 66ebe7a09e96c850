//! Vertex normals with creases: round where the mesh is a polygonised curve, sharp at real edges.
//!
//! At each corner of each triangle the normals of those neighbours are averaged whose faces turn
//! away from the triangle's own by less than [`CREASE_DEGREES`], each weighted by its angle at the
//! vertex (so that the way a flat face was cut into triangles does not show).
//!
//! Source of the weighting: Thürmer and Wüthrich 1998, "Computing vertex normals from polygonal facets".

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::stage::TriangleMesh;

/// Faces that meet at a larger angle than this, in degrees, have a sharp edge between them.
/// A 72-gon's faces meet at 5 degrees, a 12-gon's at 30, those of a chamfer at 45.
pub const CREASE_DEGREES: f32 = 35.0;

/// Vertices with normals, and the triangles over them.
#[derive(Clone, Debug, PartialEq)]
pub struct Shaded {
    /// Position and unit normal.
    pub vertices: Vec<([f32; 3], [f32; 3])>,
    /// Three places in `vertices` per triangle.
    pub indices: Vec<u32>,
}

/// The mesh with a normal at every corner; vertices are doubled along creases only.
///
/// Triangles that name a vertex that is not there are left out.
pub fn shade(mesh: &TriangleMesh) -> Shaded {
    let welded = weld(mesh);
    let corner = |index: u32| Vector3::from(mesh.vertices[index as usize]);
    let known = |t: &&[u32; 3]| t.iter().all(|&i| (i as usize) < mesh.vertices.len());
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().filter(known).copied().collect();
    let faces: Vec<Vector3<f32>> = triangles
        .iter()
        .map(|&[a, b, c]| direction((corner(b) - corner(a)).cross(&(corner(c) - corner(a)))))
        .collect();

    // Which faces meet at a place, with their angles there.
    let mut around: Vec<Vec<(u32, f32)>> = vec![Vec::new(); mesh.vertices.len()];
    for (face, triangle) in triangles.iter().enumerate() {
        for k in 0..3 {
            let [here, next, last] = [0, 1, 2].map(|i| corner(triangle[(k + i) % 3]));
            let angle = (next - here).angle(&(last - here));
            let weight = if angle.is_finite() { angle } else { 0.0 };
            around[welded[triangle[k] as usize] as usize].push((face as u32, weight));
        }
    }

    let smooth = CREASE_DEGREES.to_radians().cos();
    let mut places: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    let mut shaded = Shaded {
        vertices: Vec::with_capacity(mesh.vertices.len()),
        indices: Vec::with_capacity(3 * triangles.len()),
    };
    for (triangle, own) in triangles.iter().zip(&faces) {
        for &vertex in triangle {
            let place = welded[vertex as usize];
            let sum = around[place as usize]
                .iter()
                .filter(|(face, _)| faces[*face as usize].dot(own) >= smooth)
                .map(|(face, weight)| faces[*face as usize] * *weight)
                .sum::<Vector3<f32>>();
            let normal: [f32; 3] = if sum.norm_squared() > 0.0 {
                direction(sum)
            } else {
                *own
            }
            .into();
            let key = (place, normal.map(f32::to_bits));
            let index = *places.entry(key).or_insert_with(|| {
                shaded
                    .vertices
                    .push((mesh.vertices[place as usize], normal));
                (shaded.vertices.len() - 1) as u32
            });
            shaded.indices.push(index);
        }
    }
    shaded
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
        for (position, normal) in &shaded.vertices {
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
        for (_, normal) in &shaded.vertices {
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
        };
        for (position, normal) in &shade(&loose).vertices {
            assert!(Vector3::from(*position).dot(&Vector3::from(*normal)) > 0.99);
        }
    }

    #[test]
    fn a_triangle_that_names_a_missing_vertex_is_left_out() {
        let mesh = TriangleMesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 1, 9]],
        };
        assert_eq!(shade(&mesh).indices.len(), 3);
    }
}
