//! Searches for the contacts that motions would violate, deepest first: where nearest first says little, as between conforming surfaces.

use nalgebra::Point3;

use super::Contact;
use super::collect::{can_touch, for_contacts, in_world};
use super::cones::LOOK_AHEAD_TILT;
use super::facing::{Facing, Reach};
use crate::collision::{
    Collider, CollisionWorkspace, Motions, Placement, Side, StillPair, Work,
    for_deepest_triangle_pairs,
};
use crate::geometry::Primitive;
use crate::spatial::{Pose, Vector6};

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
    /// Pairs that are nearer are known, m.
    pub(crate) known_within: f64,
    /// Most pairs of triangles and features to look at.
    pub(crate) pairs: u64,
}

/// Calls `found` for contacts, world frame, among which are all that one of the motions would bring below the target: the deepest first, to a band, as
/// many as the work allows.
pub(crate) fn for_violated(
    (body, body_pose): (Collider<'_>, &Pose),
    (obstacle, obstacle_pose): (Collider<'_>, &Pose),
    obstacle_index: u16,
    asked: &Violated<'_>,
    workspace: &mut CollisionWorkspace,
    work: &mut Work,
    mut found: impl FnMut(&Contact),
) {
    let placement = Placement::of(body_pose, obstacle_pose);
    if placement.is_beyond(asked.reach, body, obstacle) {
        return;
    }
    let turned = &mut workspace.turned;
    let within = (asked.reach, LOOK_AHEAD_TILT);
    let leaves = &mut workspace.leaves;
    let still = StillPair::new((&body, &obstacle), &placement, within, leaves, turned);
    let reach = Reach::new(asked.reach);
    let facing = Facing::new(body, obstacle, &placement, obstacle_index, reach);
    let seen_by = |side, pose| {
        let placed = (still.tree(side), pose);
        Motions::seen_by(side, placed, asked.motions, &asked.center, LOOK_AHEAD_TILT)
    };
    let mut of_body = seen_by(Side::Body, body_pose);
    if let Collider::Primitive(Primitive::Plane { normal, .. }) = obstacle {
        of_body = of_body.along(&-placement.rotation.tr_mul(normal));
    }
    let of_obstacle = seen_by(Side::Obstacle, obstacle_pose);
    let mut looked_at = 0;
    for_deepest_triangle_pairs(
        &still,
        (
            [&of_body, &of_obstacle],
            asked.known_within as f32,
            asked.target as f32,
        ),
        (&mut workspace.bands, turned),
        work,
        can_touch,
        |a, b, work| {
            let before = work.feature_pairs;
            for_contacts(&facing, [a, b], work, |contact, _| {
                found(&in_world(&contact, obstacle_pose));
            });
            looked_at += 1 + work.feature_pairs - before;
            looked_at < asked.pairs
        },
    );
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use nalgebra::Vector3;

    use super::*;
    use crate::constraint::{FeaturePair, collect_contacts, contact_jacobian};
    use crate::geometry::Mesh;
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

    /// Rough squares that lie on each other, at any place in the world: every pair that some motion brings below the target is found but those that are
    /// known, and few others are looked at.
    #[test]
    fn what_motions_violate_is_found_without_looking_at_all_that_is_near() {
        let (mut vertices, mut triangles) = rough(14, 5.5e-4, 3);
        vertices.iter_mut().for_each(|p| p.z = -p.z);
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let body = Mesh::new(vertices, triangles).expect("a closed block");
        let (vertices, triangles) = rough(24, 5e-4, 7);
        let obstacle = Mesh::new(vertices, triangles).expect("a closed block");
        let (reach, target) = (1e-4, 1e-6);
        let (mut expected_in_all, mut looked_at, mut near) = ([0; 2], [0; 2], 0);
        for k in 0..40_u32 {
            let u = f64::from(k);
            let world = Pose::new(Vector3::new(u, -u, 0.1 * u), Vector3::y() * (0.2 * u));
            let slid = Vector3::new(1e-4 * (1.7 * u).sin(), 1e-4 * (2.3 * u).cos(), 6e-6);
            let body_pose = world * Pose::new(slid, Vector3::z() * (0.3 * u).sin());
            let placed = [
                (Collider::from(&body), &body_pose),
                (Collider::from(&obstacle), &world),
            ];
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
            let violated: Vec<&Contact> = all.iter().filter(is_violated).collect();
            near += work.triangle_pairs;
            for (place, known_within) in [0.0, 5e-6].into_iter().enumerate() {
                let unknown = violated.iter().filter(|c| c.gap > known_within);
                let expected: BTreeSet<FeaturePair> = unknown.map(|c| c.features).collect();
                let before = work.triangle_pairs;
                let mut found = BTreeSet::new();
                let asked = Violated {
                    motions: &motions,
                    center,
                    target,
                    reach,
                    known_within,
                    pairs: u64::MAX,
                };
                for_violated(placed[0], placed[1], 0, &asked, workspace, work, |c| {
                    found.insert(c.features);
                });
                looked_at[place] += work.triangle_pairs - before;
                let missing: Vec<_> = expected.difference(&found).collect();
                assert!(missing.is_empty(), "{k}, {known_within}: {missing:?}");
                expected_in_all[place] += expected.len();
            }
        }
        println!("{expected_in_all:?} violated, {looked_at:?} of {near} pairs of triangles");
        assert!(expected_in_all[1] > 1000, "{expected_in_all:?}");
        assert!(
            expected_in_all[1] < expected_in_all[0],
            "{expected_in_all:?}"
        );
        assert!(4 * looked_at[0] < 3 * near, "{looked_at:?} of {near}");
        assert!(looked_at[1] < looked_at[0], "{looked_at:?}");
    }
}
