//! The face that a motion would meet, where a corner faces an edge or another corner.
//!
//! | symbol | name in code | unit   | meaning                                                     |
//! |--------|--------------|--------|-------------------------------------------------------------|
//! | n      | `normal`     | –      | unit, obstacle to body, in the normal cones of both features |
//! | a      | `motion`     | m, rad | of G                                                        |
//!
//! Such a pair has no normal of its own. Every plane through its points whose normal is in both cones parts the bodies there, and a body is free as long as
//! it is outside one of these planes. That of the nearest points, across their difference, lies in the way of corners that pass each other. A straight motion
//! gets inside where it crosses the last of the planes, and that is one at the end of the cones, as those of faces are: a plane between two others is
//! crossed before one of them is.

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

/// A contact of corners with the plane of a face that `motion` crosses after its own, the last of them; `None` where there is none.
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
    let mut consider = |plane: Contact| {
        let crossed = crossed(&plane);
        if plane.gap >= 0.0 && crossed > latest {
            (latest, last) = (crossed, Some(plane));
        }
    };
    let difference = contact.point_on_body - contact.point_on_obstacle;
    for_normals(mesh, on_obstacle, |normal| {
        let normal = pose.rotation * normal;
        let gap = normal.dot(&difference);
        if holds(body, on_body, &-(at.pose.rotation.inverse() * normal)) {
            consider(Contact {
                point_on_obstacle: contact.point_on_body - normal * gap,
                normal,
                gap,
                ..*contact
            });
        }
    });
    for_normals(body, on_body, |normal| {
        let normal = -(at.pose.rotation * normal);
        let gap = normal.dot(&difference);
        if holds(mesh, on_obstacle, &(pose.rotation.inverse() * normal)) {
            consider(Contact {
                point_on_body: contact.point_on_obstacle + normal * gap,
                normal,
                gap,
                ..*contact
            });
        }
    });
    last
}

/// Normals of the faces at a feature that are in its normal cone, in the mesh's frame.
fn for_normals(mesh: &Mesh, feature: Feature, mut each: impl FnMut(&Vector3<f64>)) {
    let mut of_face = |face: u32| {
        let normal = mesh.face_normal(face);
        if holds(mesh, feature, normal) {
            each(normal);
        }
    };
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

/// Whether a direction is in the normal cone of a feature, in the mesh's frame: to the tolerance that faces have.
fn holds(mesh: &Mesh, feature: Feature, direction: &Vector3<f64>) -> bool {
    match feature {
        Feature::Edge(e) => is_in_edge_cone(mesh, e, direction, LOOK_AHEAD_TILT),
        Feature::Vertex(v) => is_in_vertex_cone(mesh, v, direction, LOOK_AHEAD_TILT),
        _ => false,
    }
}
