//! Vertex normals for shading, per triangle corner, with real edges kept.
//!
//! Source: Ortega et al. 2007, Section 6.1 (after Phong); angle weights: Thürmer and Wüthrich 1998.

use nalgebra::Vector3;

use super::mesh::Mesh;

/// For each triangle and corner the unit normal of the vertex there, averaged by corner angle over the faces around
/// the vertex that are connected to this one across edges bent by at most `crease_angle` (rad).
pub fn corner_normals(mesh: &Mesh, crease_angle: f64) -> Vec<[Vector3<f64>; 3]> {
    let mut normals = vec![[None; 3]; mesh.triangles().len()];
    let mut fan = Vec::new();
    for t in 0..mesh.triangles().len() as u32 {
        for corner in 0..3 {
            if normals[t as usize][corner].is_some() {
                continue;
            }
            collect_fan(mesh, t, corner, crease_angle, &mut fan);
            let sum = fan.iter().fold(Vector3::zeros(), |sum, &(t, k)| {
                sum + mesh.face_normal(t) * corner_angle(mesh, t, k)
            });
            for &(t, k) in &fan {
                let normal = sum
                    .try_normalize(f64::MIN_POSITIVE)
                    .unwrap_or(*mesh.face_normal(t));
                normals[t as usize][k] = Some(normal);
            }
        }
    }
    let filled = |(t, corners): (usize, &[Option<Vector3<f64>>; 3])| {
        corners.map(|n| n.unwrap_or(*mesh.face_normal(t as u32)))
    };
    normals.iter().enumerate().map(filled).collect()
}

/// The faces, with their corners there, reached from `triangle` around its `corner` without crossing a crease.
fn collect_fan(
    mesh: &Mesh,
    triangle: u32,
    corner: usize,
    crease_angle: f64,
    fan: &mut Vec<(u32, usize)>,
) {
    fan.clear();
    fan.push((triangle, corner));
    let vertex = mesh.triangles()[triangle as usize][corner];
    // Forwards over the side that leaves the corner, then backwards over the one that arrives.
    for direction in [0, 2] {
        let (mut t, mut k) = (triangle, corner);
        loop {
            let edge = &mesh.edges()[mesh.triangle_edges(t)[(k + direction) % 3] as usize];
            let smooth = edge.convexity.abs() <= crease_angle; // false for NaN
            let next = if edge.faces[0] == t {
                edge.faces[1]
            } else {
                edge.faces[0]
            };
            let next_corner = mesh.triangles()[next as usize]
                .iter()
                .position(|v| *v == vertex);
            let Some(next_corner) = next_corner.filter(|c| smooth && !fan.contains(&(next, *c)))
            else {
                break;
            };
            fan.push((next, next_corner));
            (t, k) = (next, next_corner);
        }
    }
}

fn corner_angle(mesh: &Mesh, t: u32, corner: usize) -> f64 {
    let p = mesh.corners(t);
    let (u, v) = (
        p[(corner + 1) % 3] - p[corner],
        p[(corner + 2) % 3] - p[corner],
    );
    u.cross(&v).norm().atan2(u.dot(&v))
}
