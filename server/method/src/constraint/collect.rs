//! Collects the contacts between a body and an obstacle at rest.
//!
//! Both trees are descended together, by distance and by cones of normals: surfaces that do not face each other are left
//! early. Each vertex and edge belongs to one triangle, so that a pair of features is looked at once.

use arrayvec::ArrayVec;

use super::cones::LOOK_AHEAD_TILT;
use super::element::{Element, Frame, Placed, Row};
use super::facing::{Facing, Reach, point_face, point_point, point_segment, rows, segment_segment};
use super::nearest::{Nearest, Rows};
use super::piece::elements_of;
use super::{Collected, Contact, Feature};
use crate::collision::{
    Bands, Collider, CollisionWorkspace, FacingVolumes, MAX_IMPLIED, MAX_WITNESSES, Placement,
    TurnedNodes, Work, for_facing_triangle_pairs, for_nearest_triangle_pairs,
};
use crate::geometry::wide_tree::Child;
use crate::geometry::{Mesh, Node};
use crate::spatial::Pose;

/// The bits of owned features that stand for corners; those of sides follow.
const CORNERS: u8 = 7;

/// Appends every contact within `activation_distance` (m) to `out`, nearest first, as many as its capacity has room for.
///
/// A contact is a pair of features that face each other ([`Contact`]); faces that lie on faces, and parallel edges, are represented by their
/// vertices and crossings. Poses are those of the bodies' own frames. Flat and concave edges and vertices make no contact. No allocation.
#[allow(
    clippy::too_many_arguments,
    reason = "two placed bodies, a distance, and memory to work in"
)]
pub fn collect_contacts<'a>(
    body: impl Into<Collider<'a>>,
    body_pose: &Pose,
    obstacle: impl Into<Collider<'a>>,
    obstacle_pose: &Pose,
    obstacle_index: u16,
    activation_distance: f64,
    workspace: &mut CollisionWorkspace,
    out: &mut Vec<Contact>,
    work: &mut Work,
) -> Collected {
    collect_bounded(
        (body.into(), body_pose),
        (obstacle.into(), obstacle_pose),
        obstacle_index,
        activation_distance,
        u64::MAX,
        workspace,
        out,
        work,
    )
}

/// The same, nearest first, given up after `pairs` pairs of pieces and of their features: what was found is complete within the distance that is
/// returned. `u64::MAX` is no bound.
#[allow(
    clippy::too_many_arguments,
    reason = "two placed bodies, two bounds, and memory to work in"
)]
pub(crate) fn collect_bounded(
    (body, body_pose): (Collider<'_>, &Pose),
    (obstacle, obstacle_pose): (Collider<'_>, &Pose),
    obstacle_index: u16,
    activation_distance: f64,
    pairs: u64,
    workspace: &mut CollisionWorkspace,
    out: &mut Vec<Contact>,
    work: &mut Work,
) -> Collected {
    let placement = Placement::of(body_pose, obstacle_pose);
    let limit = workspace.candidate_limit;
    let room = (out.capacity() - out.len()).min(limit / 2);
    let mut rows = Rows {
        nearest: Nearest::new(
            &mut workspace.candidates,
            [limit, room],
            activation_distance,
        ),
        implied: Nearest::new(
            &mut workspace.implied,
            [2 * MAX_IMPLIED, MAX_IMPLIED],
            activation_distance,
        ),
        obstacle: obstacle_index,
    };
    let (mut looked_at, mut complete_within) = (0, activation_distance);
    if placement.is_beyond(activation_distance, body, obstacle) {
        // Nothing to look at.
    } else if let (Collider::Mesh(body), Collider::Mesh(obstacle)) = (body, obstacle) {
        let reach = Reach::new(activation_distance);
        let facing = Facing::new(body, obstacle, &placement, obstacle_index, reach);
        let look = |a, b, work: &mut Work| {
            let before = work.feature_pairs;
            for_contacts(&facing, [a, b], work, |contact| rows.nearest.take(contact));
            looked_at += 1 + work.feature_pairs - before;
            looked_at < pairs
        };
        let bounded = pairs < u64::MAX;
        let queues = (
            &mut workspace.pairs,
            &mut workspace.bands,
            &mut workspace.turned,
        );
        complete_within = for_pairs_of_triangles(&facing, &placement, bounded, queues, work, look);
    } else {
        let stack = &mut workspace.nodes;
        looked_at = for_pieces((&body, &obstacle), &placement, &mut rows, stack, work);
    }
    let truncated = rows.finish();
    let candidates = &workspace.candidates;
    if truncated {
        complete_within = complete_within.min(candidates.last().map_or(0.0, |c| c.gap));
    }
    let gap_min = candidates.first().map_or(f64::INFINITY, |c| c.gap);
    out.extend(candidates.iter().map(|c| in_world(c, obstacle_pose)));
    if let (Collider::Mesh(body), Collider::Mesh(_)) = (body, obstacle) {
        note_witnesses(body, workspace);
    }
    Collected {
        truncated,
        complete_within,
        looked_at,
        gap_min,
    }
}

/// Calls `look` for the pairs of triangles that may face each other, the nearest first where that is bounded, until it returns false. The distance within
/// which every such pair was looked at, m.
fn for_pairs_of_triangles(
    facing: &Facing,
    placement: &Placement,
    bounded: bool,
    (stack, bands, turned): (&mut Vec<(Child, Child)>, &mut Bands, &mut TurnedNodes),
    work: &mut Work,
    look: impl FnMut(u32, u32, &mut Work) -> bool,
) -> f64 {
    let trees = (
        facing.body.mesh.wide_tree(),
        facing.obstacle.mesh.wide_tree(),
    );
    let distance = facing.reach.within;
    let volumes = FacingVolumes::still(trees, placement, distance, LOOK_AHEAD_TILT, turned);
    if bounded {
        let volumes = (&volumes, distance);
        for_nearest_triangle_pairs(trees, volumes, (bands, turned), work, can_touch, look)
    } else {
        for_facing_triangle_pairs(trees, &volumes, (stack, turned), work, can_touch, look);
        distance
    }
}

/// Takes the rows where a primitive is on one side or on both; the number of pairs that were looked at. A primitive is a tree of one piece: that of a mesh
/// is descended against it, by the plane through its nearest point to a box's centre, across the line between them. The convex primitive is on one side of
/// it, and the box on the other while its centre's distance exceeds its extent along that line.
fn for_pieces(
    (body, obstacle): (&Collider<'_>, &Collider<'_>),
    placement: &Placement,
    found: &mut Rows,
    stack: &mut Vec<u32>,
    work: &mut Work,
) -> u64 {
    let (of_body, of_obstacle) = (Frame(Some(placement)), Frame(None));
    let within = found.nearest.within;
    let mut reach = Reach::new(within);
    let (mesh, frame, primitive, elements, to_primitive) = match (*body, *obstacle) {
        (Collider::Primitive(a), Collider::Primitive(b)) => {
            work.feature_pairs += 1;
            for x in &elements_of(a, of_body) {
                for y in &elements_of(b, of_obstacle) {
                    rows(x, y, &reach, &mut |row| found.take(&row, None));
                }
            }
            return 1;
        }
        (Collider::Mesh(mesh), Collider::Primitive(b)) => {
            (mesh, of_body, b, elements_of(b, of_obstacle), *placement)
        }
        (Collider::Primitive(a), Collider::Mesh(mesh)) => {
            let to_body = placement.inverse();
            (mesh, of_obstacle, a, elements_of(a, of_body), to_body)
        }
        (Collider::Mesh(_), Collider::Mesh(_)) => return 0,
    };
    let (mesh_moves, placed) = (frame.0.is_some(), Placed { mesh, frame });
    let (mut nodes, mut triangles) = (0, 0);
    let may_meet = |node: &Node| {
        nodes += 1;
        let nearest = primitive.nearest(&to_primitive.point(&node.center));
        let in_mesh = to_primitive.rotation.tr_mul(&nearest.normal).abs();
        let apart = nearest.distance > in_mesh.dot(&node.half) + within; // false for NaN
        !apart
    };
    mesh.tree().for_triangles(stack, may_meet, |t| {
        triangles += 1;
        let triangle = placed.triangle(t);
        let on_obstacle = (!mesh_moves).then_some(&triangle);
        let near = |x: &&Element| match x {
            Element::Circle(rim) => rim.may_be_near(&triangle.corners, within),
            _ => true,
        };
        let near: ArrayVec<&Element, 5> = elements.iter().filter(near).collect();
        reach.implied_within = found.implied.within;
        triangle.for_elements(|y| {
            for x in &near {
                let (first, second) = if mesh_moves { (y, *x) } else { (*x, y) };
                rows(first, second, &reach, &mut |row| {
                    found.take(&row, on_obstacle)
                });
            }
        });
        true
    });
    work.node_pairs += nodes;
    work.triangle_pairs += triangles;
    work.feature_pairs += triangles;
    2 * triangles
}

/// The next search looks at the nearest candidates first.
fn note_witnesses(body: &Mesh, workspace: &mut CollisionWorkspace) {
    let witnesses = &mut workspace.memories[workspace.current].witnesses;
    witnesses.clear();
    for contact in workspace.candidates.iter().take(MAX_WITNESSES) {
        if let Some(triangle) = triangle_of(body, contact.features.on_body) {
            witnesses.push((triangle, contact.obstacle_triangle));
        }
    }
}

/// Whether triangles that own these kinds of features, two or those below two volumes, own some that can meet: a corner of either
/// meets the other's face, sides meet sides.
#[inline]
pub(super) fn can_touch(on_a: u8, on_b: u8) -> bool {
    (on_a | on_b) & CORNERS != 0 || (on_a != 0 && on_b != 0)
}

/// Every contact between features that the two triangles own, or that one owns with the other's face.
pub(super) fn for_contacts(
    facing: &Facing,
    [a, b]: [u32; 2],
    work: &mut Work,
    mut found: impl FnMut(Contact),
) {
    let (a, b) = (facing.body.triangle(a), facing.obstacle.triangle(b));
    let reach = &facing.reach;
    let mut hand_on = |row: Row| found(row.contact(facing.obstacle_index, Some(&b)));
    let (on_a, on_b) = (a.owned(), b.owned());
    let (corners_a, corners_b) = (on_a & CORNERS, on_b & CORNERS);
    let (sides_a, sides_b) = (on_a >> 3, on_b >> 3);
    for_bits(corners_a, |i| {
        work.feature_pairs += 1;
        point_face(&a.corner(i), &b.face(), reach).map(&mut hand_on);
    });
    for_bits(corners_b, |j| {
        work.feature_pairs += 1;
        let row = point_face(&b.corner(j), &a.face(), reach);
        if let Some(row) = row {
            hand_on(row.reversed());
        }
    });
    if sides_a != 0 && sides_b != 0 {
        let mut arcs = [a.arc(0); 3];
        for_bits(sides_a & 6, |i| arcs[i] = a.arc(i));
        for_bits(sides_b, |j| {
            let on_obstacle = b.arc(j);
            for_bits(sides_a, |i| {
                if arcs[i].may_cross(&on_obstacle) {
                    work.feature_pairs += 1;
                    segment_segment(&a.side(i), &b.side(j), reach).map(&mut hand_on);
                }
            });
        });
    }
    for_bits(corners_a, |i| {
        for_bits(sides_b, |j| {
            work.feature_pairs += 1;
            point_segment(&a.corner(i), &b.side(j), reach).map(&mut hand_on);
        });
        for_bits(corners_b, |j| {
            work.feature_pairs += 1;
            point_point(&a.corner(i), &b.corner(j), reach).map(&mut hand_on);
        });
    });
    for_bits(corners_b, |j| {
        for_bits(sides_a, |i| {
            work.feature_pairs += 1;
            let row = point_segment(&b.corner(j), &a.side(i), reach);
            if let Some(row) = row {
                hand_on(row.reversed());
            }
        });
    });
}

/// Calls `each` with the places of the bits that are set, lowest first; those of three.
#[inline(always)]
pub(super) fn for_bits(mask: u8, mut each: impl FnMut(usize)) {
    let mut left = mask & 7;
    while left != 0 {
        each(left.trailing_zeros() as usize);
        left &= left - 1;
    }
}

pub(super) fn triangle_of(mesh: &Mesh, feature: Feature) -> Option<u32> {
    match feature {
        Feature::Vertex(v) => mesh.vertex_owner(v),
        Feature::Edge(e) => Some(mesh.edges()[e as usize].faces[0]),
        Feature::Face(t) => Some(t),
        Feature::Whole | Feature::Side | Feature::Cap(_) | Feature::Rim(..) => None,
    }
}

/// A contact of the frame that is at `pose`, in the world.
pub(crate) fn in_world(contact: &Contact, pose: &Pose) -> Contact {
    Contact {
        point_on_body: pose * contact.point_on_body,
        point_on_obstacle: pose * contact.point_on_obstacle,
        normal: pose.rotation * contact.normal,
        ..*contact
    }
}
