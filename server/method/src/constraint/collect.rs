//! Collects the contacts between a body and an obstacle at rest.
//!
//! Both trees are descended together, by distance and by cones of normals: surfaces that do not face each other are left
//! early. Each vertex and edge belongs to one triangle, so that a pair of features is looked at once.

use nalgebra::Vector3;

use super::facing::{Facing, LOOK_AHEAD_TILT, Pair};
use super::{Collected, Contact, Feature};
use crate::collision::{
    CollisionWorkspace, MAX_CANDIDATES, MAX_HINTS, Placement, StillBoxes, Work, for_triangle_pairs,
};
use crate::geometry::{Mesh, Node, NormalCone};
use crate::spatial::Pose;

/// Appends every contact within `activation_distance` (m) to `out`, nearest first, as many as its capacity has room for.
///
/// A contact is a pair of features that face each other ([`Contact`]); faces that lie on faces, and parallel edges, are represented by their
/// vertices and crossings. Poses are those of the meshes' own frames. Flat and concave edges and vertices make no contact. No allocation.
#[allow(
    clippy::too_many_arguments,
    reason = "two placed meshes, a distance, and memory to work in"
)]
pub fn collect_contacts(
    body: &Mesh,
    body_pose: &Pose,
    obstacle: &Mesh,
    obstacle_pose: &Pose,
    obstacle_index: u16,
    activation_distance: f64,
    workspace: &mut CollisionWorkspace,
    out: &mut Vec<Contact>,
    work: &mut Work,
) -> Collected {
    let placement = Placement::of(body_pose, obstacle_pose);
    let boxes = StillBoxes::new(&placement, activation_distance);
    let facing = Facing {
        body,
        obstacle,
        placement: &placement,
        obstacle_index,
        activation_distance,
    };
    let room = (out.capacity() - out.len()).min(MAX_CANDIDATES / 2);
    let candidates = &mut workspace.candidates;
    candidates.clear();
    let mut truncated = false;
    let (body_tree, obstacle_tree) = (body.tree(), obstacle.tree());
    for_triangle_pairs(
        body_tree,
        obstacle_tree,
        &mut workspace.stack,
        work,
        |i, j| {
            let nodes = (
                &body_tree.nodes()[i as usize],
                &obstacle_tree.nodes()[j as usize],
            );
            let offset = boxes.offset(nodes.0, nodes.1);
            boxes.spheres_meet(nodes.0, nodes.1, &offset)
                && may_face(
                    &placement,
                    nodes,
                    (body_tree.cone(i), obstacle_tree.cone(j)),
                    &offset,
                )
                && boxes.boxes_meet(nodes.0, nodes.1, &offset)
        },
        |a, b, work| {
            let pair = Pair {
                a,
                b,
                x: body.corners(a).map(|p| placement.point(&p)),
                y: obstacle.corners(b),
            };
            for_contacts(&facing, &pair, work, |contact| {
                if candidates.len() == MAX_CANDIDATES {
                    keep_nearest(candidates, room);
                    truncated = true;
                }
                candidates.push(contact);
            });
            true
        },
    );

    if candidates.len() > room {
        keep_nearest(candidates, room);
        truncated = true;
    }
    candidates.sort_unstable_by(nearer);
    workspace.hints.clear();
    for contact in candidates.iter().take(MAX_HINTS) {
        if let Some(triangle) = triangle_of(body, contact.features.on_body) {
            workspace.hints.push((triangle, contact.obstacle_triangle));
        }
    }
    let gap_min = candidates.first().map_or(f64::INFINITY, |c| c.gap);
    out.extend(candidates.iter().map(|c| in_world(c, obstacle_pose)));
    Collected { truncated, gap_min }
}

/// Whether features below the two nodes can face each other: some normal of the one is opposite to some normal of the other, and both
/// lie along some line between the nodes. To tolerance; true for NaN.
#[inline]
fn may_face(
    placement: &Placement,
    (body, obstacle): (&Node, &Node),
    (body_cone, obstacle_cone): (&NormalCone, &NormalCone),
    line: &Vector3<f64>,
) -> bool {
    let body_axis = placement.rotation * body_cone.axis;
    let angle = body_cone.angle + obstacle_cone.angle + LOOK_AHEAD_TILT;
    if angle < std::f64::consts::PI {
        // cos(sum + tilt) >= cos(sum) - tilt.
        let [a, b] = [body_cone.cos_sin, obstacle_cone.cos_sin];
        if -obstacle_cone.axis.dot(&body_axis) < a[0] * b[0] - a[1] * b[1] - LOOK_AHEAD_TILT {
            return false;
        }
    }
    // Directions from a point of the obstacle's sphere to one of the body's make a cone about the line of the centres, with
    // the sine `spread / |line|`. All lengths: no division.
    let spread = body.radius + obstacle.radius;
    let squared = line.norm_squared() - spread * spread;
    let apart = squared > 0.0; // false for NaN
    if !apart {
        return true;
    }
    let along = squared.sqrt();
    let tilt = LOOK_AHEAD_TILT * (line.x.abs() + line.y.abs() + line.z.abs());
    let off_line = |cosine: f64, cone: &NormalCone| {
        // cos(sum + tilt) >= cos(sum) - tilt, for cones narrower than a right angle.
        let [cos, sin] = cone.cos_sin;
        cos > LOOK_AHEAD_TILT && cosine < cos * along - sin * spread - tilt
    };
    !off_line(obstacle_cone.axis.dot(line), obstacle_cone)
        && !off_line(-body_axis.dot(line), body_cone)
}

/// Every contact between features that the two triangles own, or that one owns with the other's face.
fn for_contacts(facing: &Facing, pair: &Pair, work: &mut Work, mut found: impl FnMut(Contact)) {
    let (on_a, on_b) = (
        facing.body.owned_features(pair.a),
        facing.obstacle.owned_features(pair.b),
    );
    let corner = |owned: u8, k: usize| owned & (1 << k) != 0;
    let side = |owned: u8, k: usize| owned & (8 << k) != 0;
    for k in 0..3 {
        if corner(on_a, k) {
            work.feature_pairs += 1;
            facing.vertex_face(pair, k).map(&mut found);
        }
        if corner(on_b, k) {
            work.feature_pairs += 1;
            facing.face_vertex(pair, k).map(&mut found);
        }
    }
    if on_a == 0 || on_b == 0 {
        return;
    }
    work.feature_pairs += u64::from(on_a.count_ones() * on_b.count_ones());
    for i in 0..3 {
        for j in 0..3 {
            if side(on_a, i) && side(on_b, j) {
                facing.edge_edge(pair, i, j).map(&mut found);
            }
            if corner(on_a, i) && side(on_b, j) {
                facing.vertex_edge(pair, i, j).map(&mut found);
            }
            if side(on_a, i) && corner(on_b, j) {
                facing.edge_vertex(pair, i, j).map(&mut found);
            }
            if corner(on_a, i) && corner(on_b, j) {
                facing.vertex_vertex(pair, i, j).map(&mut found);
            }
        }
    }
}

/// By gap, then by features: the order says nothing of the traversal.
fn nearer(a: &Contact, b: &Contact) -> std::cmp::Ordering {
    a.gap
        .total_cmp(&b.gap)
        .then_with(|| a.features.cmp(&b.features))
}

fn keep_nearest(candidates: &mut Vec<Contact>, count: usize) {
    if count < candidates.len() {
        candidates.select_nth_unstable_by(count, nearer);
        candidates.truncate(count);
    }
}

fn triangle_of(mesh: &Mesh, feature: Feature) -> Option<u32> {
    match feature {
        Feature::Vertex(v) => mesh.vertex_owner(v),
        Feature::Edge(e) => Some(mesh.edges()[e as usize].faces[0]),
        Feature::Face(t) => Some(t),
        Feature::Whole | Feature::Side | Feature::Cap(_) | Feature::Rim(..) => None,
    }
}

fn in_world(contact: &Contact, obstacle_pose: &Pose) -> Contact {
    Contact {
        point_on_body: obstacle_pose * contact.point_on_body,
        point_on_obstacle: obstacle_pose * contact.point_on_obstacle,
        normal: obstacle_pose.rotation * contact.normal,
        ..*contact
    }
}
