//! The trees lead to every contact, however far apart the surfaces are.

use std::collections::BTreeSet;

use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};

use super::collect::{collect_bounded, collect_contacts, for_contacts, in_world};
use super::facing::{Facing, Reach};
use super::{Contact, FeaturePair, Violated, contact_jacobian, for_violated};
use crate::collision::{Collider, CollisionWorkspace, Placement, Work, bumpy_ball};
use crate::geometry::Primitive;
use crate::spatial::{Pose, Vector6, six};

/// What faces over a distance of many triangles lies aside of their volumes by nearly as much as their cones of normals allow.
#[test]
fn no_contact_is_passed_over_however_far_apart_the_surfaces_are() {
    let (body, obstacle) = (bumpy_ball(13, 16), bumpy_ball(17, 19));
    let reach = 0.6;
    let workspace = &mut CollisionWorkspace::with_candidates(1 << 12);
    let (mut contacts, mut all) = (Vec::with_capacity(1 << 11), 0);
    for k in 0..150_u32 {
        let u = f64::from(k);
        let away = Vector3::new((1.3 * u).sin(), (0.7 * u).cos(), (2.1 * u).sin());
        let turn = Vector3::new((0.9 * u).cos(), (1.7 * u).sin(), (0.3 * u).cos());
        let pose = Pose::from_parts(
            Translation3::from(away.normalize() * (0.23 + 0.0025 * u)),
            UnitQuaternion::from_scaled_axis(turn * 2.0),
        );
        let at = Pose::new(Vector3::new(0.4, 0.1, -0.2), turn * 0.7);
        let pose = at * pose;
        let placement = Placement::of(&pose, &at);
        let facing = Facing::new(&body, &obstacle, &placement, 0, Reach::new(reach));
        let mut expected = BTreeSet::<FeaturePair>::new();
        for a in 0..body.triangles().len() as u32 {
            for b in 0..obstacle.triangles().len() as u32 {
                for_contacts(
                    &facing,
                    [a, b],
                    &mut Work::default(),
                    |contact: Contact, _| {
                        expected.insert(contact.features);
                    },
                );
            }
        }
        contacts.clear();
        let work = &mut Work::default();
        let collected = collect_contacts(
            &body,
            &pose,
            &obstacle,
            &at,
            0,
            reach,
            workspace,
            &mut contacts,
            work,
        );
        assert!(!collected.truncated, "{k}");
        let found: BTreeSet<FeaturePair> = contacts.iter().map(|c| c.features).collect();
        let missed: Vec<_> = expected.difference(&found).collect();
        assert!(
            missed.is_empty(),
            "{k}: {} of {}",
            missed.len(),
            expected.len()
        );
        all += expected.len();
    }
    assert!(all > 400, "{all}");
}

fn primitives() -> [Primitive; 4] {
    let ends = [
        Point3::new(0.01, 0.02, -0.06),
        Point3::new(-0.02, 0.01, 0.07),
    ];
    [
        Primitive::Sphere {
            center: ends[0],
            radius: 0.07,
        },
        Primitive::Capsule { ends, radius: 0.05 },
        Primitive::Cylinder { ends, radius: 0.06 },
        Primitive::Plane {
            normal: Vector3::new(0.3, -0.4, 0.5).normalize(),
            point: ends[1],
        },
    ]
}

/// Whether a row is violated by one of the motions, which would bring its pair below the target.
fn is_violated(contact: &Contact, motions: &[Vector6], center: &Point3<f64>, target: f64) -> bool {
    let row = contact_jacobian(&contact.normal, &contact.point_on_obstacle, center);
    let mut all = motions.iter();
    all.any(|motion| contact.gap + row.dot(motion) < target)
}

/// Whichever side the primitive is on: all that is near is found, all that is nearer than where a search was given up, and all that motions violate.
#[test]
fn no_contact_with_a_primitive_is_passed_over() {
    let mesh = bumpy_ball(13, 16);
    let (reach, target) = (0.08, 1e-3);
    let workspace = &mut CollisionWorkspace::with_candidates(1 << 12);
    let mut seen = [[0; 4]; 3];
    for (which, k) in (0..4).flat_map(|which| (0..600_u32).map(move |k| (which, k))) {
        let primitive = &primitives()[which];
        let u = f64::from(k);
        let mesh_moves = k % 2 == 0 || which == 3;
        let (body, obstacle): (Collider, Collider) = if mesh_moves {
            ((&mesh).into(), Collider::Primitive(primitive))
        } else {
            (Collider::Primitive(primitive), (&mesh).into())
        };
        let away = Vector3::new((1.3 * u).sin(), (0.7 * u).cos(), (2.1 * u).sin());
        let turn = Vector3::new((0.9 * u).cos(), (1.7 * u).sin(), (0.3 * u).cos());
        let at = Pose::new(Vector3::new(0.4, 0.1, -0.2), turn * 0.7);
        let pose = at * Pose::new(away.normalize() * (0.14 + 0.0001 * u), turn * 2.0);
        let placement = Placement::of(&pose, &at);
        let facing = Facing::new(body, obstacle, &placement, 0, Reach::new(reach));
        let mut expected = Vec::new();
        for t in 0..mesh.triangles().len() as u32 {
            let pieces = if mesh_moves { [t, 0] } else { [0, t] };
            for_contacts(&facing, pieces, &mut Work::default(), |contact, implied| {
                if !implied && contact.gap >= 0.0 {
                    expected.push(in_world(&contact, &at));
                }
            });
        }
        let work = &mut Work::default();
        for pairs in [u64::MAX, 150] {
            let mut found = Vec::with_capacity(1 << 11);
            let collected = collect_bounded(
                (body, &pose),
                (obstacle, &at),
                0,
                reach,
                pairs,
                workspace,
                &mut found,
                work,
            );
            let bounded = usize::from(pairs < u64::MAX);
            assert!(bounded == 1 || collected.complete_within == reach);
            for contact in expected
                .iter()
                .filter(|c| c.gap < collected.complete_within)
            {
                let is_found = found.iter().any(|c| c.features == contact.features);
                assert!(is_found, "{which} {k}: {contact:?}");
                seen[bounded][which] += 1;
            }
        }
        let center = pose * Point3::new(0.01, -0.02, 0.03);
        let motions = [0.0, 1.0, 2.0].map(|shift| {
            let v = u + shift;
            let by = Vector3::new((3.0 * v).sin(), (5.0 * v).cos(), (4.0 * v).sin());
            let about = Vector3::new((2.0 * v).cos(), (11.0 * v).sin(), (7.0 * v).cos());
            six(&(by * 0.02), &(about * 0.1))
        });
        let asked = Violated {
            motions: &motions,
            center,
            target,
            reach,
            known_within: 0.0,
            pairs: u64::MAX,
        };
        let mut found = Vec::new();
        let placed = ((body, &pose), (obstacle, &at));
        for_violated(placed.0, placed.1, 0, &asked, workspace, work, |contact| {
            found.push(contact.features);
        });
        for contact in &expected {
            if is_violated(contact, &motions, &center, target) {
                assert!(
                    found.contains(&contact.features),
                    "{which} {k}: {contact:?}"
                );
                seen[2][which] += 1;
            }
        }
    }
    println!("{seen:?} found");
    assert!(seen.iter().flatten().all(|count| *count > 40), "{seen:?}");
}
