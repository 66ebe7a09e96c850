//! The three loops under a virtual clock, with a simulated device and hand: everything but the threads.

use std::sync::Arc;
use std::time::Duration;

use god_object::nalgebra::Vector3;
use god_object::spatial::linear;
use god_object::{GodObject, Pose};
use taut::loops::checker::PenetrationChecker;
use taut::loops::wiring::WiredLoops;
use taut_bridge::{
    ArmWish, Device, DeviceFault, DeviceInfo, DeviceSample, EventKind, Grip, Hand, MinJerkPath,
    SafetySettings, SimulatedDevice, ViaPoint,
};
use taut_scene::{BuiltScene, Scene};

pub(crate) const TICK: Duration = Duration::from_millis(1);

/// The session's loops, ticked in the order in which their threads would run.
pub(crate) struct VirtualSession {
    pub(crate) loops: WiredLoops,
    pub(crate) now: Duration,
}

fn sphere_on_plane() -> BuiltScene {
    Scene::named_or_file("sphere-on-plane")
        .and_then(|scene| scene.build())
        .unwrap_or_else(|error| panic!("{error}"))
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
    let path = MinJerkPath::new(points, false).expect("a path");
    SimulatedDevice::new(Grip::workbench(), Hand::FIRM, path, scene.reference_point())
}

impl VirtualSession {
    pub(crate) fn new(scene: &BuiltScene, device: Box<dyn Device>, start: &Pose) -> Self {
        let world = Arc::new(scene.world.clone());
        let god_object = GodObject::new(world.clone(), scene.settings, *start)
            .unwrap_or_else(|error| panic!("{error}"));
        let safety = SafetySettings {
            ramp_in: Duration::from_millis(10),
            ..SafetySettings::default()
        };
        Self {
            loops: WiredLoops::new(&world, &scene.settings, god_object, device, safety, None)
                .with_motions(scene.motions.clone(), Duration::ZERO),
            now: Duration::ZERO,
        }
    }

    /// One millisecond: loop 3, loop 2; loop 1 only every `god_object_ticks`.
    pub(crate) fn tick(&mut self, god_object_ticks: u32) {
        self.now += TICK;
        let now = self.now;
        self.loops.haptics.tick(now);
        self.loops.coupling.tick(now);
        if now.as_millis().is_multiple_of(u128::from(god_object_ticks)) {
            self.loops.god_object.tick(|| now);
        }
    }

    /// So many of them, with loop 1 in each.
    pub(crate) fn ticks(&mut self, count: u32) {
        for _ in 0..count {
            self.tick(1);
        }
    }

    /// The same while loop 1 hangs.
    pub(crate) fn hang(&mut self, count: u32) {
        for _ in 0..count {
            self.now += TICK;
            self.loops.haptics.tick(self.now);
            self.loops.coupling.tick(self.now);
        }
    }
}

#[test]
fn pressing_on_a_plane_gives_a_force_without_penetration_at_any_god_object_rate() {
    let scene = sphere_on_plane();
    let checker = PenetrationChecker::new(&scene.world).expect("parry refuses the meshes");
    for god_object_ticks in [1, 4, 14] {
        let device = pressing_hand(&scene);
        let start = Pose::translation(0.0, 0.0, 0.04);
        let mut session = VirtualSession::new(&scene, Box::new(device), &start);
        let mut largest: f64 = 0.0;
        for _ in 0..3500 {
            session.tick(god_object_ticks);
            let contacts = session.loops.readers.monitor.contacts.newest();
            let pose = contacts.set.god_object_pose;
            assert!(
                pose.translation.z >= 0.019,
                "centre at {}",
                pose.translation.z
            );
            assert_eq!(checker.penetrated_obstacle(&pose, &contacts.moving), None);
            let force = linear(&session.loops.readers.monitor.wrench.newest().wrench);
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
            session.loops.readers.monitor.wrench.newest().wrench.norm(),
            0.0,
            "no force in free space"
        );
        assert!(
            session
                .loops
                .readers
                .monitor
                .device
                .newest()
                .pose
                .translation
                .z
                > 0.035,
            "the hand is back"
        );
        assert!(session.loops.haptics.statistics().energy_injected.load() < 1e-2);
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

/// A hand that presses on the plane until its cable is pulled, and the force that it feels, N.
fn pressed_until(at: Duration) -> (VirtualSession, impl Fn() -> f64) {
    let scene = sphere_on_plane();
    let written: Arc<std::sync::Mutex<Vector3<f64>>> = Arc::default();
    let device = Unplugged {
        device: pressing_hand(&scene),
        at,
        written: Arc::clone(&written),
    };
    let start = Pose::translation(0.0, 0.0, 0.04);
    let session = VirtualSession::new(&scene, Box::new(device), &start);
    let felt = move || written.lock().map(|force| force.norm()).unwrap_or(f64::NAN);
    (session, felt)
}

#[test]
fn a_lost_device_gets_no_force_and_is_told_as_faulty() {
    let (mut session, felt) = pressed_until(Duration::from_millis(1500));
    session.ticks(1499);
    assert!(felt() > 2.0);
    let count =
        |session: &VirtualSession, kind| session.loops.haptics.statistics().incidents.of(kind);
    assert_eq!(count(&session, EventKind::DeviceLost), 0);
    let mut before = felt();
    for age in 1..=200 {
        session.tick(1);
        assert!(before - felt() <= 0.5, "no step of {} N", before - felt());
        let gone = Duration::from_millis(age) >= SafetySettings::HOLD + SafetySettings::RAMP_OUT;
        assert_eq!(felt() == 0.0, gone, "{} N after {age} ms", felt());
        before = felt();
    }
    assert!(session.loops.readers.monitor.device.newest().faulty);
    assert_eq!(
        count(&session, EventKind::DeviceLost),
        1,
        "one event, not one per tick"
    );
}

#[test]
fn a_silent_coupling_lets_the_force_fade() {
    let (mut session, felt) = pressed_until(Duration::MAX);
    session.ticks(1500);
    assert!(felt() > 2.0);
    for _ in 0..150 {
        session.now += TICK;
        session.loops.haptics.tick(session.now);
    }
    assert_eq!(felt(), 0.0);
}

#[test]
fn constraints_older_than_a_tenth_of_a_second_let_the_force_fade() {
    let (mut session, felt) = pressed_until(Duration::MAX);
    session.ticks(1500);
    session.hang(90);
    assert!(felt() > 2.0, "held at first: {}", felt());
    session.hang(160);
    assert_eq!(felt(), 0.0);
}

#[test]
fn who_asks_for_no_force_gets_none_until_somebody_arms() {
    let scene = sphere_on_plane();
    let device = pressing_hand(&scene);
    let mut session =
        VirtualSession::new(&scene, Box::new(device), &Pose::translation(0.0, 0.0, 0.04));
    session.ticks(1500);
    let felt = |session: &VirtualSession| linear(session.loops.haptics.port().rendered()).norm();
    assert!(felt(&session) > 2.0);
    session.loops.arm_switch.wish(ArmWish::Disarm);
    session.ticks(150);
    assert_eq!(felt(&session), 0.0);
    session.loops.arm_switch.wish(ArmWish::Arm);
    session.ticks(150);
    assert!(felt(&session) > 2.0);
}
