//! The three loops under a virtual clock, with a simulated device and hand: everything but the threads.

use std::sync::Arc;
use std::time::Duration;

use god_object::nalgebra::Vector3;
use god_object::spatial::linear;
use god_object::{GodObject, Pose};
use taut::checker::PenetrationChecker;
use taut::loops::wiring::WiredLoops;
use taut_bridge::{
    ArmWish, Device, DeviceFault, DeviceInfo, DeviceSample, EventKind, Grip, Hand, MinJerkPath,
    SafetySettings, SimulatedDevice, ViaPoint,
};
use taut_scene::{BuiltScene, Scene};

const TICK: Duration = Duration::from_millis(1);

/// The session's loops, ticked in the order in which their threads would run.
struct VirtualSession {
    loops: WiredLoops,
    now: Duration,
}

fn sphere_on_plane() -> BuiltScene {
    match Scene::named_or_file("sphere-on-plane").and_then(|scene| scene.build()) {
        Ok(scene) => scene,
        Err(error) => panic!("{error}"),
    }
}

/// The hand goes down to 10 mm below the plane's surface within a second, waits a second, and comes up again.
fn pressing_hand(scene: &BuiltScene) -> SimulatedDevice {
    let radius = 0.02;
    let at = |time_s, height: f64| ViaPoint {
        time_s,
        pose: Pose::translation(0.0, 0.0, height),
    };
    let points = vec![
        at(0.0, 0.04),
        at(1.0, radius - 0.01),
        at(2.0, radius - 0.01),
        at(3.0, 0.04),
    ];
    match MinJerkPath::new(points, false) {
        Ok(path) => {
            SimulatedDevice::new(Grip::workbench(), Hand::FIRM, path, scene.reference_point())
        }
        Err(error) => panic!("{error}"),
    }
}

impl VirtualSession {
    fn new(scene: &BuiltScene, device: Box<dyn Device>, start: &Pose) -> Self {
        let world = Arc::new(scene.world.clone());
        let god_object = match GodObject::new(world.clone(), scene.settings, *start) {
            Ok(god_object) => god_object,
            Err(error) => panic!("{error}"),
        };
        let safety = SafetySettings {
            ramp_in: Duration::from_millis(10),
            ..SafetySettings::default()
        };
        Self {
            loops: WiredLoops::new(&world, &scene.settings, god_object, device, safety, None)
                .with_motions(scene.motions.clone()),
            now: Duration::ZERO,
        }
    }

    /// One millisecond: loop 3, loop 2; loop 1 only every `god_object_ticks`.
    fn tick(&mut self, god_object_ticks: u32) {
        self.now += TICK;
        let now = self.now;
        self.loops.haptics.tick(now);
        self.loops.coupling.tick(now);
        if now.as_millis().is_multiple_of(u128::from(god_object_ticks)) {
            self.loops.god_object.tick(|| now);
        }
    }
}

#[test]
fn pressing_on_a_plane_gives_a_force_without_penetration_at_any_god_object_rate() {
    let scene = sphere_on_plane();
    let Some(checker) = PenetrationChecker::new(&scene.world) else {
        panic!("parry refuses the meshes");
    };
    for god_object_ticks in [1, 4, 14] {
        let device = pressing_hand(&scene);
        let start = Pose::translation(0.0, 0.0, 0.04);
        let mut session = VirtualSession::new(&scene, Box::new(device), &start);
        let mut largest: f64 = 0.0;
        for _ in 0..3500 {
            session.tick(god_object_ticks);
            let contacts = session.loops.observers.monitor.contacts.newest();
            let pose = contacts.set.god_object_pose;
            assert!(
                pose.translation.z >= 0.019,
                "centre at {}",
                pose.translation.z
            );
            assert_eq!(checker.penetrated_obstacle(&pose, &contacts.moving), None);
            let force = linear(&session.loops.observers.monitor.wrench.newest().wrench);
            // Frictionless, so nothing but along the normal.
            assert!(force.xy().norm() < 1e-3 * force.norm().max(1.0), "{force}");
            largest = largest.max(force.z);
        }
        // A firm hand of 500 N/m against 1000 N/m: two thirds of 10 mm stay as force.
        assert!(
            (2.0..6.0).contains(&largest),
            "largest force {largest} N at every {god_object_ticks} ticks"
        );
        assert_eq!(
            session
                .loops
                .observers
                .monitor
                .wrench
                .newest()
                .wrench
                .norm(),
            0.0,
            "no force in free space"
        );
        assert!(
            session
                .loops
                .observers
                .monitor
                .device
                .newest()
                .pose
                .translation
                .z
                > 0.035,
            "the hand is back"
        );
        assert!(session.loops.haptics.statistics().energy_injected() < 1e-2);
    }
}

/// Answers until its cable is pulled.
struct Unplugged {
    device: SimulatedDevice,
    at: Duration,
    written: Arc<std::sync::Mutex<Vector3<f64>>>,
}

impl Device for Unplugged {
    fn info(&self) -> &DeviceInfo {
        self.device.info()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        if now < self.at {
            self.device.read(now)
        } else {
            Err(DeviceFault::Lost { age: now - self.at })
        }
    }

    fn write(&mut self, now: Duration, wrench: &god_object::Vector6) {
        if let Ok(mut written) = self.written.lock() {
            *written = linear(wrench);
        }
        self.device.write(now, wrench);
    }
}

#[test]
fn a_lost_device_gets_no_force_and_is_told_as_faulty() {
    let scene = sphere_on_plane();
    let written = Arc::default();
    let device = Unplugged {
        device: pressing_hand(&scene),
        at: Duration::from_millis(1500),
        written: Arc::clone(&written),
    };
    let mut session =
        VirtualSession::new(&scene, Box::new(device), &Pose::translation(0.0, 0.0, 0.04));
    let felt = || written.lock().map(|force| force.norm()).unwrap_or(f64::NAN);
    for _ in 0..1499 {
        session.tick(1);
    }
    assert!(felt() > 2.0);
    let count =
        |session: &VirtualSession, kind| session.loops.haptics.statistics().incidents.of(kind);
    assert_eq!(count(&session, EventKind::DeviceLost), 0);
    let mut before = felt();
    for age in 1..=200 {
        session.tick(1);
        assert!(before - felt() <= 0.5, "no step of {} N", before - felt());
        assert_eq!(felt() == 0.0, age >= 120, "{} N after {age} ms", felt());
        before = felt();
    }
    assert!(session.loops.observers.monitor.device.newest().faulty);
    assert_eq!(
        count(&session, EventKind::DeviceLost),
        1,
        "one event, not one per tick"
    );
}

#[test]
fn a_silent_coupling_lets_the_force_fade() {
    let scene = sphere_on_plane();
    let written = Arc::default();
    let device = Unplugged {
        device: pressing_hand(&scene),
        at: Duration::MAX,
        written: Arc::clone(&written),
    };
    let mut session =
        VirtualSession::new(&scene, Box::new(device), &Pose::translation(0.0, 0.0, 0.04));
    for _ in 0..1500 {
        session.tick(1);
    }
    let felt = || written.lock().map(|force| force.norm()).unwrap_or(f64::NAN);
    assert!(felt() > 2.0);
    for _ in 0..150 {
        session.now += TICK;
        session.loops.haptics.tick(session.now);
    }
    assert_eq!(felt(), 0.0);
}

#[test]
fn constraints_older_than_a_tenth_of_a_second_let_the_force_fade() {
    let scene = sphere_on_plane();
    let written = Arc::default();
    let device = Unplugged {
        device: pressing_hand(&scene),
        at: Duration::MAX,
        written: Arc::clone(&written),
    };
    let mut session =
        VirtualSession::new(&scene, Box::new(device), &Pose::translation(0.0, 0.0, 0.04));
    for _ in 0..1500 {
        session.tick(1);
    }
    let felt = || written.lock().map(|force| force.norm()).unwrap_or(f64::NAN);
    // Loop 1 hangs; loops 2 and 3 go on.
    let mut hang = |ticks: u32| {
        for _ in 0..ticks {
            session.now += TICK;
            session.loops.haptics.tick(session.now);
            session.loops.coupling.tick(session.now);
        }
    };
    hang(90);
    assert!(felt() > 2.0, "held at first: {}", felt());
    hang(160);
    assert_eq!(felt(), 0.0);
}

/// Which loop stalls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stalled {
    GodObject,
    Coupling,
    Haptics,
}

/// What a stall of one loop did to the force, in a hand that rests on the plane.
#[derive(Debug)]
struct StallSeen {
    /// Largest change of the force in one tick, N.
    largest_step: f64,
    /// Smallest force from the stall's begin on, and the force before it, N.
    lowest: f64,
    before: f64,
    /// Oldest constraints that the coupling told of, ms.
    oldest_ms: u128,
    /// Ticks of the haptics loop.
    haptics_ticks: u64,
}

fn stall(loop_: Stalled, milliseconds: u32) -> StallSeen {
    let scene = sphere_on_plane();
    let written = Arc::default();
    let device = Unplugged {
        device: pressing_hand(&scene),
        at: Duration::MAX,
        written: Arc::clone(&written),
    };
    let mut session =
        VirtualSession::new(&scene, Box::new(device), &Pose::translation(0.0, 0.0, 0.04));
    for _ in 0..1500 {
        session.tick(1);
    }
    let felt = || written.lock().map(|force| *force).unwrap_or_default();
    let ticked = session
        .loops
        .haptics
        .statistics()
        .period
        .distribution()
        .count;
    let mut last = felt();
    let mut seen = StallSeen {
        largest_step: 0.0,
        lowest: last.norm(),
        before: last.norm(),
        oldest_ms: 0,
        haptics_ticks: 0,
    };
    for tick in 0..400 {
        session.now += TICK;
        let now = session.now;
        let stalls = |this: Stalled| this == loop_ && tick < milliseconds;
        if !stalls(Stalled::Haptics) {
            session.loops.haptics.tick(now);
        }
        if !stalls(Stalled::Coupling) {
            session.loops.coupling.tick(now);
        }
        if !stalls(Stalled::GodObject) {
            session.loops.god_object.tick(|| now);
        }
        seen.largest_step = seen.largest_step.max((felt() - last).norm());
        last = felt();
        seen.lowest = seen.lowest.min(last.norm());
        let command = session.loops.observers.monitor.wrench.newest();
        seen.oldest_ms = seen.oldest_ms.max(command.constraint_age.as_millis());
    }
    seen.haptics_ticks = session
        .loops
        .haptics
        .statistics()
        .period
        .distribution()
        .count
        - ticked;
    seen
}

#[test]
fn a_loop_that_stalls_neither_stops_the_others_nor_makes_the_force_step() {
    for loop_ in [Stalled::GodObject, Stalled::Coupling, Stalled::Haptics] {
        for milliseconds in [5, 20, 100] {
            let seen = stall(loop_, milliseconds);
            let case = format!("{loop_:?} for {milliseconds} ms: {seen:?}");
            assert!(seen.before > 2.0, "{case}");
            assert!(seen.largest_step <= 0.5 + 1e-9, "{case}");
            let ticks = match loop_ {
                Stalled::Haptics => 400 - u64::from(milliseconds),
                _ => 400,
            };
            assert_eq!(seen.haptics_ticks, ticks, "{case}");
            match loop_ {
                // The constraints stay planes, and their age is told.
                Stalled::GodObject => {
                    assert!(seen.oldest_ms >= u128::from(milliseconds), "{case}");
                    assert!(seen.lowest > 0.9 * seen.before, "{case}");
                }
                // 20 ms are held; of 100 ms, 80 have faded.
                Stalled::Coupling if milliseconds <= 20 => {
                    assert!(seen.lowest > 0.9 * seen.before, "{case}");
                }
                Stalled::Coupling => assert!(seen.lowest < 0.25 * seen.before, "{case}"),
                Stalled::Haptics if milliseconds < 20 => {
                    assert!(seen.lowest > 0.9 * seen.before, "{case}");
                }
                Stalled::Haptics => {}
            }
        }
    }
}

#[test]
fn who_asks_for_no_force_gets_none_until_somebody_arms() {
    let scene = sphere_on_plane();
    let device = pressing_hand(&scene);
    let mut session =
        VirtualSession::new(&scene, Box::new(device), &Pose::translation(0.0, 0.0, 0.04));
    for _ in 0..1500 {
        session.tick(1);
    }
    let felt = |session: &VirtualSession| linear(session.loops.haptics.port().rendered()).norm();
    assert!(felt(&session) > 2.0);
    session.loops.arm_switch.wish(ArmWish::Disarm);
    for _ in 0..150 {
        session.tick(1);
    }
    assert_eq!(felt(&session), 0.0);
    session.loops.arm_switch.wish(ArmWish::Arm);
    for _ in 0..150 {
        session.tick(1);
    }
    assert!(felt(&session) > 2.0);
}
