//! The whole method on a box over a table: forces in closed form, invariants on any input.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use crate::support::{box_body, box_obstacle, box_on_table, penetrates};
use god_object::nalgebra::{Quaternion, UnitQuaternion, Vector3};
use god_object::spatial::{angular, linear};
use god_object::{Coupling, GodObject, Pose, ProjectionStatus, Settings, World};
use proptest::prelude::*;

const HALF_HEIGHT: f64 = 0.01;
const STIFFNESS: f64 = 1000.0;

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::from_parts(Vector3::new(x, y, z).into(), UnitQuaternion::identity())
}

fn start() -> Pose {
    at(0.0, 0.0, 0.03)
}

fn loops() -> (GodObject, Coupling, Settings) {
    let world = box_on_table();
    let settings = Settings::for_size(0.04);
    let coupling = Coupling::new(&world, &settings);
    (
        GodObject::new(world, settings, start()).expect("a free start"),
        coupling,
        settings,
    )
}

#[test]
fn free_space_has_no_force_and_the_body_follows() {
    let (mut god_object, mut coupling, _) = loops();
    for i in 0..200 {
        let t = f64::from(i) * 1e-3;
        let device = Pose::new(
            Vector3::new(0.1 * (9.0 * t).sin(), 0.1 * (7.0 * t).cos(), 0.2),
            Vector3::new(t, -2.0 * t, 0.5 * t),
        );
        god_object.step(&device, None);
        let felt = coupling.step(t, &device, god_object.constraint_set());
        assert!(
            felt.wrench.iter().all(|&component| component == 0.0),
            "{}",
            felt.wrench
        );
        if i > 60 {
            let lag = (god_object.pose().translation.vector - device.translation.vector).norm();
            assert!(lag < 3e-3, "{lag}");
        }
    }
}

#[test]
fn pushing_down_gives_stiffness_times_depth_and_nothing_else() {
    let (mut god_object, mut coupling, settings) = loops();
    let depth = 5e-3;
    let device = at(0.0, 0.0, HALF_HEIGHT - depth);
    for _ in 0..60 {
        god_object.step(&device, None);
    }
    let felt = coupling.step(1.0, &device, god_object.constraint_set());
    // The surface felt lies one rest distance above the true one.
    let expected = STIFFNESS * (depth + settings.rest_distance);
    assert!(
        (linear(&felt.wrench).z - expected).abs() < 1e-6,
        "{}",
        felt.wrench
    );
    assert!(linear(&felt.wrench).xy().norm() < 1e-6, "{}", felt.wrench);
    assert!(angular(&felt.wrench).norm() < 1e-6, "{}", felt.wrench);
    let rest = god_object.pose().translation.vector.z - HALF_HEIGHT;
    assert!(
        (rest - settings.rest_distance).abs() < 0.01 * settings.rest_distance,
        "{rest}"
    );
}

#[test]
fn push_slide_lift_has_no_friction_and_no_sticking() {
    let (mut god_object, mut coupling, _) = loops();
    for i in 0..2000 {
        let t = f64::from(i) * 1e-3;
        let z = if t < 1.0 {
            HALF_HEIGHT - 5e-3
        } else {
            HALF_HEIGHT - 5e-3 + 0.05 * (t - 1.0)
        };
        let device = at(0.1 * t, 0.0, z);
        god_object.step(&device, None);
        let felt = coupling.step(t, &device, god_object.constraint_set());
        assert!(
            felt.wrench[0].abs() <= 1e-9 * linear(&felt.wrench).norm().max(1.0),
            "{t} {}",
            felt.wrench
        );
        if t > 0.1 && t < 1.0 {
            assert!((felt.wrench[2] - 5.0).abs() < 0.02, "{t} {}", felt.wrench);
        }
        if z > HALF_HEIGHT + 1e-4 {
            assert_eq!(linear(&felt.wrench), Vector3::zeros(), "sticks at {t}");
        }
    }
}

#[test]
fn look_ahead_makes_the_force_grow_smoothly_at_any_update_rate() {
    // 0.3 m/s into 1000 N/m is 0.3 N each millisecond; without look-ahead the first force is a step of newtons.
    for period_ms in [1, 3, 14] {
        let (mut god_object, mut coupling, _) = loops();
        let mut last = 0.0;
        for i in 0..120 {
            let t = f64::from(i) * 1e-3;
            let device = at(0.0, 0.0, 0.03 - 0.3 * t);
            if i % period_ms == 0 {
                god_object.step(&device, None);
            }
            let force = coupling
                .step(t, &device, god_object.constraint_set())
                .wrench[2];
            if force < 15.0 {
                assert!(
                    force - last <= 0.301,
                    "{period_ms} ms: {last} to {force} N at {t}"
                );
            }
            last = force;
        }
        assert!(last > 10.0);
    }
}

/// A set is used until the second update after its own: one is made meanwhile, and one travels.
#[test]
fn a_cube_of_a_millimetre_is_felt_where_it_crosses_at_any_speed_and_rate() {
    const HALF: f64 = 5e-4;
    let mut world = World::clone(&box_on_table());
    world.body = box_body(Vector3::repeat(HALF));
    let world = Arc::new(world);
    let settings = Settings::for_size(2.0 * HALF);
    let speeds = [0.5, 2.0, 5.0];
    for (period_ms, speed) in [1, 3, 14].into_iter().flat_map(|p| speeds.map(|v| (p, v))) {
        for phase in 0..period_ms {
            // In free space for long enough that the speed is known.
            let height = |t: f64| 0.4 - speed * (t - 1e-3 * f64::from(phase));
            let mut god_object =
                GodObject::new(world.clone(), settings, at(0.0, 0.0, height(0.0))).expect("free");
            let mut coupling = Coupling::new(&world, &settings);
            let mut used = god_object.constraint_set().clone();
            let samples = (0.43 / speed * 1e3) as u32 + period_ms;
            let mut largest = 0.0;
            for i in 0..samples {
                let t = f64::from(i) * 1e-3;
                let device = at(0.0, 0.0, height(t));
                if i % period_ms == 0 {
                    used = god_object.constraint_set().clone();
                    god_object.step(&device, None);
                }
                let force = coupling.step(t, &device, &used).wrench[2];
                let depth = HALF + settings.rest_distance - height(t);
                let right = (STIFFNESS * depth).clamp(0.0, settings.force_limit);
                assert!(
                    (force - right).abs() < 1e-6,
                    "{period_ms} ms, {speed} m/s, phase {phase}: {force} N at {t}, and not {right}"
                );
                largest = right.max(largest);
            }
            assert_eq!(largest, settings.force_limit);
        }
    }
}

#[test]
fn a_body_at_rest_does_not_move_by_a_single_bit() {
    let (mut god_object, mut coupling, _) = loops();
    let device = Pose::new(
        Vector3::new(0.003, -0.002, 0.005),
        Vector3::new(0.2, -0.1, 0.4),
    );
    for _ in 0..200 {
        god_object.step(&device, None);
    }
    let rest = *god_object.pose();
    let force = coupling
        .step(0.0, &device, god_object.constraint_set())
        .wrench;
    for i in 1..200 {
        god_object.step(&device, None);
        assert_eq!(*god_object.pose(), rest);
        let now = coupling
            .step(f64::from(i) * 1e-3, &device, god_object.constraint_set())
            .wrench;
        assert!((now - force).norm() < 1e-12);
    }
}

#[test]
fn a_tilted_push_ends_on_the_edge_that_the_minimum_asks_for() {
    let (mut god_object, _, _) = loops();
    // Tilted about y by 0.3 rad and pushed in: the low edge rests on the table.
    let device = Pose::new(Vector3::new(0.0, 0.0, 0.012), Vector3::new(0.0, 0.3, 0.0));
    for _ in 0..200 {
        god_object.step(&device, None);
    }
    let world = box_on_table();
    let lowest = world
        .body
        .mesh
        .vertices()
        .iter()
        .map(|v| (god_object.pose() * v).z)
        .fold(f64::INFINITY, f64::min);
    assert!(lowest > 0.0 && lowest < 2e-5, "{lowest}");
    assert!(!penetrates(&world, god_object.pose()));
}

#[test]
fn a_broken_device_pose_moves_nothing_and_gives_no_force() {
    let (mut god_object, mut coupling, _) = loops();
    god_object.step(&at(0.0, 0.0, 0.005), None);
    let before = *god_object.pose();
    for broken in [f64::NAN, f64::INFINITY] {
        let report = god_object.step(&at(broken, 0.0, 0.0), None);
        assert!(report.rejected);
        assert_eq!(*god_object.pose(), before);
        let felt = coupling.step(0.0, &at(broken, 0.0, 0.0), god_object.constraint_set());
        assert_eq!(felt.status, ProjectionStatus::NotFinite);
        assert_eq!(felt.wrench.norm(), 0.0);
    }
}

#[test]
fn a_jump_through_the_table_stops_above_it() {
    let (mut god_object, _, _) = loops();
    for _ in 0..100 {
        god_object.step(
            &Pose::new(Vector3::new(0.05, 0.0, -0.4), Vector3::new(2.0, 0.0, 0.0)),
            None,
        );
        assert!(god_object.pose().translation.vector.z > 0.0);
        assert!(!penetrates(&box_on_table(), god_object.pose()));
    }
}

#[test]
fn starting_inside_an_obstacle_is_refused_by_name() {
    let world = box_on_table();
    let refused = GodObject::new(world.clone(), Settings::for_size(0.04), at(0.0, 0.0, 0.005));
    assert!(refused.is_err_and(|e| e.to_string().contains("table")));
    // Wholly inside: no triangles cross.
    let refused = GodObject::new(world, Settings::for_size(0.04), at(0.0, 0.0, -0.05));
    assert!(refused.is_err_and(|e| e.to_string().contains("table")));
}

/// Lower, the collision search could tell no motion from one into the table: the body stayed where it was, whatever the hand did.
#[test]
fn a_start_however_near_is_refused_or_the_body_can_leave() {
    let half = 0.1;
    let settings = Settings::for_size(2.0 * half);
    let (mut refused, mut left) = (0, 0);
    for top in [0.0, 0.1, 1.0, 100.1, 1e4] {
        for exponent in -17..=-3 {
            for digit in [1.0, 2.0, 5.0] {
                let gap = digit * 10.0_f64.powi(exponent);
                let world = Arc::new(World {
                    body: box_body(Vector3::repeat(half)),
                    obstacles: vec![box_obstacle(
                        "table",
                        Vector3::new(0.5, 0.5, 0.05),
                        Vector3::new(0.0, 0.0, top - 0.05),
                    )],
                });
                let start = top + half + gap;
                let mut god_object = match GodObject::new(world, settings, at(0.0, 0.0, start)) {
                    Ok(god_object) => god_object,
                    Err(error) => {
                        assert!(gap < settings.minimum_gap && error.to_string().contains("table"));
                        refused += 1;
                        continue;
                    }
                };
                for push in [0.0, -0.01] {
                    for _ in 0..10 {
                        god_object.step(&at(0.0, 0.0, start + push), None);
                    }
                }
                for _ in 0..40 {
                    god_object.step(&at(0.0, 0.0, start + 0.1), None);
                }
                let height = god_object.pose().translation.vector.z - start;
                assert!(height > 0.09, "{gap} m above {top} m: risen by {height} m");
                left += 1;
            }
        }
    }
    assert!(refused > 20 && left > 100, "{refused} {left}");
}

#[test]
fn half_a_turn_at_once_is_half_a_turn_in_parts_of_less_than_a_quarter() {
    let world = box_on_table();
    let settings = Settings {
        k_s: 1.0,
        ..Settings::for_size(0.04)
    };
    let axes = [
        Vector3::x(),
        Vector3::y(),
        Vector3::z(),
        -Vector3::z(),
        Vector3::new(0.6, 0.0, 0.8),
        Vector3::new(0.36, 0.48, -0.8),
    ];
    // Free, and so near that the corners pass the table by a tenth of a millimetre.
    for height in [0.5, 0.0301] {
        for axis in axes {
            let start = at(0.0, 0.0, height);
            let mut god_object =
                GodObject::new(world.clone(), settings, start).expect("a free start");
            let half_turn = Quaternion::from_imag(axis);
            let device =
                Pose::from_parts(start.translation, UnitQuaternion::new_unchecked(half_turn));
            let mut turned = 0.0;
            for _ in 0..3 {
                let before = god_object.pose().rotation;
                let report = god_object.step(&device, None);
                // No update turns the body so far that it might as well have gone the other way.
                let turn = god_object.pose().rotation.angle_to(&before);
                assert!(turn < FRAC_PI_2, "{axis} at {height}: {turn}");
                assert!(
                    report.substeps <= 3 && !report.unfinished,
                    "{axis} at {height}: {report:?}"
                );
                turned += turn;
            }
            let off = god_object.pose().rotation.angle_to(&device.rotation);
            assert!(off < 1e-6, "{axis} at {height}: {off}");
            assert!((turned - PI).abs() < 1e-3, "{axis} at {height}: {turned}");
        }
    }
}

#[test]
fn force_is_clamped_by_norm_with_its_direction_kept() {
    let (mut god_object, mut coupling, settings) = loops();
    let device = at(0.0, 0.0, HALF_HEIGHT - 0.1);
    for _ in 0..60 {
        god_object.step(&device, None);
    }
    let felt = coupling.step(1.0, &device, god_object.constraint_set());
    assert!(felt.saturated);
    assert!(
        (linear(&felt.wrench) - Vector3::z() * settings.force_limit).norm() < 1e-6,
        "{}",
        felt.wrench
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever the device does, the god-object never intersects the table, and never generates energy in a step:
    /// the force never points further into the table.
    #[test]
    fn no_device_path_drives_the_body_into_the_table(
        poses in prop::collection::vec(
            (prop::array::uniform3(-0.06..0.06f64), prop::array::uniform3(-2.0..2.0f64)), 1..25),
    ) {
        let (mut god_object, mut coupling, settings) = loops();
        let world = box_on_table();
        for (i, (p, r)) in poses.iter().enumerate() {
            let device = Pose::new(Vector3::from(*p), Vector3::from(*r));
            for repeat in 0..3 {
                let report = god_object.step(&device, None);
                prop_assert!(report.gap_min >= settings.minimum_gap, "gap {}", report.gap_min);
                prop_assert!(!penetrates(&world, god_object.pose()));
                let t = (i * 3 + repeat) as f64 * 1e-3;
                let felt = coupling.step(t, &device, god_object.constraint_set());
                prop_assert_eq!(felt.status, ProjectionStatus::Solved);
                prop_assert!(felt.wrench[2] >= -1e-9, "pulled down: {}", felt.wrench);
                prop_assert!(linear(&felt.wrench).norm() <= settings.force_limit * (1.0 + 1e-12));
            }
        }
    }
}
