//! Collects the contacts between a body and an obstacle at rest.
//!
//! Both trees are descended together, by distance and by cones of normals: surfaces that do not face each other are left
//! early. Each vertex and edge belongs to one triangle, so that a pair of features is looked at once.

use super::cones::LOOK_AHEAD_TILT;
use super::element::Row;
use super::facing::{Facing, Reach, point_face, point_point, point_segment, rows, segment_segment};
use super::nearest::{Nearest, Rows};
use super::piece::{Piece, Triangle};
use super::{Collected, Contact, Feature};
use crate::collision::{
    Collider, CollisionWorkspace, MAX_IMPLIED, MAX_WITNESSES, Placement, StillPair, Work,
    for_facing_triangle_pairs, for_nearest_triangle_pairs,
};
use crate::geometry::Mesh;
use crate::spatial::Pose;

/// The bits of owned features that stand for corners; those of sides follow.
const CORNERS: u8 = 7;
/// The piece of a primitive.
const ONLY_PIECE: u32 = 0;

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
    };
    let (mut looked_at, mut complete_within) = (0, activation_distance);
    if !placement.is_beyond(activation_distance, body, obstacle) {
        let turned = &mut workspace.turned;
        let within = (activation_distance, LOOK_AHEAD_TILT);
        let leaves = &mut workspace.leaves;
        let still = StillPair::new((&body, &obstacle), &placement, within, leaves, turned);
        let reach = Reach::new(activation_distance);
        let mut facing = Facing::new(body, obstacle, &placement, obstacle_index, reach);
        let look = |a, b, work: &mut Work| {
            let before = work.feature_pairs;
            facing.reach.implied_within = rows.implied.within;
            for_contacts(&facing, [a, b], work, |contact, implied| {
                rows.take(contact, implied);
            });
            looked_at += 1 + work.feature_pairs - before;
            looked_at < pairs
        };
        if pairs < u64::MAX {
            let memory = (&mut workspace.bands, turned);
            complete_within = for_nearest_triangle_pairs(&still, memory, work, can_touch, look);
        } else {
            let memory = (&mut workspace.pairs, turned);
            for_facing_triangle_pairs(&still, memory, work, can_touch, look);
        }
    }
    let truncated = rows.finish();
    let candidates = &workspace.candidates;
    if truncated {
        complete_within = complete_within.min(candidates.last().map_or(0.0, |c| c.gap));
    }
    let gap_min = candidates.first().map_or(f64::INFINITY, |c| c.gap);
    out.extend(candidates.iter().map(|c| in_world(c, obstacle_pose)));
    note_witnesses((&body, &obstacle), workspace);
    Collected {
        truncated,
        complete_within,
        looked_at,
        gap_min,
    }
}

/// The next search looks at the nearest candidates first.
fn note_witnesses(
    (body, obstacle): (&Collider<'_>, &Collider<'_>),
    workspace: &mut CollisionWorkspace,
) {
    let witnesses = &mut workspace.memories[workspace.current].witnesses;
    witnesses.clear();
    for contact in workspace.candidates.iter().take(MAX_WITNESSES) {
        let on_body = match body {
            Collider::Mesh(mesh) => triangle_of(mesh, contact.features.on_body),
            Collider::Primitive(_) => Some(ONLY_PIECE),
        };
        let on_obstacle = match obstacle {
            Collider::Mesh(_) => contact.obstacle_triangle,
            Collider::Primitive(_) => ONLY_PIECE,
        };
        if let Some(on_body) = on_body {
            witnesses.push((on_body, on_obstacle));
        }
    }
}

/// Whether triangles that own these kinds of features, two or those below two volumes, own some that can meet: a corner of either
/// meets the other's face, sides meet sides.
#[inline]
pub(super) fn can_touch(on_a: u8, on_b: u8) -> bool {
    (on_a | on_b) & CORNERS != 0 || (on_a != 0 && on_b != 0)
}

/// Every contact between features that two pieces own, or that one owns with the other's face, and whether others imply it.
pub(super) fn for_contacts(
    facing: &Facing,
    [a, b]: [u32; 2],
    work: &mut Work,
    mut found: impl FnMut(Contact, bool),
) {
    let (body, obstacle) = (facing.body.piece(a), facing.obstacle.piece(b));
    let index = facing.obstacle_index;
    match (&body, &obstacle) {
        (Piece::Triangle(a), Piece::Triangle(b)) => {
            for_contacts_of_triangles(facing, (a, b), work, |contact| found(contact, false));
        }
        _ => {
            work.feature_pairs += 1;
            for_rows_of_primitive(&body, &obstacle, &facing.reach, &mut |row: Row| {
                found(row.contact(index, obstacle.triangle()), row.implied);
            });
        }
    }
}

/// The rows of two pieces, one of which is a primitive.
fn for_rows_of_primitive(
    body: &Piece,
    obstacle: &Piece,
    reach: &Reach,
    found: &mut dyn FnMut(Row),
) {
    let of_body = body.near(obstacle, reach.within);
    let of_obstacle = obstacle.near(body, reach.within);
    body.for_elements(&of_body, |x| {
        obstacle.for_elements(&of_obstacle, |y| rows(x, y, reach, found));
    });
}

/// The same of two triangles.
fn for_contacts_of_triangles(
    facing: &Facing,
    (a, b): (&Triangle, &Triangle),
    work: &mut Work,
    mut found: impl FnMut(Contact),
) {
    let reach = &facing.reach;
    let mut hand_on = |row: Row| found(row.contact(facing.obstacle_index, Some(b)));
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
