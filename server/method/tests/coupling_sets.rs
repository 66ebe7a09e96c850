//! What the coupling keeps from set to set is no history: without adaptation, its force is that of a coupling made anew.

use crate::support;

use crate::projection_support::Random;
use god_object::constraint::{Feature, FeaturePair};
use god_object::nalgebra::{Point3, Vector3};
use god_object::{
    ConstraintSet, Coupling, NonPenetrationConstraint, Pose, ProjectionStatus, Settings,
};
use std::collections::BTreeSet;

fn set_of(names: &BTreeSet<u32>, sequence: u64, pose: Pose) -> ConstraintSet {
    let mut set = ConstraintSet::with_capacity(names.len());
    set.sequence = sequence;
    set.god_object_pose = pose;
    for name in names {
        let random = &mut Random(u64::from(*name));
        set.constraints.push(NonPenetrationConstraint {
            features: FeaturePair {
                obstacle: 0,
                on_body: Feature::Vertex(*name),
                on_obstacle: Feature::Face(name % 7),
            },
            point: Point3::from(random.vector3() * 0.03),
            normal: random.direction(),
            gap: 1e-4 * random.unit(),
            obstacle_displacement: Vector3::zeros(),
            separation: god_object::constraint::Separation::default(),
            shading_normal: None,
        });
    }
    set
}

#[test]
fn sets_whose_rows_come_go_and_change_places_give_the_force_of_a_fresh_start() {
    let world = support::box_on_table();
    let settings = Settings {
        adaptation: None,
        ..Settings::for_size(0.1)
    };
    let random = &mut Random(41);
    let mut kept = Coupling::new(&world, &settings);
    let mut names: BTreeSet<u32> = (0..20).collect();
    let mut pushed = 0;
    for sequence in 0..400 {
        for _ in 0..random.below(6) {
            let name = random.below(120) as u32;
            if !names.remove(&name) {
                names.insert(name);
            }
        }
        let pose = Pose::new(random.vector3() * 1e-4, random.vector3() * 1e-2);
        let set = set_of(&names, sequence, pose);
        for sample in 0..3 {
            let time = sequence as f64 * 1e-3 + f64::from(sample) * 3e-4;
            let device = Pose::new(random.vector3() * 1e-3, random.vector3() * 1e-2);
            let felt = kept.step(time, &device, &set);
            let fresh = Coupling::new(&world, &settings).step(time, &device, &set);
            assert_eq!(felt.status, ProjectionStatus::Solved);
            assert!(felt.kkt <= 1e-12, "{:e}", felt.kkt);
            let difference = (felt.wrench - fresh.wrench).norm();
            assert!(
                difference <= 1e-9 * (1.0 + fresh.wrench.norm()),
                "set {sequence}: {difference:e}"
            );
            pushed += usize::from(felt.active > 0);
        }
    }
    assert!(pushed > 600, "most samples touch: {pushed}");
}

#[test]
fn a_pose_or_a_row_that_is_broken_gives_no_force_and_the_next_set_does() {
    let world = support::box_on_table();
    let settings = Settings::for_size(0.1);
    let mut coupling = Coupling::new(&world, &settings);
    let names: BTreeSet<u32> = (0..20).collect();
    let device = Pose::translation(0.0, 0.0, -2e-3);
    let good = set_of(&names, 0, Pose::identity());
    let expected = coupling.step(0.0, &device, &good).wrench;
    assert!(expected.norm() > 0.0);

    let mut broken_row = set_of(&names, 1, Pose::identity());
    broken_row.constraints[7].gap = f64::NAN;
    broken_row.constraints[8].normal.x = f64::NAN;
    let broken_pose = set_of(&names, 2, Pose::translation(f64::NAN, 0.0, 0.0));
    for broken in [broken_row, broken_pose] {
        let output = coupling.step(0.001, &device, &broken);
        assert_eq!(output.status, ProjectionStatus::NotFinite);
        assert_eq!(output.wrench, god_object::Vector6::zeros());
    }
    let again = set_of(&names, 3, Pose::identity());
    let felt = coupling.step(1.0, &device, &again);
    assert_eq!(felt.status, ProjectionStatus::Solved);
    assert!((felt.wrench - expected).norm() <= 1e-9 * expected.norm());
}

/// Rows made ready by who publishes a set change its cost, not its force: whatever the device pose that was foreseen, and for whomever.
#[test]
fn sets_made_ready_give_the_force_of_those_that_are_not() {
    let world = support::box_on_table();
    let settings = Settings {
        adaptation: None,
        ..Settings::for_size(0.1)
    };
    let other = Settings {
        k_s: 0.25,
        rest_distance: 2e-5,
        ..settings
    };
    let random = &mut Random(43);
    let mut given = Coupling::new(&world, &settings);
    let mut ready = Coupling::new(&world, &settings);
    let mut published = ConstraintSet::with_capacity(130);
    let mut pushed = 0;
    for sequence in 0..300 {
        let names: BTreeSet<u32> = (0..1 + random.below(60))
            .map(|_| random.below(120) as u32)
            .collect();
        let pose = Pose::new(random.vector3() * 1e-4, random.vector3() * 1e-2);
        let set = set_of(&names, sequence, pose);
        let mut made = set.clone();
        let foreseen = Pose::new(random.vector3() * 1e-3, random.vector3() * 1e-2);
        match sequence % 4 {
            0 => made.prepare(&world.body, &settings, None),
            1 => made.prepare(&world.body, &settings, Some(&foreseen)),
            2 => made.prepare(
                &world.body,
                &settings,
                Some(&Pose::translation(f64::NAN, 0.0, 0.0)),
            ),
            _ => made.prepare(&world.body, &other, Some(&foreseen)),
        }
        published.clone_from(&made);
        for sample in 0..3 {
            let time = sequence as f64 * 1e-3 + f64::from(sample) * 3e-4;
            let device = Pose::new(random.vector3() * 1e-3, random.vector3() * 1e-2);
            let expected = given.step(time, &device, &set);
            let felt = ready.step(time, &device, &published);
            assert_eq!(felt.status, ProjectionStatus::Solved);
            assert!(felt.kkt <= 1e-12, "{:e}", felt.kkt);
            let difference = (felt.wrench - expected.wrench).norm();
            assert!(
                difference <= 1e-9 * (1.0 + expected.wrench.norm()),
                "set {sequence}: {difference:e}"
            );
            pushed += usize::from(felt.active > 0);
        }
    }
    assert!(pushed > 400, "most samples touch: {pushed}");
}
