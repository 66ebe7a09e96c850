//! The energy of a force from outside, under a virtual clock: whoever sends, the hand is given no more than the port's reserve.

use std::sync::Arc;
use std::time::Duration;

use assert_no_alloc::assert_no_alloc;
use god_object::nalgebra::UnitQuaternion;
use god_object::spatial::Vector6;
use god_object::{GodObject, Pose};
use taut::loops::wiring::WiredLoops;
use taut_bridge::{
    Device, DeviceFault, DeviceInfo, DeviceSample, Passivity, PassivitySettings, SafetySettings,
};
use taut_bridge::{
    ExternalWrench, ExternalWrenchSettings, NewestWrench, SentWrench, WrenchAxes, WrenchReader,
};
use taut_scene::Scene;

/// A free mass of 0.3 kg in a weak damper: whoever pushes it along gives it energy.
struct FreeHand {
    time: Duration,
    position: f64,
    velocity: f64,
    held: f64,
    given: f64,
    most_given: f64,
}

/// The same behind the port, with what it was given for the test to read.
struct Shared(Arc<std::sync::Mutex<FreeHand>>);

impl Device for Shared {
    fn info(&self) -> &DeviceInfo {
        static INFO: std::sync::OnceLock<DeviceInfo> = std::sync::OnceLock::new();
        INFO.get_or_init(free_info)
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let mut hand = self.0.lock().unwrap_or_else(|error| panic!("{error}"));
        let passed = now.saturating_sub(hand.time).as_secs_f64();
        hand.time = now;
        let force = hand.held - 0.5 * hand.velocity;
        hand.velocity += force / 0.3 * passed;
        let step = hand.velocity * passed;
        hand.position += step;
        hand.given += hand.held * step;
        hand.most_given = hand.most_given.max(hand.given);
        Ok(DeviceSample {
            time: now,
            pose: Pose::translation(hand.position, 0.0, 0.2),
            velocity: Vector6::x() * hand.velocity,
            buttons: 0,
        })
    }

    fn write(&mut self, _now: Duration, wrench: &Vector6) {
        let mut hand = self.0.lock().unwrap_or_else(|error| panic!("{error}"));
        hand.held = wrench.x;
    }
}

fn free_info() -> DeviceInfo {
    DeviceInfo::ideal("a free hand", 6)
}

/// The loops with a free hand and a source that `force` says, from time, s, and velocity, m/s; what the hand was given at most, J, and its largest force, N.
fn pumped(mode: Passivity, force: impl Fn(f64, f64) -> f64) -> (f64, f64) {
    let scene = Scene::named_or_file("sphere-on-plane").and_then(|scene| scene.build());
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    let world = Arc::new(scene.world);
    let start = Pose::translation(0.0, 0.0, 0.2);
    let god_object = GodObject::new(world.clone(), scene.settings, start);
    let god_object = god_object.unwrap_or_else(|error| panic!("{error}"));
    let hand = Arc::new(std::sync::Mutex::new(FreeHand {
        time: Duration::ZERO,
        position: 0.0,
        velocity: 0.01,
        held: 0.0,
        given: 0.0,
        most_given: 0.0,
    }));
    let safety = SafetySettings {
        passivity: PassivitySettings::of(mode),
        ..SafetySettings::default()
    };
    let (mut input, output) = triple_buffer::triple_buffer(&NewestWrench::default());
    let settings = ExternalWrenchSettings {
        axes: WrenchAxes::Fixed(UnitQuaternion::identity()),
        max_force: 5.0,
        max_torque: 0.2,
        hold: Duration::from_millis(20),
        ramp_out: Duration::from_millis(95),
        ramp_in: Duration::from_millis(50),
    };
    let external = ExternalWrench::new(WrenchReader::Local(output), settings);
    let device = Box::new(Shared(hand.clone()));
    let mut loops = WiredLoops::new(&world, &scene.settings, god_object, device, safety, None)
        .with_external(Some(external));
    let mut largest: f64 = 0.0;
    for tick in 1..=4000_u64 {
        let now = Duration::from_millis(tick);
        let velocity = hand
            .lock()
            .unwrap_or_else(|error| panic!("{error}"))
            .velocity;
        input.write(NewestWrench {
            sent: Some(SentWrench {
                wrench: Vector6::x() * force(now.as_secs_f64(), velocity),
                made: Some(now),
                uncertainty: Duration::ZERO,
                received: now,
                sender: 1,
                index: tick,
            }),
            spoiled: Duration::ZERO,
        });
        assert_no_alloc(|| {
            loops.haptics.tick(now);
            loops.coupling.tick(now);
        });
        loops.god_object.tick(|| now);
        let hand = hand.lock().unwrap_or_else(|error| panic!("{error}"));
        largest = largest.max(hand.held.abs());
    }
    let hand = hand.lock().unwrap_or_else(|error| panic!("{error}"));
    (hand.most_given, largest)
}

#[test]
fn a_sender_that_pumps_energy_gives_the_hand_no_more_than_the_reserve_of_the_port() {
    // In phase with the velocity, always along, to and fro at the hand's own pace, and at random.
    let noise = |time: f64| (time * 1e3 * 12.9898).sin() * 43758.547 % 1.0;
    let sources: [&dyn Fn(f64, f64) -> f64; 4] = [
        &|_, velocity: f64| 5.0 * velocity.signum(),
        &|_, _| 5.0,
        &|time, _| 5.0 * (time * 12.0).sin().signum(),
        &|time, _| 5.0 * noise(time),
    ];
    for (number, source) in sources.iter().enumerate() {
        let (given, largest) = pumped(Passivity::Control, source);
        // 10 mJ, 1 mJ for each of the 4 s, and what one tick at the speed reached can add.
        assert!(given < 0.01 + 4e-3 + 2e-3, "source {number}: {given} J");
        assert!(
            largest > 0.3,
            "source {number}: something was felt, {largest} N"
        );
    }
    // The test can fail: without the reserve the first source gives hundreds of times as much.
    let (given, _) = pumped(Passivity::Observe, sources[0]);
    assert!(given > 1.0, "{given} J");
}
