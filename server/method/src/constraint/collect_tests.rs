//! The trees lead to every contact, however far apart the surfaces are.

use std::collections::BTreeSet;

use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::collect::{collect_contacts, for_contacts};
use super::facing::{Facing, Reach};
use super::{Contact, FeaturePair};
use crate::collision::{CollisionWorkspace, Placement, Work, bumpy_ball};
use crate::spatial::Pose;

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
                for_contacts(&facing, [a, b], &mut Work::default(), |contact: Contact| {
                    expected.insert(contact.features);
                });
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
