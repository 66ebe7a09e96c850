//! A force from outside at the far end of a network, under a virtual clock: what the hand of a bridge feels of it, and what no sender, server or network
//! makes it feel.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use assert_no_alloc::assert_no_alloc;
use nalgebra::{Point3, Vector6};
use taut_bridge::edge::pass_on;
use taut_bridge::{
    BridgeLoop, CommandSource, Device, DeviceFault, DeviceInfo, DevicePort, DeviceSample,
    Passivity, PassivitySettings, Pose, SafetySettings,
};
use taut_link::proto::force::{FORCE_IN_BODY, FORCE_NONE};
use taut_link::proto::wrench::WRENCH_PAUSED;
use taut_link::proto::{ForceSample, PassedForce, SessionTime, WrenchCommand};

const MS: u64 = 1_000_000;

/// A hand that stands, or a free mass of 0.3 kg in a weak damper.
#[derive(Default)]
struct Hand {
    is_free: bool,
    turned: bool,
    time: Duration,
    position: f64,
    velocity: f64,
    held: f64,
    most_given: f64,
    given: f64,
}

struct Shared(Arc<Mutex<Hand>>, DeviceInfo);

impl Device for Shared {
    fn info(&self) -> &DeviceInfo {
        &self.1
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let mut hand = self.0.lock().expect("the hand");
        let passed = now.saturating_sub(hand.time).as_secs_f64();
        hand.time = now;
        if hand.is_free {
            hand.velocity += (hand.held - 0.5 * hand.velocity) / 0.3 * passed;
        }
        let step = hand.velocity * passed;
        hand.position += step;
        hand.given += hand.held * step;
        hand.most_given = hand.most_given.max(hand.given);
        let mut pose = Pose::translation(hand.position, 0.0, 0.0);
        if hand.turned {
            let quarter = nalgebra::Vector3::z() * std::f64::consts::FRAC_PI_2;
            pose.rotation = nalgebra::UnitQuaternion::from_scaled_axis(quarter);
        }
        Ok(DeviceSample {
            time: now,
            pose,
            velocity: Vector6::x() * hand.velocity,
            buttons: 0,
        })
    }

    fn write(&mut self, _now: Duration, wrench: &Vector6<f64>) {
        self.0.lock().expect("the hand").held = wrench.x;
    }
}

/// A bridge whose server has nothing to say of contacts, on a clock of milliseconds; session time is another clock, 5 s ahead.
struct Far {
    bridge: BridgeLoop,
    hand: Arc<Mutex<Hand>>,
    time: u64,
    uncertainty: u64,
    flags: u16,
}

impl Far {
    fn new(hand: Hand, mode: Passivity) -> Self {
        let hand = Arc::new(Mutex::new(hand));
        let info = DeviceInfo::ideal("a hand", 6);
        let safety = SafetySettings {
            ramp_in: Duration::from_millis(50),
            passivity: PassivitySettings::of(mode),
            ..SafetySettings::default()
        };
        let device = Box::new(Shared(hand.clone(), info));
        let port = DevicePort::new(device, safety, Point3::origin(), &Pose::identity());
        let mut bridge = BridgeLoop::new(port);
        bridge.begin_session(CommandSource::Other, None);
        let mut far = Self {
            bridge,
            hand,
            time: 1000,
            uncertainty: 0,
            flags: 0,
        };
        // Armed, and past every ramp.
        for _ in 0..300 {
            far.tick(None);
        }
        far
    }

    fn session_ns(&self) -> u64 {
        (self.time + 5000) * MS
    }

    /// A value of the source that was measured `age` ms ago.
    fn value(&self, age: u64, force: f64) -> PassedForce {
        PassedForce {
            sample: ForceSample {
                sample_time_ns: self.session_ns() - age * MS,
                clock_uncertainty_ns: 0,
                index: self.time,
                wrench: [force, 0.0, 0.0, 0.0, 0.0, 0.0],
            },
            hold_ns: 20 * MS,
            ramp_out_ns: 95 * MS,
            flags: 0,
        }
    }

    /// A millisecond; `passed` came just before. What is felt along x, N.
    fn tick(&mut self, passed: Option<PassedForce>) -> f64 {
        self.time += 1;
        let now = Duration::from_millis(self.time);
        let session = Some(SessionTime {
            ns: self.session_ns(),
            uncertainty_ns: self.uncertainty,
        });
        let command = WrenchCommand {
            time_ns: self.session_ns(),
            origin_ns: self.session_ns(),
            wrench: [0.0; 6],
            obstacle_work: 0.0,
            flags: self.flags,
        };
        assert_no_alloc(|| {
            if let Some(passed) = &passed {
                let _ = self.bridge.take_passed(passed, now, session);
            }
            let _ = self.bridge.tick(now, session, Some(command));
        });
        self.bridge.port().rendered().x
    }

    /// A newton, until it is felt.
    fn pushed(&mut self) {
        for _ in 0..200 {
            let value = self.value(0, 1.0);
            self.tick(Some(value));
        }
        assert_eq!(self.bridge.port().rendered().x, 1.0);
    }
}

fn standing() -> Far {
    Far::new(Hand::default(), Passivity::Control)
}

#[test]
fn it_is_felt_fades_by_its_time_of_origin_and_is_gone_115_ms_after_it() {
    let mut far = standing();
    far.pushed();
    let last = far.value(0, 1.0);
    // The same again and again, as the server repeats it, makes it no younger.
    let felt: Vec<f64> = (0..140).map(|_| far.tick(Some(last))).collect();
    assert!(felt[..19].iter().all(|force| *force == 1.0), "{felt:?}");
    assert!(felt[40] < 0.9 && felt[112] > 0.0, "{felt:?}");
    assert!(felt[115..].iter().all(|force| *force == 0.0), "{felt:?}");
    for pair in felt.windows(2) {
        assert!(pair[0] - pair[1] < 0.02, "no step: {pair:?}");
    }
}

#[test]
fn a_link_that_grows_slower_makes_it_older_and_never_younger() {
    let mut far = standing();
    let mut sent = std::collections::VecDeque::new();
    let mut largest_age = 0;
    for tick in 0..3000_u64 {
        sent.push_back((far.time, far.value(0, 1.0)));
        // From 400 ms on, a millisecond more every ten.
        let delay = 2 + tick.saturating_sub(400) / 10;
        let mut newest = None;
        while sent.front().is_some_and(|(at, _)| far.time - at >= delay) {
            newest = sent.pop_front();
        }
        let felt = far.tick(newest.map(|(_, value)| value));
        if felt > 0.0 {
            largest_age = largest_age.max(delay);
        }
        match tick {
            200..400 => assert_eq!(felt, 1.0, "{tick}"),
            1700.. => assert_eq!(felt, 0.0, "{tick}: {delay} ms on its way"),
            _ => {}
        }
    }
    assert!((60..116).contains(&largest_age), "{largest_age} ms");
}

#[test]
fn what_the_clocks_may_be_off_by_counts_as_age() {
    for (source, bridge) in [(30, 0), (0, 30)] {
        let mut far = standing();
        far.uncertainty = bridge * MS;
        for _ in 0..300 {
            let mut value = far.value(0, 1.0);
            value.sample.clock_uncertainty_ns = source * MS;
            far.tick(Some(value));
        }
        let felt = far.bridge.port().rendered().x;
        // 31 ms: 11 of 95 are gone.
        assert!((felt - 84.0 / 95.0).abs() < 1e-9, "{felt}");
    }
}

#[test]
fn what_is_old_overtaken_from_the_future_or_without_a_time_changes_nothing() {
    let mut far = standing();
    far.pushed();
    let bends: [&dyn Fn(&mut PassedForce); 5] = [
        &|value| value.sample.sample_time_ns -= 200 * MS,
        &|value| value.sample.sample_time_ns += 500 * MS,
        &|value| value.sample.sample_time_ns = u64::MAX >> 3,
        &|value| value.sample.sample_time_ns = 0,
        &|value| value.sample.index = 1,
    ];
    for bend in bends {
        let mut bent = far.value(0, -4.0);
        bend(&mut bent);
        // What was good before goes on, and nothing of the other is felt.
        for _ in 0..10 {
            assert_eq!(far.tick(Some(bent)), 1.0, "{bent:?}");
        }
        far.pushed();
    }
    // Without a clock nothing is known of its age.
    let mut far = standing();
    for _ in 0..200 {
        let value = far.value(0, 1.0);
        far.time += 1;
        let now = Duration::from_millis(far.time);
        let _ = far.bridge.take_passed(&value, now, None);
        let _ = far.bridge.tick(now, None, None);
        assert_eq!(far.bridge.port().rendered().x, 0.0);
    }
}

#[test]
fn no_number_and_no_server_gives_more_than_the_ports_own_limits() {
    // What no decoder lets through is refused here, too.
    for bad in [f64::NAN, f64::INFINITY] {
        let mut far = standing();
        far.pushed();
        let value = far.value(0, bad);
        let felt = far.tick(Some(value));
        assert!((0.0..=1.0).contains(&felt), "{felt}");
        let gone = (0..20).map(|_| far.tick(Some(value))).last();
        assert_eq!(gone, Some(0.0));
    }
    // A server that says it may be felt for a day, and a flood of large ones: force, slew and age stay the port's.
    let mut far = standing();
    let mut last = 0.0;
    for _ in 0..400 {
        let mut value = far.value(0, 1e6);
        (value.hold_ns, value.ramp_out_ns) = (86_400_000 * MS, 86_400_000 * MS);
        let felt = far.tick(Some(value));
        assert!(felt <= SafetySettings::default().max_force + 1e-9, "{felt}");
        assert!(felt - last <= 0.5 + 1e-9, "{last} to {felt} N in a tick");
        last = felt;
    }
    assert!(last > 1.0, "something was felt: {last}");
    let gone: Vec<f64> = (0..120).map(|_| far.tick(None)).collect();
    assert!(gone[115..].iter().all(|force| *force == 0.0), "{gone:?}");
}

#[test]
fn it_ends_when_the_server_says_so_pauses_or_another_session_begins() {
    let mut far = standing();
    far.pushed();
    let none = pass_on(None);
    assert_eq!(none.flags, FORCE_NONE);
    let gone = (0..5).map(|_| far.tick(Some(none))).last();
    assert_eq!(gone, Some(0.0), "by the slew limit");
    far.pushed();
    far.flags = WRENCH_PAUSED;
    for tick in 0..20 {
        let value = far.value(0, 1.0);
        let felt = far.tick(Some(value));
        assert!(tick < 3 || felt == 0.0, "{felt} in a pause");
    }
    far.flags = 0;
    far.pushed();
    far.bridge.begin_session(CommandSource::Same, None);
    let felt = (0..10).map(|_| far.tick(None)).last();
    assert_eq!(felt, Some(0.0));
    far.pushed();
}

#[test]
fn the_axes_are_the_workbenchs_or_those_of_the_body_in_the_hand() {
    for (flags, x, y) in [(0, 1.0, 0.0), (FORCE_IN_BODY, 0.0, 1.0)] {
        let hand = Hand {
            turned: true,
            ..Hand::default()
        };
        let mut far = Far::new(hand, Passivity::Control);
        for _ in 0..200 {
            let mut value = far.value(0, 1.0);
            value.flags = flags;
            far.tick(Some(value));
        }
        let felt = far.bridge.port().rendered();
        assert!((felt.x - x).abs() + (felt.y - y).abs() < 1e-9, "{felt}");
    }
}

#[test]
fn a_sender_that_pumps_energy_gives_no_more_than_the_reserve_and_nothing_where_nobody_keeps_it() {
    let pumped = |mode| {
        let hand = Hand {
            is_free: true,
            velocity: 0.01,
            ..Hand::default()
        };
        let mut far = Far::new(hand, mode);
        for _ in 0..4000 {
            let along = far.hand.lock().expect("the hand").velocity.signum();
            let value = far.value(3, 5.0 * along);
            far.tick(Some(value));
        }
        let hand = far.hand.lock().expect("the hand");
        hand.most_given
    };
    let given = pumped(Passivity::Control);
    // 10 mJ, 1 mJ for each of the 4 s, and what one tick at the speed reached can add.
    assert!(given > 1e-3 && given < 0.01 + 4e-3 + 2e-3, "{given} J");
    assert_eq!(pumped(Passivity::Observe), 0.0, "and it is told, once");
    let mut far = Far::new(Hand::default(), Passivity::Observe);
    let value = far.value(0, 1.0);
    let now = Duration::from_millis(far.time);
    let accepted: Vec<bool> = (0..3)
        .map(|_| far.bridge.take_passed(&value, now, None))
        .collect();
    assert_eq!(accepted, [true, false, false]);
}
