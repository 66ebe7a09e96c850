//! Whether a direction lies in the normal cone of a feature, by the mesh around it.

use nalgebra::Vector3;

use crate::geometry::Mesh;

/// How far outside both normal cones the direction may lie, rad: bodies that rest flat on each other do so to about a
/// micrometre over their size. A ghost slope of 1e-4 is below anything felt.
pub(crate) const NORMAL_CONE_TOLERANCE: f64 = 1e-4;
/// The same, rad, for pairs whose row is true however the body is tilted: a corner over a face, which keeps the face's normal, or on a round
/// side, and edges and rims that cross, which cannot pass each other without meeting. Their rows are there before the body tilts onto them, so that it rests on both of two edges.
pub(crate) const LOOK_AHEAD_TILT: f64 = 0.02;

/// No edge at the vertex rises in `direction` by more than `tolerance`.
pub(crate) fn is_in_vertex_cone(
    mesh: &Mesh,
    v: u32,
    direction: &Vector3<f64>,
    tolerance: f64,
) -> bool {
    let apex = mesh.vertices()[v as usize];
    mesh.neighbours(v).iter().all(|w| {
        let edge = mesh.vertices()[*w as usize] - apex;
        let rise = direction.dot(&edge);
        rise <= 0.0 || rise * rise <= tolerance * tolerance * edge.norm_squared()
    })
}

/// Neither face at the edge rises in `direction`.
pub(crate) fn is_in_edge_cone(
    mesh: &Mesh,
    edge: u32,
    direction: &Vector3<f64>,
    tolerance: f64,
) -> bool {
    let edge = &mesh.edges()[edge as usize];
    let along =
        mesh.vertices()[edge.vertices[1] as usize] - mesh.vertices()[edge.vertices[0] as usize];
    let limit = tolerance * tolerance * along.norm_squared();
    // `normal x along` points into the left face; into the right one it is the other way.
    [(edge.faces[0], 1.0), (edge.faces[1], -1.0)]
        .iter()
        .all(|(face, sign)| {
            let rise = sign * direction.dot(&mesh.face_normal(*face).cross(&along));
            rise <= 0.0 || rise * rise <= limit
        })
}

/// Sum of the normals at an edge: a direction inside its normal cone.
#[inline]
pub(super) fn outward_of_edge(mesh: &Mesh, edge: u32) -> Vector3<f64> {
    let [left, right] = mesh.edges()[edge as usize].faces;
    mesh.face_normal(left) + mesh.face_normal(right)
}
