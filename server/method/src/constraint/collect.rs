//! Collects the contacts between a body and an obstacle at rest.
//!
//! Both trees are descended together, by distance and by cones of normals: surfaces that do not face each other are left
//! early. Each vertex and edge belongs to one triangle, so that a pair of features is looked at once.

use super::facing::{Facing, LOOK_AHEAD_TILT, Pair};
use super::{Collected, Contact, Feature};
use crate::collision::{
    CollisionWorkspace, FacingVolumes, MAX_WITNESSES, Motions, Placement, Side, Work,
    for_deepest_triangle_pairs, for_facing_triangle_pairs, for_nearest_triangle_pairs,
};
use crate::geometry::Mesh;
use crate::spatial::{Pose, Vector6};
use nalgebra::Point3;

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
    workspace.witnesses.clear();
    for contact in candidates.iter().take(MAX_WITNESSES) {
        if let Some(triangle) = triangle_of(body, contact.features.on_body) {
            workspace
                .witnesses
                .push((triangle, contact.obstacle_triangle));
        }
    }
    let gap_min = candidates.first().map_or(f64::INFINITY, |c| c.gap);
    out.extend(candidates.iter().map(|c| in_world(c, obstacle_pose)));
    Collected {
        truncated,
        complete_within,
        looked_at,
        gap_min,
    }
}

/// What a search for violated pairs asks.
pub(crate) struct Violated<'a> {
    /// Motions of G, world axes, whose linear clearances count.
    pub(crate) motions: &'a [Vector6],
    /// G, world.
    pub(crate) center: Point3<f64>,
    /// Pairs that end up nearer than this are of interest, m.
    pub(crate) target: f64,
    /// No pair farther apart than this can, m.
    pub(crate) reach: f64,
    /// Most pairs of triangles and features to look at.
    pub(crate) pairs: u64,
}

/// Calls `found` for contacts, world frame, among which are all that one of the motions would bring below the target: the deepest first, to a band, as
/// many as the work allows.
pub(crate) fn for_violated(
    (body, body_pose): (&Mesh, &Pose),
    (obstacle, obstacle_pose): (&Mesh, &Pose),
    obstacle_index: u16,
    asked: &Violated<'_>,
    workspace: &mut CollisionWorkspace,
    work: &mut Work,
    mut found: impl FnMut(&Contact),
) {
    let placement = Placement::of(body_pose, obstacle_pose);
    let trees = (body.wide_tree(), obstacle.wide_tree());
    let volumes = FacingVolumes::still(
        trees,
        &placement,
        asked.reach,
        LOOK_AHEAD_TILT,
        &mut workspace.turned,
    );
    let facing = Facing {
        body,
        obstacle,
        placement: &placement,
        obstacle_index,
        activation_distance: asked.reach,
        past_reentrant_edges: false,
    };
    let seen_by = |side, placed| {
        Motions::seen_by(side, placed, asked.motions, &asked.center, LOOK_AHEAD_TILT)
    };
    let of_body = seen_by(Side::Body, (trees.0, body_pose));
    let of_obstacle = seen_by(Side::Obstacle, (trees.1, obstacle_pose));
    let mut looked_at = 0;
    for_deepest_triangle_pairs(
        trees,
        (&volumes, asked.reach),
        ([&of_body, &of_obstacle], asked.target as f32),
        (&mut workspace.bands, &mut workspace.turned),
        work,
        can_touch,
        |a, b, work| {
            let before = work.feature_pairs;
            for_contacts(&facing, &facing.pair(a, b), work, |contact| {
                found(&in_world(&contact, obstacle_pose));
            });
            looked_at += 1 + work.feature_pairs - before;
            looked_at < asked.pairs
        },
    );
}

/// Whether triangles that own these kinds of features, two or those below two volumes, own some that can meet: a corner of either
/// meets the other's face, sides meet sides.
#[inline]
fn can_touch(on_a: u8, on_b: u8) -> bool {
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use nalgebra::Vector3;

    use super::*;
    use crate::constraint::{FeaturePair, contact_jacobian};
    use crate::spatial::six;

    const ROUGH: f64 = 1e-6;

    /// A rough square of `cells` x `cells` about the z axis, on a point below.
    fn rough(cells: u32, cell: f64, seed: u64) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let mut state = seed;
        let mut height = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005) + 1;
            ROUGH * (state >> 33) as f64 / f64::from(1_u32 << 31)
        };
        let at = |i: u32, j: u32| i * (cells + 1) + j;
        let place = |i: u32| cell * (f64::from(i) - 0.5 * f64::from(cells));
        let mut vertices: Vec<Point3<f64>> = (0..=cells)
            .flat_map(|i| (0..=cells).map(move |j| [i, j]))
            .map(|[i, j]| Point3::new(place(i), place(j), height()))
            .collect();
        let mut triangles = Vec::new();
        for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
            let q = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        }
        let apex = vertices.len() as u32;
        vertices.push(Point3::new(0.0, 0.0, -cell * f64::from(cells)));
        for k in 0..cells {
            let rim = [
                [at(k, 0), at(k + 1, 0)],
                [at(cells, k), at(cells, k + 1)],
                [at(k + 1, cells), at(k, cells)],
                [at(0, k + 1), at(0, k)],
            ];
            triangles.extend(rim.map(|[a, b]| [b, a, apex]));
        }
        (vertices, triangles)
    }

    /// Rough squares that lie on each other, at any place in the world: every pair that some motion brings below the target is found, and few others are
    /// looked at.
    #[test]
    fn what_motions_violate_is_found_without_looking_at_all_that_is_near() {
        let (mut vertices, mut triangles) = rough(14, 5.5e-4, 3);
        vertices.iter_mut().for_each(|p| p.z = -p.z);
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let body = Mesh::new(vertices, triangles).expect("a closed block");
        let (vertices, triangles) = rough(24, 5e-4, 7);
        let obstacle = Mesh::new(vertices, triangles).expect("a closed block");
        let (reach, target) = (1e-4, 1e-6);
        let (mut expected_in_all, mut looked_at, mut near) = (0, 0, 0);
        for k in 0..40_u32 {
            let u = f64::from(k);
            let world = Pose::new(Vector3::new(u, -u, 0.1 * u), Vector3::y() * (0.2 * u));
            let slid = Vector3::new(1e-4 * (1.7 * u).sin(), 1e-4 * (2.3 * u).cos(), 6e-6);
            let body_pose = world * Pose::new(slid, Vector3::z() * (0.3 * u).sin());
            let placed = [(&body, &body_pose), (&obstacle, &world)];
            let center = body_pose * Point3::new(1e-3, 2e-3, -3e-3);
            // Along the surfaces, and a little about axes in them.
            let motions = [0.0, 1.0].map(|shift| {
                let v = u + shift;
                let along = Vector3::new((3.0 * v).sin(), (5.0 * v).cos(), 0.0);
                let about = Vector3::new((2.0 * v).cos(), (11.0 * v).sin(), 0.0);
                six(
                    &(world.rotation * (along * 3e-5)),
                    &(world.rotation * (about * 3e-3)),
                )
            });
            let workspace = &mut CollisionWorkspace::with_candidates(1 << 14);
            let mut all = Vec::with_capacity(1 << 13);
            let work = &mut Work::default();
            let [(a, at_a), (b, at_b)] = placed;
            let _ = collect_contacts(a, at_a, b, at_b, 0, reach, workspace, &mut all, work);
            let is_violated = |contact: &&Contact| {
                let row = contact_jacobian(&contact.normal, &contact.point_on_obstacle, &center);
                motions.iter().any(|m| contact.gap + row.dot(m) < target)
            };
            let violated = all.iter().filter(is_violated).map(|c| c.features);
            let expected: BTreeSet<FeaturePair> = violated.collect();
            near += work.triangle_pairs;
            let before = work.triangle_pairs;
            let mut found = BTreeSet::new();
            let asked = Violated {
                motions: &motions,
                center,
                target,
                reach,
                pairs: u64::MAX,
            };
            for_violated(placed[0], placed[1], 0, &asked, workspace, work, |c| {
                found.insert(c.features);
            });
            looked_at += work.triangle_pairs - before;
            let missing: Vec<_> = expected.difference(&found).collect();
            assert!(missing.is_empty(), "{k}: {missing:?}");
            expected_in_all += expected.len();
        }
        println!("{expected_in_all} violated, {looked_at} of {near} pairs of triangles");
        assert!(expected_in_all > 1000, "{expected_in_all}");
        assert!(4 * looked_at < 3 * near, "{looked_at} of {near}");
    }
}
