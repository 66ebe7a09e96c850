//! Vertex normals of meshes: smooth over gentle bends, sharp at creases.

use nalgebra::{Point3, Vector3};

/// Faces that meet at a smaller angle than this share a normal; radians (30 degrees).
const CREASE_ANGLE: f64 = std::f64::consts::FRAC_PI_6;

/// Two normals are one vertex when their cosine exceeds this: about 0.8 degrees, below what shading shows.
const SAME_NORMAL_COSINE: f64 = 0.9999;

/// A mesh whose vertices are split where normals differ.
pub(crate) struct ShadedMesh {
    pub(crate) vertices: Vec<[f32; 3]>,
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Computes normals; every index in `triangles` must be within `vertices`.
pub(crate) fn shaded(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> ShadedMesh {
    // Twice the area times the normal: large faces weigh more.
    let face_normals: Vec<Vector3<f64>> = triangles
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|i| Point3::from(vertices[i as usize].map(f64::from)));
            (b - a).cross(&(c - a))
        })
        .collect();
    let mut faces_at = vec![Vec::new(); vertices.len()];
    for (face, corners) in triangles.iter().enumerate() {
        for &vertex in corners {
            faces_at[vertex as usize].push(face);
        }
    }

    let mut mesh = ShadedMesh {
        vertices: Vec::with_capacity(vertices.len()),
        normals: Vec::with_capacity(vertices.len()),
        triangles: Vec::with_capacity(triangles.len()),
    };
    // The split copies of each vertex: normal and new index.
    let mut copies: Vec<Vec<(Vector3<f64>, u32)>> = vec![Vec::new(); vertices.len()];
    for (face, corners) in triangles.iter().enumerate() {
        mesh.triangles.push(corners.map(|vertex| {
            let vertex = vertex as usize;
            let normal = corner_normal(face, &faces_at[vertex], &face_normals);
            let known = copies[vertex]
                .iter()
                .find(|(other, _)| other.dot(&normal) > SAME_NORMAL_COSINE);
            if let Some((_, index)) = known {
                return *index;
            }
            let index = mesh.vertices.len() as u32;
            mesh.vertices.push(vertices[vertex]);
            mesh.normals.push(normal.map(|x| x as f32).into());
            copies[vertex].push((normal, index));
            index
        }));
    }
    mesh
}

/// The mean normal of the faces around a vertex that bend less than the crease angle from `face`.
fn corner_normal(face: usize, around: &[usize], face_normals: &[Vector3<f64>]) -> Vector3<f64> {
    let unit = |normal: &Vector3<f64>| normal.try_normalize(0.0);
    let Some(own) = unit(&face_normals[face]) else {
        return Vector3::z(); // A face without area is not seen; any unit vector does.
    };
    let sum: Vector3<f64> = around
        .iter()
        .filter(|&&other| {
            unit(&face_normals[other]).is_some_and(|normal| normal.dot(&own) > CREASE_ANGLE.cos())
        })
        .map(|&other| face_normals[other])
        .sum();
    unit(&sum).unwrap_or(own)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two unit right triangles that share an edge and bend by `angle` there.
    fn bent_sheet(angle: f64) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let (sin, cos) = angle.sin_cos();
        let vertices = vec![
            [0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [-1.0, 0.0, 0.0],
            [cos as f32, 0.0, sin as f32],
        ];
        (vertices, vec![[0, 1, 2], [1, 0, 3]])
    }

    #[test]
    fn a_gentle_bend_shares_its_vertices() {
        let (vertices, triangles) = bent_sheet(0.2);
        assert_eq!(shaded(&vertices, &triangles).vertices.len(), 4);
    }

    #[test]
    fn a_crease_splits_its_vertices_and_keeps_flat_normals() {
        let (vertices, triangles) = bent_sheet(1.5);
        let mesh = shaded(&vertices, &triangles);
        assert_eq!(mesh.vertices.len(), 6);
        let first = mesh.normals[mesh.triangles[0][0] as usize];
        assert_eq!(first.map(f32::abs), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn every_normal_is_a_unit_vector_even_beside_a_face_without_area() {
        let (vertices, mut triangles) = bent_sheet(0.5);
        triangles.push([0, 0, 1]);
        for normal in shaded(&vertices, &triangles).normals {
            let length = normal.map(|x| x * x).iter().sum::<f32>().sqrt();
            assert!((length - 1.0).abs() < 1e-6, "{normal:?}");
        }
    }
}
