//! Obstacles that move: the body is pushed and never passed through, at any speed, on thin plates, with rotation.

use std::sync::Arc;

use crate::support::{box_body, box_obstacle, penetrates};
use god_object::nalgebra::{UnitQuaternion, Vector3};
use god_object::spatial::linear;
use god_object::{Coupling, GodObject, Pose, ProjectionStatus, Settings, World};
use proptest::prelude::*;

/// A box of 40 x 40 x 20 mm; a plate of 200 x 200 mm and the given thickness below it, its upper face at z = 0; and a wall over it.
fn world(thickness: f64, ceiling: f64) -> Arc<World> {
    Arc::new(World {
        body: box_body(Vector3::new(0.02, 0.02, 0.01)),
        obstacles: vec![
            box_obstacle(
                "plate",
                Vector3::new(0.1, 0.1, 0.5 * thickness),
                Vector3::new(0.0, 0.0, -0.5 * thickness),
            ),
            box_obstacle(
                "ceiling",
                Vector3::new(0.1, 0.1, 0.01),
                Vector3::new(0.0, 0.0, ceiling + 0.01),
            ),
        ],
    })
}

fn loops(world: &Arc<World>) -> (GodObject, Coupling, Settings) {
    let settings = Settings::for_size(0.04);
    let start = Pose::translation(0.0, 0.0, 0.03);
    let god_object = GodObject::new(world.clone(), settings, start).expect("a free start");
    (god_object, Coupling::new(world, &settings), settings)
}

/// Independent of the method's collision code: every pair of triangles where everything is now.
pub(crate) fn overlaps(world: &World, god_object: &GodObject) -> bool {
    let mut now = world.clone();
    for (obstacle, pose) in now.obstacles.iter_mut().zip(god_object.obstacle_poses()) {
        obstacle.pose = *pose;
    }
    penetrates(&now, god_object.pose())
}

#[test]
fn a_plate_that_comes_up_under_a_still_hand_pushes_the_body_at_any_speed() {
    for thickness in [5e-3, 1e-4] {
        for speed in [0.1, 1.0, 5.0] {
            let world = world(thickness, 0.5);
            let (mut god_object, mut coupling, settings) = loops(&world);
            let device = Pose::translation(0.0, 0.0, 0.03);
            let period = 0.014;
            let rise = 0.04;
            let mut time = 0.0;
            let mut felt = 0.0;
            for update in 0..60 {
                time = f64::from(update) * period;
                let z = (speed * time).min(rise);
                assert!(
                    god_object.move_obstacle(0, &Pose::translation(0.0, 0.0, z - 0.5 * thickness))
                );
                let report = god_object.step(&device, None);
                assert_eq!(report.obstacles_blocked, 0, "{speed} m/s at {time}");
                assert!(report.gap_min >= settings.minimum_gap);
                assert!(!overlaps(&world, &god_object));
                assert!(
                    god_object.pose().translation.vector.z > z,
                    "passed through at {speed} m/s"
                );
                felt = coupling
                    .step(time, &device, god_object.constraint_set())
                    .wrench[2];
            }
            // At the end the body stands on the plate, 20 mm above the hand.
            let stood = god_object.pose().translation.vector.z - 0.01 - rise;
            assert!(
                (stood - settings.rest_distance).abs() < 0.02 * settings.rest_distance,
                "{stood} after {time}"
            );
            let depth = rise + 0.01 - 0.03 + settings.rest_distance;
            let expected = (settings.stiffness(1.0) * depth).min(settings.force_limit);
            assert!((felt - expected).abs() < 1e-3, "{felt} {expected}");
        }
    }
}

#[test]
fn the_force_of_a_rising_plate_grows_evenly_between_slow_updates() {
    // 0.1 m/s into 1000 N/m is 0.1 N each millisecond; without extrapolation it would be 1.4 N each 14 ms.
    let world = world(5e-3, 0.5);
    let (mut god_object, mut coupling, settings) = loops(&world);
    let device = Pose::translation(0.0, 0.0, 0.03);
    let (speed, period) = (0.1, 14);
    let mut last = 0.0;
    let mut largest: f64 = 0.0;
    for millisecond in 0..320 {
        let time = f64::from(millisecond) * 1e-3;
        if millisecond % period == 0 {
            god_object.move_obstacle(0, &Pose::translation(0.0, 0.0, speed * time - 2.5e-3));
            god_object.step(&device, None);
        }
        let force = coupling
            .step(time, &device, god_object.constraint_set())
            .wrench[2];
        if force < settings.force_limit {
            largest = largest.max((force - last).abs());
        }
        last = force;
    }
    assert!(last > 8.0, "{last}");
    assert!(largest <= 0.15, "a step of {largest} N");
}

/// Updates every 3.33 ms and 7.7 ms, that begin between the ticks of the force: 0.1 N each millisecond all the same.
#[test]
fn the_force_of_a_rising_plate_grows_evenly_whatever_the_ticks() {
    for period in [1.0 / 300.0, 1.0 / 130.0, 1.0 / 70.0] {
        let world = world(5e-3, 0.5);
        let (mut god_object, mut coupling, settings) = loops(&world);
        let device = Pose::translation(0.0, 0.0, 0.03);
        let (speed, mut next, mut last) = (0.1, 0.0, 0.0);
        let mut steps = Vec::new();
        for millisecond in 0..320 {
            let time = f64::from(millisecond) * 1e-3;
            while next <= time {
                god_object.move_obstacle(0, &Pose::translation(0.0, 0.0, speed * next - 2.5e-3));
                god_object.step(&device, None);
                god_object.note_published(next);
                next += period;
            }
            let force = coupling
                .step(time, &device, god_object.constraint_set())
                .wrench[2];
            if last > 0.5 && force < settings.force_limit {
                steps.push(force - last);
            }
            last = force;
        }
        let (least, most) = steps
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(low, high), step| {
                (low.min(*step), high.max(*step))
            });
        assert!(
            least > 0.095 && most < 0.105,
            "updates of {period} s: steps of {least} to {most} N"
        );
    }
}

#[test]
fn passivity_lets_a_plate_push_the_hand_with_the_plates_own_energy() {
    let world = world(5e-3, 0.5);
    let (mut god_object, mut plain, settings) = loops(&world);
    let mut passive = Coupling::new(
        &world,
        &Settings {
            passive: true,
            ..settings
        },
    );
    let mut felt = 0.0;
    for millisecond in 0..200 {
        let time = f64::from(millisecond) * 1e-3;
        // 5 mm into a hand that stands, then on with a hand that gives way: 5 N at 0.1 m/s.
        let face = 0.018 + 0.1 * time;
        let device = Pose::translation(0.0, 0.0, 0.03 + 0.1 * (time - 0.07).max(0.0));
        god_object.move_obstacle(0, &Pose::translation(0.0, 0.0, face - 2.5e-3));
        god_object.step(&device, None);
        let set = god_object.constraint_set();
        felt = plain.step(time, &device, set).wrench[2];
        assert_eq!(
            passive.step(time, &device, set).wrench[2],
            felt,
            "at {time} s"
        );
    }
    assert!((felt - 5.0).abs() < 0.1, "{felt}");
    let energy = passive.energy().expect("it is observed");
    // 13 mm at 5 N.
    assert!(
        (energy.highest() - 5.0 * 0.013).abs() < 2e-3,
        "{}",
        energy.highest()
    );
    assert_eq!(energy.generated(), 0.0);
    // And what compressed the coupling.
    let spring = 0.5 * settings.stiffness(1.0) * 0.005 * 0.005;
    let expected = 5.0 * 0.013 + spring;
    assert!(
        (plain.obstacle_work() - expected).abs() < 0.03 * expected,
        "{}",
        plain.obstacle_work()
    );
}

#[test]
fn a_body_between_plate_and_ceiling_stops_the_plate() {
    let world = world(2e-3, 0.05);
    let (mut god_object, _, settings) = loops(&world);
    let device = Pose::translation(0.0, 0.0, 0.03);
    let mut blocked = 0;
    for update in 0..80 {
        let z = 1e-3 * f64::from(update);
        god_object.move_obstacle(0, &Pose::translation(0.0, 0.0, z - 1e-3));
        let report = god_object.step(&device, None);
        blocked += report.obstacles_blocked;
        assert!(report.gap_min >= settings.minimum_gap);
        assert!(!overlaps(&world, &god_object));
    }
    assert!(blocked >= 45, "blocked in {blocked} updates");
    // 50 mm of room for 20 mm of body: the plate stands at about 30 mm.
    let plate = god_object
        .obstacle_poses()
        .next()
        .expect("a plate")
        .translation
        .vector
        .z
        + 1e-3;
    assert!(plate < 0.03 && plate > 0.03 - 1e-3, "{plate}");
    // It goes back when it is told to, and the body with the hand.
    god_object.move_obstacle(0, &Pose::translation(0.0, 0.0, -1e-3));
    for _ in 0..60 {
        assert_eq!(god_object.step(&device, None).obstacles_blocked, 0);
    }
    assert!((god_object.pose().translation.vector - device.translation.vector).norm() < 1e-6);
}

#[test]
fn a_plate_that_is_stopped_less_than_a_motion_short_of_its_target_has_arrived() {
    let world = world(2e-3, 0.05);
    let (mut god_object, _, settings) = loops(&world);
    let device = Pose::translation(0.0, 0.0, 0.03);
    let squeezed = (0..80).map(|update| {
        let z = 1e-3 * f64::from(update);
        god_object.move_obstacle(0, &Pose::translation(0.0, 0.0, z - 1e-3));
        god_object.step(&device, None)
    });
    let squeezed = squeezed.last().expect("eighty updates");
    assert_eq!(squeezed.obstacles_blocked, 1);
    let stopped = *god_object.obstacle_poses().next().expect("a plate");
    let further = 0.9 * settings.motion_tolerance;
    god_object.move_obstacle(0, &(Pose::translation(0.0, 0.0, further) * stopped));
    let report = god_object.step(&device, None);
    assert_eq!(report.obstacles_blocked, 0);
    // No room is looked for: one search, and those of the body's own motion.
    assert!(
        report.work.projections < squeezed.work.projections,
        "{:?} {:?}",
        report.work,
        squeezed.work
    );
    assert!(!overlaps(&world, &god_object));
}

#[test]
fn a_blade_that_turns_takes_the_body_along() {
    // A blade about the z axis that sweeps 20 degrees in each update.
    let world = Arc::new(World {
        body: box_body(Vector3::new(0.01, 0.01, 0.01)),
        obstacles: vec![box_obstacle(
            "blade",
            Vector3::new(0.15, 0.001, 0.05),
            Vector3::zeros(),
        )],
    });
    let settings = Settings::for_size(0.02);
    let start = Pose::translation(0.1, 0.03, 0.0);
    let mut god_object = GodObject::new(world.clone(), settings, start).expect("a free start");
    let mut blocked = 0;
    for update in 0..18 {
        let angle = f64::to_radians(20.0) * f64::from(update);
        let blade = Pose::rotation(Vector3::z() * angle);
        god_object.move_obstacle(0, &blade);
        // The hand lets go: it is where the body is.
        let device = *god_object.pose();
        blocked += god_object.step(&device, None).obstacles_blocked;
        assert!(!overlaps(&world, &god_object));
        let in_blade = blade.inverse_transform_point(
            &(*god_object.pose() * god_object::nalgebra::Point3::origin()),
        );
        assert!(in_blade.y > 0.0, "passed through at {angle}: {in_blade}");
    }
    assert_eq!(blocked, 0);
}

pub(crate) const CLEARANCE: f64 = 1e-4;
/// Of a jaw from the middle of the slot, m.
const JAW: f64 = 0.02 + CLEARANCE + 0.005;

/// Two jaws in one piece, 0.1 mm from the body on either side.
pub(crate) fn slot() -> Arc<World> {
    let one = box_obstacle("slot", Vector3::new(0.005, 0.05, 0.05), Vector3::zeros());
    let (corners, faces) = (one.mesh.vertices(), one.mesh.triangles());
    let vertices = [-JAW, JAW]
        .into_iter()
        .flat_map(|x| corners.iter().map(move |c| c + Vector3::x() * x));
    let second = faces.iter().map(|t| t.map(|i| i + corners.len() as u32));
    let triangles = faces.iter().copied().chain(second);
    let mesh =
        god_object::Mesh::new(vertices.collect(), triangles.collect()).expect("two closed boxes");
    Arc::new(World {
        body: box_body(Vector3::new(0.02, 0.02, 0.01)),
        obstacles: vec![god_object::Obstacle { mesh, ..one }],
    })
}

/// The same in two pieces.
fn two_jaws() -> Arc<World> {
    let jaw = |x: f64| {
        box_obstacle(
            "jaw",
            Vector3::new(0.005, 0.05, 0.05),
            Vector3::new(x, 0.0, 0.0),
        )
    };
    Arc::new(World {
        body: box_body(Vector3::new(0.02, 0.02, 0.01)),
        obstacles: vec![jaw(-JAW), jaw(JAW)],
    })
}

#[test]
fn a_body_in_a_slot_that_moves_goes_with_it() {
    // It goes three clearances in each update, and turns.
    let world = slot();
    let settings = Settings::for_size(0.04);
    let mut god_object =
        GodObject::new(world.clone(), settings, Pose::identity()).expect("a free start");
    for update in 1..=100 {
        let way = 3.0 * CLEARANCE * f64::from(update);
        let slot = Pose::new(
            Vector3::new(way, 0.0, 0.0),
            Vector3::new(0.0, 0.0, 5e-3 * f64::from(update)),
        );
        god_object.move_obstacle(0, &slot);
        let device = *god_object.pose();
        let report = god_object.step(&device, None);
        assert_eq!(report.obstacles_blocked, 0, "in update {update}");
        assert!(!overlaps(&world, &god_object));
        let aside = (slot.inverse() * god_object.pose()).translation.x;
        assert!(aside.abs() < JAW, "left the slot: {aside}");
    }
}

#[test]
fn a_slot_that_moves_with_the_hand_is_as_one_that_stands() {
    // The whole way in each update: a share of it would be another one where the hand moves.
    let settings = Settings {
        k_s: 1.0,
        ..Settings::for_size(0.04)
    };
    let motions = [(3e-5, 0.0), (3e-4, 1e-3), (3e-3, 2e-2)];
    let worlds = [slot(), two_jaws()];
    let cases = worlds
        .iter()
        .flat_map(|world| motions.map(|by| (world, by)));
    for (world, (step, turn)) in cases {
        let start = || GodObject::new(world.clone(), settings, Pose::identity());
        let mut still = start().expect("a free start");
        let mut moving = start().expect("a free start");
        let (mut worst, mut work) = (0.0_f64, [0, 0]);
        for update in 0..200 {
            let time = 0.02 * f64::from(update);
            let hand = Pose::new(
                Vector3::new((3.1 * time).sin(), (2.3 * time).sin(), (1.7 * time).cos()) * 2e-3,
                Vector3::new(
                    0.02 * time.sin(),
                    0.3 * (0.9 * time).sin(),
                    0.02 * time.cos(),
                ),
            );
            let way = f64::from(update) * step;
            let slot = Pose::new(
                Vector3::new(way, -0.5 * way, 0.3 * way),
                Vector3::new(0.3, 1.0, -0.5) * (turn * f64::from(update)),
            );
            work[0] += still.step(&hand, None).work.nominal_us();
            for (index, obstacle) in world.obstacles.iter().enumerate() {
                moving.move_obstacle(index, &(slot * obstacle.pose));
            }
            let report = moving.step(&(slot * hand), None);
            work[1] += report.work.nominal_us();
            assert_eq!(report.obstacles_blocked, 0, "in update {update}");
            assert!(!overlaps(world, &moving));
            let off = slot.inv_mul(moving.pose()).inv_mul(still.pose());
            worst = worst.max(off.translation.vector.norm() + 0.03 * off.rotation.angle());
        }
        println!("{step} m, {turn} rad: {worst:.1e} m, work {work:?}");
        assert!(worst < 0.1 * settings.rest_distance, "{worst} m");
        assert!(4 * work[1] < 5 * work[0], "{work:?}");
    }
}

#[test]
fn an_obstacle_sent_to_where_it_is_changes_no_bit() {
    let world = world(5e-3, 0.06);
    let (mut still, mut still_coupling, _) = loops(&world);
    let (mut sent, mut sent_coupling, _) = loops(&world);
    for i in 0..200 {
        let t = f64::from(i) * 1e-3;
        let device = Pose::new(
            Vector3::new(0.2 * t, 0.0, 0.03 - 0.2 * t),
            Vector3::new(t, 3.0 * t, 0.0),
        );
        assert!(sent.move_obstacle(0, &world.obstacles[0].pose));
        assert_eq!(still.step(&device, None), sent.step(&device, None));
        assert_eq!(still.pose(), sent.pose());
        assert_eq!(
            still_coupling.step(t, &device, still.constraint_set()),
            sent_coupling.step(t, &device, sent.constraint_set())
        );
    }
}

#[test]
fn a_broken_target_and_an_unknown_obstacle_are_refused() {
    let world = world(5e-3, 0.06);
    let (mut god_object, _, _) = loops(&world);
    assert!(!god_object.move_obstacle(0, &Pose::translation(0.0, f64::NAN, 0.0)));
    assert!(!god_object.move_obstacle(7, &Pose::identity()));
    god_object.step(&Pose::translation(0.0, 0.0, 0.03), None);
    assert!(
        god_object
            .obstacle_poses()
            .zip(&world.obstacles)
            .all(|(now, start)| *now == start.pose)
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever hand and plates do, nothing overlaps, and the force is finite and certified.
    #[test]
    fn no_stream_of_poses_makes_bodies_overlap(
        steps in prop::collection::vec((
            prop::array::uniform3(-0.05..0.05f64), prop::array::uniform3(-1.5..1.5f64),
            prop::array::uniform3(-0.05..0.05f64), prop::array::uniform3(-0.8..0.8f64),
        ), 1..16),
        thin in prop::bool::ANY,
    ) {
        let world = world(if thin { 1e-4 } else { 5e-3 }, 0.08);
        let (mut god_object, mut coupling, settings) = loops(&world);
        for (i, (p, r, q, s)) in steps.iter().enumerate() {
            let device = Pose::new(Vector3::from(*p), Vector3::from(*r));
            let plate = Pose::from_parts(Vector3::from(*q).into(), UnitQuaternion::from_scaled_axis(Vector3::from(*s)));
            god_object.move_obstacle(0, &plate);
            for repeat in 0..2 {
                let report = god_object.step(&device, None);
                prop_assert!(report.gap_min >= settings.minimum_gap, "gap {}", report.gap_min);
                prop_assert!(!overlaps(&world, &god_object));
                prop_assert_eq!(report.solver_failures, 0);
                let felt = coupling.step((i * 2 + repeat) as f64 * 1e-3, &device, god_object.constraint_set());
                prop_assert!(matches!(felt.status, ProjectionStatus::Solved | ProjectionStatus::Infeasible));
                prop_assert!(linear(&felt.wrench).norm() <= settings.force_limit * (1.0 + 1e-12));
            }
        }
    }
}
