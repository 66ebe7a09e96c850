//! Collects the contacts between a body and an obstacle at rest.
//!
//! Both trees are descended together, by distance and by cones of normals: surfaces that do not face each other are left
//! early. Each vertex and edge belongs to one triangle, so that a pair of features is looked at once.

use super::cones::LOOK_AHEAD_TILT;
use super::facing::{Facing, Pair};
use super::{Collected, Contact, Feature};
use crate::collision::{
    CollisionWorkspace, FacingVolumes, MAX_WITNESSES, Placement, Work, for_facing_triangle_pairs,
    for_nearest_triangle_pairs,
};
use crate::geometry::Mesh;
use crate::spatial::Pose;

/// The bits of owned features that stand for corners; those of sides follow.
const CORNERS: u8 = 7;

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
    collect_bounded(
        (body, body_pose),
        (obstacle, obstacle_pose),
        obstacle_index,
        activation_distance,
        u64::MAX,
        workspace,
        out,
        work,
    )
}

/// The same, nearest first, given up after `pairs` pairs of triangles and of their features: what was found is complete within the distance that is
/// returned. `u64::MAX` is no bound.
#[allow(
    clippy::too_many_arguments,
    reason = "two placed meshes, two bounds, and memory to work in"
)]
pub(crate) fn collect_bounded(
    (body, body_pose): (&Mesh, &Pose),
    (obstacle, obstacle_pose): (&Mesh, &Pose),
    obstacle_index: u16,
    activation_distance: f64,
    pairs: u64,
    workspace: &mut CollisionWorkspace,
    out: &mut Vec<Contact>,
    work: &mut Work,
) -> Collected {
    let placement = Placement::of(body_pose, obstacle_pose);
    if placement.is_beyond(activation_distance, body, obstacle) {
        workspace.candidates.clear();
        note_witnesses(body, workspace);
        return Collected::nothing_within(activation_distance);
    }
    let trees = (body.wide_tree(), obstacle.wide_tree());
    let volumes = FacingVolumes::still(
        trees,
        &placement,
        activation_distance,
        LOOK_AHEAD_TILT,
        &mut workspace.turned,
    );
    let facing = Facing {
        body,
        obstacle,
        placement: &placement,
        obstacle_index,
        activation_distance,
        past_reentrant_edges: false,
    };
    let mut nearest = Nearest {
        limit: workspace.candidate_limit,
        room: (out.capacity() - out.len()).min(workspace.candidate_limit / 2),
        candidates: &mut workspace.candidates,
        truncated: false,
    };
    nearest.candidates.clear();
    let mut looked_at = 0;
    let mut look = |a, b, work: &mut Work| {
        let before = work.feature_pairs;
        for_contacts(&facing, &facing.pair(a, b), work, |contact| {
            nearest.take(contact);
        });
        looked_at += 1 + work.feature_pairs - before;
        looked_at < pairs
    };
    let mut complete_within = activation_distance;
    if pairs == u64::MAX {
        let stack = (&mut workspace.pairs, &mut workspace.turned);
        for_facing_triangle_pairs(trees, &volumes, stack, work, can_touch, look);
    } else {
        let bands = (&mut workspace.bands, &mut workspace.turned);
        let volumes = (&volumes, activation_distance);
        let within = for_nearest_triangle_pairs(trees, volumes, bands, work, can_touch, &mut look);
        complete_within = complete_within.min(within);
    }
    nearest.finish();
    let truncated = nearest.truncated;
    let candidates = &workspace.candidates;
    if truncated {
        complete_within = complete_within.min(candidates.last().map_or(0.0, |c| c.gap));
    }
    let gap_min = candidates.first().map_or(f64::INFINITY, |c| c.gap);
    out.extend(candidates.iter().map(|c| in_world(c, obstacle_pose)));
    note_witnesses(body, workspace);
    Collected {
        truncated,
        complete_within,
        looked_at,
        gap_min,
    }
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
    pair: &Pair,
    work: &mut Work,
    mut found: impl FnMut(Contact),
) {
    let (on_a, on_b) = (
        facing.body.owned_features(pair.a),
        facing.obstacle.owned_features(pair.b),
    );
    let (corners_a, corners_b) = (on_a & CORNERS, on_b & CORNERS);
    let (sides_a, sides_b) = (on_a >> 3, on_b >> 3);
    for_bits(corners_a, |k| {
        work.feature_pairs += 1;
        facing.vertex_face(pair, k).map(&mut found);
    });
    for_bits(corners_b, |k| {
        work.feature_pairs += 1;
        facing.face_vertex(pair, k).map(&mut found);
    });
    if sides_a != 0 && sides_b != 0 {
        let of_body = facing.arcs_of_body(pair, sides_a);
        for_bits(sides_b, |j| {
            let on_obstacle = facing.arc_of_obstacle(pair, j);
            for_bits(sides_a, |i| {
                if of_body[i].may_cross(&on_obstacle) {
                    work.feature_pairs += 1;
                    facing.edge_edge(pair, i, j).map(&mut found);
                }
            });
        });
    }
    for_bits(corners_a, |i| {
        for_bits(sides_b, |j| {
            work.feature_pairs += 1;
            facing.vertex_edge(pair, i, j).map(&mut found);
        });
        for_bits(corners_b, |j| {
            work.feature_pairs += 1;
            facing.vertex_vertex(pair, i, j).map(&mut found);
        });
    });
    for_bits(corners_b, |j| {
        for_bits(sides_a, |i| {
            work.feature_pairs += 1;
            facing.edge_vertex(pair, i, j).map(&mut found);
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

/// The nearest of the contacts that it is given, at most `room` of them in the end.
pub(crate) struct Nearest<'a> {
    pub(crate) candidates: &'a mut Vec<Contact>,
    /// Most held at a time, twice the room or more.
    pub(crate) limit: usize,
    pub(crate) room: usize,
    /// Some were left out.
    pub(crate) truncated: bool,
}

impl Nearest<'_> {
    #[inline]
    pub(crate) fn take(&mut self, contact: Contact) {
        if self.candidates.len() == self.limit {
            self.keep();
        }
        self.candidates.push(contact);
    }

    /// Leaves the nearest, nearest first.
    pub(crate) fn finish(&mut self) {
        self.keep();
        self.candidates.sort_unstable_by(nearer);
    }

    fn keep(&mut self) {
        if self.room < self.candidates.len() {
            self.candidates.select_nth_unstable_by(self.room, nearer);
            self.candidates.truncate(self.room);
            self.truncated = true;
        }
    }
}

/// By gap, then by features: the order says nothing of the traversal.
fn nearer(a: &Contact, b: &Contact) -> std::cmp::Ordering {
    a.gap
        .total_cmp(&b.gap)
        .then_with(|| a.features.cmp(&b.features))
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
