//! Whether a body and an obstacle share a point at rest, where a primitive is on one side or on both.

use super::Primitive;
use super::bound::{Bound, for_triangles};
use super::closest;
use super::piece::Piece;
use crate::collision::{Placement, meshes_intersect, surfaces_intersect};
use crate::geometry::{MAX_DEPTH, Mesh};
use crate::spatial::Pose;
use crate::world::{Body, Obstacle};

/// Whether the body at `body_pose` and the obstacle at `obstacle_pose` share a point, surfaces or insides; what is not proved apart counts as
/// shared. For set-up: it allocates, and looks at every triangle.
pub fn shapes_intersect(
    body: &Body,
    body_pose: &Pose,
    obstacle: &Obstacle,
    obstacle_pose: &Pose,
) -> bool {
    // The meshes lie within their primitives: what is wholly inside the other is so with its mesh.
    primitives_intersect(body, body_pose, obstacle, obstacle_pose)
        || meshes_intersect(&body.mesh, body_pose, &obstacle.mesh, obstacle_pose)
}

/// As [`shapes_intersect`], but a mesh that is wholly inside another does not count: for a body that was outside before a step that is shorter than it is
/// thick, in the time that trees of boxes take. It allocates.
pub fn shape_surfaces_intersect(
    body: &Body,
    body_pose: &Pose,
    obstacle: &Obstacle,
    obstacle_pose: &Pose,
) -> bool {
    if body.primitive.is_some() || obstacle.primitive.is_some() {
        return primitives_intersect(body, body_pose, obstacle, obstacle_pose);
    }
    surfaces_intersect(&body.mesh, body_pose, &obstacle.mesh, obstacle_pose)
}

/// Whether a primitive of either is not proved apart from the other shape; false for two meshes.
fn primitives_intersect(
    body: &Body,
    body_pose: &Pose,
    obstacle: &Obstacle,
    obstacle_pose: &Pose,
) -> bool {
    let placement = Placement::of(body_pose, obstacle_pose);
    match (&body.primitive, &obstacle.primitive) {
        (None, None) => false,
        (Some(a), Some(b)) => !primitives_apart(a, b, &placement),
        (Some(a), None) => !mesh_apart(&obstacle.mesh, a, false, &placement),
        (None, Some(b)) => !mesh_apart(&body.mesh, b, true, &placement),
    }
}

fn primitives_apart(body: &Primitive, obstacle: &Primitive, placement: &Placement) -> bool {
    let Some(mover) = Piece::of(body).map(|p| p.placed(placement)) else {
        return false;
    };
    gap_to(&mover, obstacle) > 0.0 // false for NaN
}

/// Lower bound of the distance of a placed piece from a primitive, m; sharp to rounding where they are apart.
fn gap_to(piece: &Piece, primitive: &Primitive) -> f64 {
    match primitive {
        Primitive::Plane { normal, point } => -piece.support(&-normal) - normal.dot(&point.coords),
        bounded => Piece::of(bounded).map_or(f64::NEG_INFINITY, |still| gap(piece, &still)),
    }
}

/// The largest gap along the directions that may separate two pieces, m.
pub(super) fn gap(mover: &Piece, still: &Piece) -> f64 {
    let offset = mover.points[0] - still.points[0];
    let along = |n: nalgebra::Vector3<f64>| -mover.support(&-n) - still.support(&n);
    let mut best = along(closest::direction(mover, still));
    let faces = [still.face, mover.face.map(|n| -n)];
    let axes = [still.axis, mover.axis].map(|a| a * a.dot(&offset).signum());
    for n in faces.into_iter().flatten().chain(axes) {
        if n.norm_squared() > 0.5 {
            best = best.max(along(n)); // `max` prefers any number to NaN
        }
    }
    best
}

/// Whether every triangle of the mesh is apart from the primitive.
fn mesh_apart(mesh: &Mesh, primitive: &Primitive, mesh_moves: bool, placement: &Placement) -> bool {
    let bound = Bound::still(primitive, mesh_moves, placement, 0.0);
    let mut apart = true;
    for_triangles(
        mesh,
        &mut Vec::with_capacity(MAX_DEPTH + 2),
        |i| bound.may_meet(&mesh.tree().nodes()[i as usize]),
        |t| {
            let triangle = Piece::triangle(mesh.corners(t), mesh.face_normal(t));
            let triangle_apart = if mesh_moves {
                gap_to(&triangle.placed(placement), primitive) > 0.0
            } else {
                Piece::of(primitive)
                    .is_some_and(|mover| gap(&mover.placed(placement), &triangle) > 0.0)
            };
            apart &= triangle_apart;
            apart
        },
    );
    apart
}
