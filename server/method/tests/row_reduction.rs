//! Few rows instead of all: same force and motion as every facing pair, no ghost edges, no flicker, no allocation.

use std::sync::Arc;

use crate::geometry_shapes::{
    Soup, cuboid, fine_hole, fine_peg, grid_box, hole, mesh, peg, roughened,
};
use assert_no_alloc::assert_no_alloc;
use god_object::collision::{CollisionWorkspace, Work};
use god_object::constraint::{FeaturePair, collect_contacts, contact_jacobian};
use god_object::geometry::mass_properties;
use god_object::nalgebra::{Point3, UnitQuaternion, Vector3};
use god_object::quasi_statics::{HalfSpace, Projection, Projector, SolverKind};
use god_object::spatial::{angular, linear, pose_difference, six};
use god_object::{Body, Coupling, GodObject, Obstacle, Pose, Settings, Surface, Vector6, World};

const STEPS: usize = 300;

fn world(body: Soup, obstacle: Soup, pose: Pose) -> Arc<World> {
    let body = mesh(body);
    let solid = mass_properties(&body);
    Arc::new(World {
        body: Body {
            primitive: None,
            mesh: body,
            mass: 1.0,
            inertia: solid.inertia_per_density / solid.volume,
            reference_point: Point3::origin(),
        },
        obstacles: vec![Obstacle {
            primitive: None,
            name: "obstacle".into(),
            mesh: mesh(obstacle),
            pose,
            surface: Surface::default(),
        }],
    })
}

/// No ramps: the force is that of the set.
fn settings(size: f64) -> Settings {
    Settings {
        adaptation: None,
        force_limit: 1e3,
        torque_limit: 1e3,
        ..Settings::for_size(size)
    }
}

fn hole_pose() -> Pose {
    Pose::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.7, -0.4, 1.1))
}

fn peg_in_hole() -> Arc<World> {
    world(
        peg(8e-3, 0.025, 72),
        hole(8.06e-3, 0.025, 0.02, 72),
        hole_pose(),
    )
}

/// Pressed to the side in the hole, around it, along it, tilted and turned.
fn hand(k: usize) -> Pose {
    let t = k as f64 * 1e-3;
    let push = 1.5e-3 * (20.0 * t).min(1.0);
    let at = Vector3::new(
        push * (4.0 * t).cos(),
        push * (4.0 * t).sin(),
        3e-3 * (20.0 * t).sin(),
    );
    let tilt = Vector3::new(0.02 * (15.0 * t).sin(), 0.01 * (11.0 * t).sin(), t);
    hole_pose() * Pose::from_parts(at.into(), UnitQuaternion::from_scaled_axis(tilt))
}

/// Every facing pair within `reach` (m) of a pose, as rows of the coupling for the whole difference.
fn every_row(world: &World, pose: &Pose, reach: f64, rest_distance: f64) -> Vec<HalfSpace> {
    let mut contacts = Vec::with_capacity(1 << 15);
    let obstacle = &world.obstacles[0];
    let collected = collect_contacts(
        &world.body.mesh,
        pose,
        &obstacle.mesh,
        &obstacle.pose,
        0,
        reach,
        &mut CollisionWorkspace::with_candidates(1 << 16),
        &mut contacts,
        &mut Work::default(),
    );
    assert!(!collected.truncated);
    let center = Point3::from(pose.translation.vector);
    contacts
        .iter()
        .map(|c| HalfSpace {
            jacobian: contact_jacobian(&c.normal, &c.point_on_obstacle, &center),
            bound: (rest_distance - c.gap).min(0.0),
        })
        .collect()
}

fn set_rows(god_object: &GodObject, rest_distance: f64) -> Vec<HalfSpace> {
    let set = god_object.constraint_set();
    let center = Point3::from(god_object.pose().translation.vector);
    set.constraints
        .iter()
        .map(|c| HalfSpace {
            jacobian: contact_jacobian(&c.normal, &c.point, &center),
            bound: (rest_distance - c.gap).min(0.0),
        })
        .collect()
}

fn projection(
    world: &World,
    god_object: &GodObject,
    rows: &[HalfSpace],
    a: &Vector6,
) -> Projection {
    let metric = world
        .body
        .metric(god_object.settings().rotation_metric, god_object.pose())
        .expect("a metric");
    let mut projector = Projector::new(SolverKind::ActiveSet, rows.len());
    projector.project(&metric, a, rows, &[])
}

fn projected(world: &World, god_object: &GodObject, rows: &[HalfSpace], a: &Vector6) -> Vector6 {
    projection(world, god_object, rows, a).acceleration
}

#[test]
fn few_rows_give_the_force_of_all_that_are_within_reach() {
    let world = peg_in_hole();
    let settings = settings(0.05);
    let mut god_object =
        GodObject::new(Arc::clone(&world), settings, hole_pose()).expect("a free start");
    let mut coupling = Coupling::new(&world, &settings);
    let radius = world.body.mesh.radius_about(&Point3::origin());
    let (mut compared, mut most_rows, mut bounded) = (0, 0, 0);
    // In the end the hand rests.
    let hand = |k: usize| hand(k.min(STEPS));
    for k in 0..STEPS + 20 {
        god_object.step(&hand(k), None);
        let set = god_object.constraint_set();
        most_rows = most_rows.max(set.constraints.len());
        if !k.is_multiple_of(10) && k < STEPS {
            continue;
        }
        // The device has gone on when the force is computed.
        for device in [hand(k), hand(k + 1)] {
            let felt = coupling.step(k as f64 * 1e-3, &device, set);
            let difference = pose_difference(&device, god_object.pose(), &Vector3::zeros());
            let reach = linear(&difference).norm()
                + radius * angular(&difference).norm()
                + 2.0 * settings.rest_distance;
            let rows = every_row(&world, god_object.pose(), reach, settings.rest_distance);
            let full = projection(&world, &god_object, &rows, &difference);
            let a_c = full.acceleration;
            let expected = (linear(&a_c) - linear(&difference)) * settings.stiffness(1.0);
            let error = (linear(&felt.wrench) - expected).norm();
            assert!(
                error <= 0.01 * expected.norm().max(0.2),
                "step {k}: {} N instead of {} N by {} rows",
                linear(&felt.wrench).norm(),
                expected.norm(),
                rows.len()
            );
            compared += usize::from(expected.norm() > 0.5);
            // The stated bound is for the pose that the set was made for, and for what the way reaches.
            let way = linear(&a_c).norm() + radius * angular(&a_c).norm();
            if device == hand(k) && way + 2.0 * settings.rest_distance <= set.complete_within {
                let stiffness = settings.stiffness(1.0);
                let forces: f64 = full.active.iter().map(|row| row.multiplier).sum();
                let stated = set.force_error_bound(stiffness, stiffness * forces);
                assert!(error <= stated + 1e-9, "step {k}: {error} N, {stated} N");
                bounded += 1;
            }
        }
    }
    assert!(bounded > 20, "{bounded}");
    assert!(compared > 30 && most_rows <= 150, "{compared} {most_rows}");
}

#[test]
fn a_set_with_little_room_has_what_holds_the_device_and_tells_what_it_dropped() {
    let world = peg_in_hole();
    for max_constraints in [8, 32, 64, 1024] {
        let settings = Settings {
            max_constraints,
            ..settings(0.05)
        };
        let mut god_object =
            GodObject::new(Arc::clone(&world), settings, hole_pose()).expect("a free start");
        let mut coupling = Coupling::new(&world, &settings);
        let radius = world.body.mesh.radius_about(&Point3::origin());
        let (mut compared, mut told) = (0, 0);
        for k in 0..STEPS {
            let device = hand(k);
            let report = god_object.step(&device, None);
            let set = god_object.constraint_set();
            assert!(set.constraints.len() <= max_constraints);
            told += usize::from(set.truncated);
            if !set.truncated {
                assert!(set.reduction_error <= settings.rest_distance, "step {k}");
            }
            if !k.is_multiple_of(10) {
                continue;
            }
            assert!(
                !report.unfinished,
                "step {k} with room for {max_constraints}"
            );
            let felt = coupling.step(k as f64 * 1e-3, &device, set);
            let difference = pose_difference(&device, god_object.pose(), &Vector3::zeros());
            let reach = linear(&difference).norm()
                + radius * angular(&difference).norm()
                + 2.0 * settings.rest_distance;
            let rows = every_row(&world, god_object.pose(), reach, settings.rest_distance);
            let a_c = projected(&world, &god_object, &rows, &difference);
            let expected = (linear(&a_c) - linear(&difference)) * settings.stiffness(1.0);
            let error = (linear(&felt.wrench) - expected).norm();
            assert!(
                error <= 0.01 * expected.norm().max(0.2),
                "step {k} with room for {max_constraints}: off by {error} N of {} N",
                expected.norm()
            );
            compared += usize::from(expected.norm() > 0.5);
        }
        assert!(compared > 15, "{compared}");
        assert!(
            told == 0 || max_constraints < 64,
            "{max_constraints}: {told}"
        );
        assert!(told > 0 || max_constraints > 8, "{max_constraints}: {told}");
    }
}

#[test]
fn rough_walls_are_felt_as_by_all_rows_however_fast_the_peg_slides() {
    let peg = roughened(fine_peg(10e-3, 30e-3, 120, 112), 1e-6, 1);
    let hole = roughened(fine_hole(10.1e-3, 30e-3, 25e-3, 120, 109), 1e-6, 2);
    let world = world(peg, hole, hole_pose());
    let settings = settings(0.06);
    let mut god_object =
        GodObject::new(Arc::clone(&world), settings, hole_pose()).expect("a free start");
    let mut coupling = Coupling::new(&world, &settings);
    let radius = world.body.mesh.radius_about(&Point3::origin());
    // Pressed to the side by 2 mm, and along the hole at 0.35 m/s at most.
    let hand = |k: usize| {
        let t = k as f64 * 1e-3;
        let (push, z) = (2e-3 * (50.0 * t).min(1.0), 0.01 * (35.0 * t).sin());
        let at = Vector3::new(push * (0.4 + t).cos(), push * (0.4 + t).sin(), z);
        hole_pose() * Pose::translation(at.x, at.y, at.z)
    };
    let mut compared = 0;
    for k in 0..200 {
        god_object.step(&hand(k), None);
        let device = hand(k + 1);
        let felt = coupling.step(k as f64 * 1e-3, &device, god_object.constraint_set());
        if k % 2 != 0 || k < 20 {
            continue;
        }
        let difference = pose_difference(&device, god_object.pose(), &Vector3::zeros());
        let reach = linear(&difference).norm()
            + radius * angular(&difference).norm()
            + 2.0 * settings.rest_distance;
        let rows = every_row(&world, god_object.pose(), reach, settings.rest_distance);
        let a_c = projected(&world, &god_object, &rows, &difference);
        let expected = (linear(&a_c) - linear(&difference)) * settings.stiffness(1.0);
        let error = (linear(&felt.wrench) - expected).norm();
        assert!(expected.norm() > 1.0, "step {k}: {} N", expected.norm());
        assert!(
            error <= 0.01 * expected.norm(),
            "step {k}: off by {error} N of {} N, {} rows",
            expected.norm(),
            rows.len()
        );
        compared += 1;
    }
    assert_eq!(compared, 90);
}

#[test]
fn motions_within_reach_of_the_device_violate_no_row_by_more_than_the_rest_distance() {
    let world = peg_in_hole();
    let settings = settings(0.05);
    let mut god_object =
        GodObject::new(Arc::clone(&world), settings, hole_pose()).expect("a free start");
    let mut seed = 1_u64;
    let mut signed = || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut held = 0;
    for k in 0..STEPS {
        god_object.step(&hand(k), None);
        if k < 60 || !k.is_multiple_of(20) {
            continue;
        }
        let stated = god_object.constraint_set().reduction_error;
        assert!(stated <= 0.11 * settings.rest_distance, "{stated}");
        let all = every_row(&world, god_object.pose(), 6e-3, settings.rest_distance);
        let few = set_rows(&god_object, settings.rest_distance);
        let difference = pose_difference(&hand(k), god_object.pose(), &Vector3::zeros());
        for _ in 0..20 {
            let reach = 0.5 * settings.activation_distance;
            let random = six(
                &(Vector3::new(signed(), signed(), signed()) * reach),
                &(Vector3::new(signed(), signed(), signed()) * (reach / 0.026)),
            );
            let a_c = projected(&world, &god_object, &few, &(difference + random));
            held += usize::from(a_c != difference + random);
            let worst = all
                .iter()
                .map(|row| row.bound - row.jacobian.dot(&a_c))
                .fold(0.0, f64::max);
            assert!(
                worst <= settings.rest_distance,
                "step {k}: violated by {worst} m"
            );
        }
    }
    assert!(held > 100, "{held}");
}

#[test]
fn a_plane_of_ten_thousand_triangles_feels_like_one_of_two() {
    let size = 0.04;
    let start = Pose::translation(-0.05, 0.01, 0.0105);
    let on_cells = |cells: usize| {
        let floor = grid_box([0.1, 0.1, 0.01], [cells, cells, 1]);
        let box_soup = cuboid([0.02, 0.015, 0.01]);
        world(box_soup, floor, Pose::translation(0.0, 0.0, -0.01))
    };
    let (fine, coarse) = (on_cells(71), on_cells(1));
    let settings = settings(size);
    let mut sliding = GodObject::new(Arc::clone(&fine), settings, start).expect("a free start");
    let mut pressed = 0;
    for k in 0..400 {
        let t = f64::from(k) * 1e-3;
        let turn = Vector3::new(0.02 * (9.0 * t).sin(), 0.01, 0.5 * t);
        let z = 0.0105 - 2.5e-3 * (20.0 * t).min(1.0);
        let device = Pose::new(Vector3::new(-0.05 + 0.2 * t, 0.01, z), turn);
        sliding.step(&device, None);
        // The same pose over either plane.
        let felt = [&fine, &coarse].map(|world| {
            let there = GodObject::new(Arc::clone(world), settings, *sliding.pose());
            let there = there.expect("a free pose");
            Coupling::new(world, &settings).step(t, &device, there.constraint_set())
        });
        let [a, b] = felt.map(|f| f.wrench);
        let slid = Coupling::new(&fine, &settings).step(t, &device, sliding.constraint_set());
        let scale = linear(&b).norm().max(0.1);
        pressed += usize::from(scale > 0.5);
        assert!((a - b).norm() <= 1e-9 * scale, "step {k}: {a} {b}");
        assert!((slid.wrench - b).norm() <= 1e-9 * scale, "step {k}: {b}");
    }
    assert!(pressed > 300, "{pressed}");
}

#[test]
fn a_hand_at_rest_has_the_same_rows_in_every_set_and_runs_repeat() {
    let run = || {
        let world = peg_in_hole();
        let mut god_object =
            GodObject::new(world, settings(0.05), hole_pose()).expect("a free start");
        let mut rows: Vec<Vec<FeaturePair>> = Vec::new();
        for k in 0..200 {
            god_object.step(&hand(k.min(100)), None);
            let set = god_object.constraint_set();
            rows.push(set.constraints.iter().map(|row| row.features).collect());
        }
        rows
    };
    let rows = run();
    assert!(!rows[199].is_empty());
    for k in 180..200 {
        assert_eq!(rows[k], rows[179], "step {k}");
    }
    assert_eq!(rows, run());
}

#[test]
fn choosing_rows_does_not_allocate() {
    let world = peg_in_hole();
    let settings = settings(0.05);
    let mut coupling = Coupling::new(&world, &settings);
    let mut god_object = GodObject::new(world, settings, hole_pose()).expect("a free start");
    let mut rows = 0;
    for k in 0..STEPS {
        let device = hand(k);
        assert_no_alloc(|| {
            rows += god_object.step(&device, None).contacts;
            let _ = coupling.step(k as f64 * 1e-3, &device, god_object.constraint_set());
        });
    }
    assert!(rows > STEPS);
}
