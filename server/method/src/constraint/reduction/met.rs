//! The plane that a motion would meet last, where a corner faces an edge or another corner.
//!
//! | symbol | name in code | unit   | meaning                                                     |
//! |--------|--------------|--------|-------------------------------------------------------------|
//! | n      | `normal`     | –      | unit, obstacle to body, in the normal cones of both features |
//! | a      | `motion`     | m, rad | of G                                                        |
//!
//! Such a pair has no normal of its own. Every plane through its points whose normal is in both cones parts the bodies there, and a body is free as long as
//! it is outside one of these planes. That of the nearest points, across their difference, lies in the way of corners that pass each other. A straight motion
//! gets inside where it crosses the last of the planes, and that is one at an end of what the cones have in common, as a plane between two others is
//! crossed before one of them is: it is a face's, or lies along an edge of either.

use nalgebra::Vector3;

use super::at::{At, Surfaces};
use super::row::jacobian;
use crate::constraint::cones::{LOOK_AHEAD_TILT, is_in_edge_cone, is_in_vertex_cone};
use crate::constraint::reentrant::for_faces;
use crate::constraint::{Contact, Feature, FeaturePair};
use crate::geometry::Mesh;
use crate::spatial::Vector6;

/// Whether the features have no normal but the direction of the difference of their points.
pub(super) fn are_corners(features: &FeaturePair) -> bool {
    matches!(
        (features.on_body, features.on_obstacle),
        (Feature::Vertex(_), Feature::Vertex(_) | Feature::Edge(_))
            | (Feature::Edge(_), Feature::Vertex(_))
    )
}

/// How far a pair is apart at the end of a motion, to first order, m.
pub(super) fn clearance(
    (at, surfaces): (&At, &dyn Surfaces),
    contact: &Contact,
    motion: &Vector6,
) -> f64 {
    contact.gap - surfaces.nearer(contact) + jacobian(contact, &at.center()).dot(motion)
}

/// A contact of corners with the plane that `motion` crosses last, where that is after its own; `None` where there is none.
pub(super) fn met(
    (at, surfaces): (&At, &dyn Surfaces),
    contact: &Contact,
    motion: &Vector6,
) -> Option<Contact> {
    let FeaturePair {
        obstacle,
        on_body,
        on_obstacle,
    } = contact.features;
    let (mesh, pose) = at.obstacle(usize::from(obstacle));
    let body = &at.world.body.mesh;
    // When the plane is crossed, as a share of the motion, and how far off it then is: what it never crosses is the better for it.
    let crossed = |plane: &Contact| {
        let arrived = clearance((at, surfaces), plane, motion);
        let closing = plane.gap - arrived;
        let time = if closing > 0.0 {
            (plane.gap - at.rest_distance).max(0.0) / closing
        } else {
            f64::INFINITY
        };
        (time, arrived)
    };
    let mut latest = crossed(contact);
    let mut last = None;
    let difference = contact.point_on_body - contact.point_on_obstacle;
    // The row acts at the obstacle's point moved by `offset` within the plane: there a turn of the body changes the gap as it does that of this plane. An
    // obstacle's face stays, so the row acts below the body's point; a face of the body turns with it, so the row acts at the obstacle's point.
    let mut consider = |normal: Vector3<f64>, offset: Vector3<f64>| {
        let gap = normal.dot(&difference);
        let parts = gap >= 0.0 // false for NaN
            && holds(body, on_body, &-(at.pose.rotation.inverse() * normal))
            && holds(mesh, on_obstacle, &(pose.rotation.inverse() * normal));
        if !parts {
            return;
        }
        let point_on_obstacle = contact.point_on_obstacle + offset - normal * normal.dot(&offset);
        let plane = Contact {
            point_on_obstacle,
            point_on_body: point_on_obstacle + normal * gap,
            normal,
            gap,
            ..*contact
        };
        let crossed = crossed(&plane);
        if crossed > latest {
            (latest, last) = (crossed, Some(plane));
        }
    };
    for_normals(mesh, on_obstacle, |normal| {
        consider(pose.rotation * normal, difference);
    });
    for_normals(body, on_body, |normal| {
        consider(-(at.pose.rotation * normal), Vector3::zeros());
    });
    for_sides(body, on_body, |of_body| {
        let of_body = at.pose.rotation * of_body;
        for_sides(mesh, on_obstacle, |of_obstacle| {
            let of_obstacle = pose.rotation * of_obstacle;
            let across = of_body.cross(&of_obstacle);
            // Where the line of one is nearest to that of the other.
            let along = difference.cross(&of_body).dot(&-across) / across.norm_squared();
            for normal in [across, -across] {
                consider(normal.normalize(), of_obstacle * along);
            }
        });
    });
    last
}

/// Normals of the faces at a feature, in the mesh's frame.
fn for_normals(mesh: &Mesh, feature: Feature, mut each: impl FnMut(&Vector3<f64>)) {
    let mut of_face = |face: u32| each(mesh.face_normal(face));
    match feature {
        Feature::Edge(e) => mesh.edges()[e as usize].faces.into_iter().for_each(of_face),
        Feature::Vertex(v) => {
            for_faces(mesh, v, |face, _| {
                of_face(face);
                None::<()>
            });
        }
        _ => {}
    }
}

/// The edge, or those at the vertex, in the mesh's frame.
fn for_sides(mesh: &Mesh, feature: Feature, mut each: impl FnMut(&Vector3<f64>)) {
    let apart = |from: u32, to: u32| mesh.vertices()[to as usize] - mesh.vertices()[from as usize];
    match feature {
        Feature::Edge(e) => {
            let [p, q] = mesh.edges()[e as usize].vertices;
            each(&apart(p, q));
        }
        Feature::Vertex(v) => {
            let neighbours = mesh.neighbours(v).iter();
            neighbours.for_each(|w| each(&apart(v, *w)));
        }
        _ => {}
    }
}

/// Whether a direction is in the normal cone of a feature, in the mesh's frame: to the tolerance that faces have.
fn holds(mesh: &Mesh, feature: Feature, direction: &Vector3<f64>) -> bool {
    match feature {
        // The normals of an edge are across it: a plane aslant along it has the edge on both sides.
        Feature::Edge(e) => {
            let [p, q] = mesh.edges()[e as usize]
                .vertices
                .map(|v| mesh.vertices()[v as usize]);
            let along = q - p;
            direction.dot(&along).abs() <= LOOK_AHEAD_TILT * along.norm()
                && is_in_edge_cone(mesh, e, direction, LOOK_AHEAD_TILT)
        }
        Feature::Vertex(v) => is_in_vertex_cone(mesh, v, direction, LOOK_AHEAD_TILT),
        _ => false,
    }
}
