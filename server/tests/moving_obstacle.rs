//! An obstacle that moves, in the loops under a virtual clock: where clients, checker and replay see it, and what the hand feels.

use std::sync::Arc;
use std::time::Duration;

use crate::loops::{TICK, VirtualSession};
use god_object::spatial::linear;
use god_object::{Pose, World};
use taut::commands::replay::Replay;
use taut::loops::checker::PenetrationChecker;
use taut::loops::wiring::WiredLoops;
use taut::session::broadcast::StateWriter;
use taut::session::head::heads;
use taut_bridge::{
    AtEnd, Device, Grip, Hand, MinJerkPath, RecordedDevice, SimulatedDevice, TraceSample, ViaPoint,
};
use taut_proto::PoseF32;
use taut_scene::{BuiltMotion, BuiltScene, HeadTracking, Scene, Viewer, Workbench};

/// Index of the plate among the scene's obstacles: the wall comes first.
const PLATE: usize = 1;

fn scene() -> BuiltScene {
    Scene::named_or_file("moving-plate")
        .and_then(|scene| scene.build())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn motion(scene: &BuiltScene) -> &BuiltMotion {
    match scene.motions.as_slice() {
        [motion] if motion.obstacle == PLATE => motion,
        other => panic!("{other:?}"),
    }
}

/// A hand that means to stay at the start, and a grip that it can be pushed with.
fn yielding_hand(scene: &BuiltScene) -> Box<dyn Device> {
    let stay = ViaPoint {
        time_s: 0.0,
        pose: scene.start,
    };
    let path = MinJerkPath::new(vec![stay], false).expect("a path");
    Box::new(SimulatedDevice::new(
        Grip::workbench(),
        Hand::FIRM,
        path,
        scene.reference_point(),
    ))
}

/// A hand that nothing moves.
fn rigid_hand(scene: &BuiltScene) -> Box<dyn Device> {
    let rows = vec![TraceSample {
        time: 0.0,
        pose: scene.start,
        buttons: 0,
    }];
    let device = RecordedDevice::new(rows, AtEnd::Hold, scene.reference_point());
    Box::new(device.expect("a row"))
}

/// A session is some time old when its loops begin.
fn session_of(scene: &BuiltScene, device: Box<dyn Device>) -> VirtualSession {
    VirtualSession {
        now: Duration::from_millis(300),
        ..VirtualSession::new(scene, device, &scene.start)
    }
}

/// A replay of the scene, with what moves in it.
fn replay(scene: &BuiltScene) -> Replay {
    let world = Arc::new(scene.world.clone());
    Replay::new(world, scene.settings, scene.start, None)
        .expect("the scene starts free")
        .with_motions(scene.motions.clone())
}

fn checker(world: &World) -> PenetrationChecker {
    PenetrationChecker::new(world).expect("parry takes the meshes")
}

#[test]
fn the_plate_pushes_the_hand_without_penetration_at_any_god_object_rate() {
    let scene = scene();
    let checker = checker(&scene.world);
    // Even at an update each 0.2 s, where the plate goes 20 mm at once.
    for god_object_ticks in [1, 4, 14, 200] {
        let mut session = session_of(&scene, yielding_hand(&scene));
        let (mut largest, mut highest, mut largest_step): (f64, f64, f64) = (0.0, 0.0, 0.0);
        let mut last = 0.0;
        let begun = session.now;
        for _ in 0..8000 {
            session.tick(god_object_ticks);
            let monitor = &mut session.loops.readers.monitor;
            let contacts = monitor.contacts.newest();
            let pose = contacts.set.god_object_pose;
            assert_eq!(
                checker.penetrated_obstacle(&pose, &contacts.moving),
                None,
                "at {:?} with an update every {god_object_ticks} ticks",
                session.now
            );
            assert!(pose.translation.z > contacts.moving[0].pose.translation.z);
            highest = highest.max(pose.translation.z);
            let force = linear(&monitor.wrench.newest().wrench).norm();
            largest = largest.max(force);
            // While it comes up. That it stops is not foreseen.
            if (1.22..1.34).contains(&(session.now - begun).as_secs_f64()) {
                largest_step = largest_step.max((force - last).abs());
            }
            last = force;
        }
        assert!((highest - 0.045).abs() < 3e-3, "lifted to {highest}");
        assert!(largest <= scene.settings.force_limit * (1.0 + 1e-12));
        if god_object_ticks <= 14 {
            // The plate lifts the body by 15 mm. A firm hand of 500 N/m gives way by two thirds of that: 5 N.
            assert!(
                (3.5..8.0).contains(&largest),
                "{largest} N at every {god_object_ticks} ticks"
            );
            // 0.1 m/s into 1000 N/m is 0.1 N each millisecond; an update that is not foreseen would be 1.4 N at once.
            assert!(
                largest_step < 0.25,
                "a step of {largest_step} N at every {god_object_ticks} ticks"
            );
        }
        let monitor = &mut session.loops.readers.monitor;
        assert_eq!(monitor.wrench.newest().wrench.norm(), 0.0, "the plate left");
    }
}

#[test]
fn an_update_that_comes_late_moves_the_plate_the_whole_way_and_through_nothing() {
    let scene = scene();
    let checker = checker(&scene.world);
    let mut session = session_of(&scene, rigid_hand(&scene));
    session.ticks(1100);
    // Loop 1 stands still while the plate should come up from under the body to 15 mm over the body's place.
    session.hang(300);
    session.tick(1);
    let contacts = session.loops.readers.monitor.contacts.newest();
    let (body, plate) = (contacts.set.god_object_pose, contacts.moving[0].pose);
    assert_eq!(plate.translation.z, 0.030, "where the trace is by now");
    assert!(
        body.translation.z > 0.030 + 0.005 + 0.010,
        "it went through"
    );
    assert_eq!(checker.penetrated_obstacle(&body, &contacts.moving), None);
}

#[test]
fn clients_are_told_where_the_trace_is_at_the_time_of_each_update() {
    let scene = scene();
    let motion = motion(&scene);
    let session = session_of(&scene, yielding_hand(&scene));
    let workbench = Workbench::shipped().unwrap_or_else(|error| panic!("{error}"));
    let viewer = Viewer {
        tracking: HeadTracking::Fixed,
        ..workbench.viewer
    };
    let [head] = heads(&viewer, None).expect("a still head has nothing to start");
    let WiredLoops {
        mut god_object,
        mut coupling,
        mut haptics,
        readers,
        ..
    } = session.loops;
    let reference_point = scene.reference_point();
    let mut states = StateWriter::new(readers.broadcast, head, &reference_point, 1);
    let first = session.now + TICK;
    let mut now = session.now;
    for _ in 0..9000 {
        now += TICK;
        haptics.tick(now);
        coupling.tick(now);
        god_object.tick(|| now);
        let state = states.newest(now).expect("a sample each tick");
        let [body] = state.bodies.as_slice() else {
            panic!("one body moves: {:?}", state.bodies);
        };
        assert_eq!(usize::from(body.id), PLATE);
        let there = motion.pose_at((now - first).as_secs_f64());
        let pose = PoseF32::from_isometry(&there);
        let error = (0..3)
            .map(|k| (body.pose.position[k] - pose.position[k]).abs())
            .fold(0.0, f32::max);
        let turn = (0..4)
            .map(|k| body.pose.rotation[k] * pose.rotation[k])
            .sum::<f32>();
        // Nothing squeezes the body: the plate is where it was sent.
        assert!(error < 1e-8 && turn.abs() > 1.0 - 1e-6, "{body:?} {pose:?}");
    }
}

#[test]
fn the_loops_and_the_replay_move_everything_alike() {
    let scene = scene();
    let mut session = session_of(&scene, rigid_hand(&scene));
    let mut replay = replay(&scene);
    let first = session.now + TICK;
    for _ in 0..8000 {
        session.tick(1);
        let elapsed = (session.now - first).as_secs_f64();
        let row = replay.row(elapsed, &scene.start);
        let contacts = session.loops.readers.monitor.contacts.newest();
        assert_eq!(
            contacts.set.god_object_pose, row.god_object_pose,
            "at {elapsed}"
        );
        assert_eq!(contacts.set.constraints.len(), row.contacts);
    }
    assert_eq!(replay.report().obstacle_blocked_updates, 0);
}

#[test]
fn the_energy_of_a_hand_that_is_pushed_is_the_obstacles_and_not_the_couplings() {
    let scene = scene();
    let mut session = session_of(&scene, yielding_hand(&scene));
    let mut most_work: f64 = 0.0;
    for _ in 0..8000 {
        session.tick(1);
        let work = session.loops.haptics.statistics().obstacle_work.load();
        most_work = most_work.max(work);
    }
    let statistics = session.loops.haptics.statistics();
    // The hand's spring and the coupling's in a row, both compressed by the plate's 15 mm: 1/2 of 333 N/m times the way squared.
    let springs = 0.5 * (1000.0 * 500.0 / 1500.0) * 0.015_f64.powi(2);
    assert!(
        (0.8 * springs..1.5 * springs).contains(&most_work),
        "{most_work} J of {springs} J"
    );
    // Two thirds of it went to the hand, which had put in nothing.
    assert!(
        statistics.energy_injected.load() > 0.4 * springs,
        "{} J",
        statistics.energy_injected.load()
    );
    assert!(
        statistics.energy_generated.load() < 0.05 * springs,
        "{} J",
        statistics.energy_generated.load()
    );
}

#[test]
fn a_rigid_hand_takes_no_energy_and_the_plate_gets_back_what_it_put_in() {
    let scene = scene();
    let mut replay = replay(&scene);
    let mut most_work: f64 = 0.0;
    for row in 0..8000_u32 {
        replay.row(f64::from(row) * 1e-3, &scene.start);
        // The report sums up all rows; the plate's work is steady enough to be asked for now and then.
        if row % 50 == 0 {
            most_work = most_work.max(replay.report().energy_from_obstacles_j);
        }
    }
    let report = replay.report();
    assert_eq!(report.energy_injected_j, 0.0);
    assert_eq!(report.energy_generated_j, 0.0);
    // Lifted by 15 mm against 1000 N/m, and tilted there.
    let spring = 0.5 * 1000.0 * 0.015_f64.powi(2);
    assert!(most_work > 0.98 * spring, "{most_work} J of {spring} J");
    assert!(
        report.energy_from_obstacles_j.abs() < 0.02 * most_work,
        "{} J of {most_work} J are left",
        report.energy_from_obstacles_j
    );
}

#[test]
fn a_body_that_is_squeezed_holds_the_plate_up_and_clients_are_told_where_it_is() {
    // A ceiling 26 mm over the plate's upper end: 20 mm of body have no room when it is there.
    let mut built = scene();
    let wall = &mut built.world.obstacles[0];
    wall.pose = Pose::new(
        god_object::nalgebra::Vector3::new(0.0, 0.0, 0.052),
        god_object::nalgebra::Vector3::y() * std::f64::consts::FRAC_PI_2,
    );
    let checker = checker(&built.world);
    let mut session = session_of(&built, rigid_hand(&built));
    let mut lags: f64 = 0.0;
    let first = session.now + TICK;
    for _ in 0..2300 {
        session.tick(1);
        let contacts = session.loops.readers.monitor.contacts.newest();
        let place = contacts.moving[0].pose;
        let there = motion(&built).pose_at((session.now - first).as_secs_f64());
        lags = lags.max(there.translation.z - place.translation.z);
        assert_eq!(
            checker.penetrated_obstacle(&contacts.set.god_object_pose, &contacts.moving),
            None
        );
    }
    // 47 mm - 20 mm of body is where the plate's face can be; it was sent to 35 mm.
    assert!((lags - 0.008).abs() < 5e-4, "it lags {lags} m");
    let blocked = session
        .loops
        .god_object
        .statistics()
        .blocked_updates
        .load(std::sync::atomic::Ordering::Relaxed);
    assert!(blocked > 900, "{blocked}");
}
