//! The Haply driver against the simulated service: over sockets, under a virtual clock, and on messages that are damaged.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::process::{Child, Command as Program, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use crate::support::faulty::BAD_LINE;
use crate::support::floor::{Dice, OnFloor, floor};
use crate::support::stage::{Faults, HANGS, Inside, UNPLUGGED, VICE, no_write_jumps};
use crate::support::{ms, wait_until};
use nalgebra::{Point3, Similarity3, UnitQuaternion, Vector3, Vector6};
use taut_bridge::haply::{
    Exchange, ExchangeSettings, HaplyService, ServiceAddress, SimulatedInverse, SimulatedSettings,
};
use taut_bridge::realtime::request_fifo;
use taut_bridge::{
    Anchor, ArmDevice, ArmPort, ArmState, Device, Hand, HaplySettings, MinJerkPath, Placement,
    Pose, SafetySettings,
};

/// Above everything that is tested.
const SERVICE_PRIORITY: u8 = 85;

fn placement() -> Placement {
    Placement::plain(
        Pose::translation(0.0, 0.0, 0.1),
        Point3::new(0.0, 0.0, 0.01),
    )
}

fn simulated(with_grip: bool) -> SimulatedInverse {
    SimulatedInverse::new(&SimulatedSettings {
        with_grip,
        ..SimulatedSettings::held(Hand::LIGHT)
    })
}

fn settings(address: SocketAddr) -> HaplySettings {
    HaplySettings {
        address: address.to_string().parse().expect("an address"),
        ..HaplySettings::default()
    }
}

fn at_wall(device: ArmDevice) -> OnFloor {
    OnFloor::new(Box::new(device), &placement(), floor)
}

#[test]
fn a_wall_is_felt_through_the_wire_and_again_after_every_outage() {
    let any = "127.0.0.1:0".parse().expect("an address");
    let service = HaplyService::start(any, simulated(true)).expect("a free port");
    let device = settings(service.address())
        .open(placement(), 0)
        .expect("it is there");
    assert_eq!(device.info().actuated_degrees_of_freedom, 3);
    let mut held = at_wall(device);
    held.until_felt("the wall");
    held.until("the wall at the arm", |_, _| service.totals().force > 0.3);

    service.set_plugged(false);
    held.until_gone("the cable is out");
    assert_eq!(service.totals().force, 0.0);
    service.set_plugged(true);
    held.until_felt("the cable is in");

    // A service that hangs: its connection is given up.
    let before = service.totals().sessions;
    service.set_mute(true);
    held.until_gone("it hangs");
    held.until("the next one", |_, _| service.totals().sessions > before);
    service.set_mute(false);
    held.until_felt("it goes on");

    // Another service at the same place.
    let address = service.address();
    drop(service);
    held.until_gone("it is gone");
    let service = HaplyService::start(address, simulated(true)).expect("the port again");
    held.until_felt("another one");

    drop(held);
    wait_until("a force stayed", || service.totals().force == 0.0);
}

/// A service that is mute or without its arm for a while. What it was told while it was mute it forgets.
struct Sometimes(HaplyService);

impl Inside for Sometimes {
    fn get(&self, name: &str) -> i64 {
        let totals = self.0.totals();
        match name {
            "force" => (totals.force * 1e6) as i64,
            "jump" => (totals.largest_jump * 1e6) as i64,
            "writes" => totals.messages as i64,
            "served" => 1,
            other => panic!("{other}"),
        }
    }

    fn set(&self, name: &str, value: i64) {
        if name == "mode" {
            self.0.set_mute(value == HANGS);
            self.0.set_plugged(value != UNPLUGGED);
        }
    }
}

#[test]
fn no_message_to_the_arm_jumps() {
    let any = "127.0.0.1:0".parse().expect("an address");
    let held = SimulatedSettings {
        path: Some(MinJerkPath::hold(Pose::translation(0.0, -0.1, 0.16))),
        ..SimulatedSettings::held(VICE)
    };
    // What the scheduler does to the device's own side is no fault of the driver: where the system grants it, that side is never late.
    let service = thread::scope(|scope| {
        let started = scope.spawn(|| {
            let _granted = request_fifo(SERVICE_PRIORITY);
            HaplyService::start(any, SimulatedInverse::new(&held))
        });
        started.join().expect("no panic").expect("a free port")
    });
    let choice = format!("haply={}", service.address());
    let faults = Faults {
        modes: &[HANGS, UNPLUGGED],
        ..BAD_LINE
    };
    no_write_jumps(&choice, &Sometimes(service), &faults);
}

#[test]
fn who_comes_after_a_pause_finds_the_hand_where_it_began_and_an_outage_moves_nothing() {
    let mut service = simulated(true);
    let height = |service: &SimulatedInverse| service.true_pose().translation.vector.z;
    let _ = service.inventory(ms(0), 1);
    let begin = height(&service);
    let no_force = r#"{"inverse3":[{"device_id":"51A3","commands":{"set_cursor_force":{"vector":{"x":0,"y":0,"z":0}}}}]}"#;
    (1..=30).for_each(|step| drop(service.answer(ms(step), 1, "{}")));
    assert_eq!(height(&service), begin, "who only looks moves nothing");
    let low = |service: &mut SimulatedInverse, from: u64, session| {
        let _ = service.answer(ms(from + 50), session, no_force);
        (1..=30).for_each(|step| service.advance(ms(from + 100 * step)));
        height(service) < begin - 0.04
    };
    assert!(low(&mut service, 0, 1), "it goes down in three seconds");
    service.leave(ms(3000), 1);
    let _ = service.inventory(ms(3200), 2);
    assert!(height(&service) < begin - 0.04, "the same program again");
    let _ = service.inventory(ms(3300), 3);
    service.leave(ms(3400), 2);
    let _ = service.inventory(ms(4900), 4);
    assert!(height(&service) != begin, "another was there all the time");
    service.leave(ms(5000), 3);
    service.leave(ms(5000), 4);
    let _ = service.inventory(ms(6100), 5);
    assert_eq!(height(&service), begin);
    assert!(low(&mut service, 6100, 5), "it goes down for the next one");
}

/// A service that is ended by the end of its test.
struct Played(Child);

impl Drop for Played {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn play(bind: &str) -> (Played, SocketAddr) {
    let mut child = Program::new(env!("CARGO_BIN_EXE_taut-bridge"))
        .args([
            "simulate-device",
            "haply",
            "--hand",
            "light",
            "--bind",
            bind,
        ])
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let out = child.stdout.take().expect("piped");
    let played = Played(child);
    let mut line = String::new();
    BufReader::new(out).read_line(&mut line).expect("a line");
    let address = line.trim().rsplit('=').next().expect("an address");
    (played, address.parse().unwrap_or_else(|_| panic!("{line}")))
}

#[test]
fn a_service_in_a_process_of_its_own_is_killed_and_comes_back() {
    let (played, address) = play("127.0.0.1:0");
    let device = settings(address).open(placement(), 0).expect("it is there");
    let mut held = at_wall(device);
    held.until_felt("the wall");
    drop(played);
    held.until_gone("it is killed");
    let _played = play(&address.to_string());
    held.until_felt("it is back");
}

#[test]
fn an_old_service_and_none_are_each_a_sentence() {
    let any = "127.0.0.1:0".parse().expect("an address");
    let old = r#"{"project_version":"3.4.2.0"}"#;
    let service = HaplyService::start_as(any, simulated(true), old).expect("a free port");
    let open = |address| settings(address).open(placement(), 0);
    let error = open(service.address()).err().expect("too old").to_string();
    assert!(
        error.contains("has version 3.4") && error.contains("install a newer one"),
        "{error}"
    );
    let address = service.address();
    drop(service);
    let error = open(address).err().expect("gone").to_string();
    assert!(
        error.contains("no Inverse service answers at") && error.contains("start it"),
        "{error}"
    );
}

/// The wire without sockets: an exchange and a simulated service, a message per newest state that is asked for.
#[derive(Clone)]
struct Wire(Arc<Mutex<Ends>>);

struct Ends {
    exchange: Exchange,
    service: SimulatedInverse,
    now: Duration,
    force: [f64; 3],
}

impl Wire {
    fn new(with_grip: bool) -> Self {
        let mut service = simulated(with_grip);
        let mut exchange = Exchange::new(ExchangeSettings::default());
        exchange
            .hear(&service.inventory(Duration::ZERO, 1))
            .expect("an inventory");
        let wire = Self(Arc::new(Mutex::new(Ends {
            exchange,
            service,
            now: Duration::ZERO,
            force: [0.0; 3],
        })));
        // The arm's axes are set and confirmed.
        while wire.with(|ends| ends.exchange.unusable().is_some()) {
            wire.turn(Duration::ZERO);
        }
        wire
    }

    fn with<T>(&self, change: impl FnOnce(&mut Ends) -> T) -> T {
        change(&mut self.0.lock().expect("not poisoned"))
    }

    /// A message and its answer.
    fn turn(&self, now: Duration) {
        self.with(|ends| {
            ends.now = now;
            let say = ends.exchange.say(Some(ends.force)).to_owned();
            let answer = ends.service.answer(now, 1, &say);
            ends.exchange.hear(&answer).expect("an answer");
        });
    }
}

impl ArmPort for Wire {
    fn newest(&mut self) -> ArmState {
        self.with(|ends| *ends.exchange.state())
    }

    fn push(&mut self, force: [f64; 3]) {
        self.with(|ends| ends.force = force);
    }
}

fn wired(with_grip: bool) -> (Wire, OnFloor) {
    let wire = Wire::new(with_grip);
    let device = ArmDevice::new(
        Box::new(wire.clone()),
        HaplySettings::default().arm(),
        placement(),
    );
    (wire, at_wall(device))
}

#[test]
fn the_force_is_gone_120_ms_after_the_last_answer_and_back_within_a_second() {
    for unplugs in [false, true] {
        let (wire, mut held) = wired(true);
        let turn = |now| wire.turn(now);
        assert_eq!(held.run(3000, turn), None, "no wall is felt");
        let gone = if unplugs {
            wire.with(|ends| ends.service.set_plugged(false));
            held.run(3500, turn)
        } else {
            held.run(3500, |_| ())
        };
        let gone = gone.expect("a force without a device");
        assert!(gone <= 3120, "{gone}");
        wire.with(|ends| ends.service.set_plugged(true));
        assert_eq!(held.run(4500, turn), None, "no force after a second");
    }
}

#[test]
fn the_body_follows_the_cursor_and_the_grip_in_every_frame() {
    // A workbench that is turned and drawn twice as large, and an arm whose service has other axes.
    let placement = Placement {
        start: Pose::new(Vector3::new(0.0, 0.0, 0.1), Vector3::x() * 0.5),
        reference_point: Point3::new(0.0, 0.02, 0.0),
        workbench_from_world: Similarity3::from_parts(
            Vector3::new(0.0, -0.4, 0.2).into(),
            UnitQuaternion::from_scaled_axis(Vector3::z() * 0.7),
            2.0,
        ),
    };
    for with_grip in [true, false] {
        let wire = Wire::new(with_grip);
        let mut settings = HaplySettings::default();
        settings.mapping.axes = "x z -y".parse().expect("axes");
        let mut device = ArmDevice::new(Box::new(wire.clone()), settings.arm(), placement);
        wire.turn(ms(1));
        let first = device.read(ms(1)).expect("a sample");
        let start = placement.start;
        assert!((first.pose.to_homogeneous() - start.to_homogeneous()).norm() < 1e-9);
        let then = wire.with(|ends| ends.service.true_pose());
        for time in 2..1500 {
            wire.turn(ms(time));
            assert!(device.read(ms(time)).is_ok());
        }
        let sample = device.read(ms(1500)).expect("a sample");
        let now = wire.with(|ends| ends.service.true_pose());
        let moved = now.translation.vector - then.translation.vector;
        assert!(moved.norm() > 0.02, "the hand has moved");
        // Arm x z -y on the workbench, half as large in the world, which is turned by -0.7 rad.
        let on_workbench = Vector3::new(moved.x, moved.z, -moved.y);
        let wanted = placement.vector_in_world(&on_workbench);
        let g = placement.reference_point;
        let travelled = sample.pose * g - start * g;
        assert!((travelled - wanted).norm() < 1e-7, "{travelled} {wanted}");

        // A force in the world is one of the same size along the arm's axes; a torque is none.
        device.write(ms(1500), &Vector6::new(1.0, 0.0, 0.5, 0.2, 0.2, 0.2));
        let turned = placement.workbench_from_world.isometry.rotation * Vector3::new(1.0, 0.0, 0.5);
        let pushed = wire.with(|ends| ends.force);
        let wanted = [turned.x, -turned.z, turned.y];
        assert!(
            pushed
                .iter()
                .zip(wanted)
                .all(|(a, b)| (a - b).abs() < 1e-12),
            "{pushed:?}"
        );
        // What moves along a force does work of one sign in both frames.
        let work = turned.dot(&on_workbench);
        assert!((Vector3::from(pushed).dot(&moved) - work).abs() < 1e-9);
        device.write(ms(1501), &Vector6::repeat(f64::NAN));
        assert_eq!(wire.with(|ends| ends.force), [0.0; 3]);
    }
}

#[test]
fn a_prop_stands_where_the_arm_is_and_forces_of_two_programs_add_up() {
    let wire = Wire::new(false);
    let settings = HaplySettings {
        anchor: Anchor::Workbench,
        ..HaplySettings::default()
    };
    let mut device = ArmDevice::new(Box::new(wire.clone()), settings.arm(), placement());
    wire.turn(ms(1));
    // The middle of the arm's workspace is the workbench's origin, and there is G.
    let sample = device.read(ms(1)).expect("a sample");
    assert!((sample.pose * placement().reference_point).coords.norm() < 1e-6);

    let push = |z: f64| {
        format!(
            r#"{{"session":{{}},"inverse3":[{{"device_id":"51A3","commands":{{"set_cursor_force":{{"vector":{{"x":0,"y":0,"z":{z}}}}}}}}}]}}"#
        )
    };
    wire.with(|ends| {
        let service = &mut ends.service;
        let _ = service.answer(ms(2), 1, &push(0.5));
        let _ = service.answer(ms(2), 2, &push(0.25));
        assert!((service.held().rendered().z - 0.75).abs() < 1e-12);
        // A message without a force ends the force of its session; silence ends the other.
        let _ = service.answer(ms(3), 1, r#"{"session":{}}"#);
        assert!((service.held().rendered().z - 0.25).abs() < 1e-12);
        service.advance(ms(60));
        assert_eq!(service.held().rendered().z, 0.0);
    });
}

/// Where a hand leads the cursor, m, and how it turns the grip.
fn smooth(time_s: f64) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let wave = |rate: f64| (rate * time_s).sin();
    let position = Vector3::new(
        0.05 * wave(3.0),
        -0.1 + 0.04 * wave(4.1),
        0.16 + 0.06 * wave(5.3),
    );
    let turn = Vector3::new(0.5 * wave(2.0), 0.4 * wave(3.3), 0.3 * wave(1.1));
    (position, UnitQuaternion::from_scaled_axis(turn))
}

/// The service's answer, as it writes one.
fn answer_of(position: &Vector3<f64>, turn: &UnitQuaternion<f64>) -> String {
    let (p, q) = (position, turn.quaternion());
    format!(
        r#"{{"inverse3":[{{"device_id":"51A3","state":{{"control_mode":"force","cursor_position":{{"x":{:.8},"y":{:.8},"z":{:.8}}},"cursor_velocity":{{"x":0.01,"y":0.0,"z":0.0}}}},"status":{{"calibrated":true,"ready":true}}}}],"session_id":1,"wireless_verse_grip":[{{"device_id":"61A3","state":{{"buttons":{{"a":false}},"orientation":{{"w":{:.8},"x":{:.8},"y":{:.8},"z":{:.8}}}}},"status":{{"connected":true,"ready":true}}}}]}}"#,
        p.x, p.y, p.z, q.w, q.i, q.j, q.k
    )
}

/// The answer lost, cut off, with another bit, without some bytes, or the one `before` in its place.
fn damage(answer: &str, before: &str, dice: &mut Dice) -> Option<String> {
    let mut bytes = answer.as_bytes().to_vec();
    let at = dice.roll(bytes.len() as u64) as usize;
    match dice.roll(5) {
        0 => return None,
        1 => return Some(before.to_owned()),
        2 => bytes.truncate(at),
        3 => bytes[at] ^= 1 << dice.roll(8),
        _ => {
            let to = (at + 1 + dice.roll(40) as usize).min(bytes.len());
            bytes.drain(at..to);
        }
    }
    String::from_utf8(bytes).ok()
}

/// Loses, holds back, cuts and changes one answer in twenty: how many were damaged, and of these believed.
fn damaged_frames(frames: u64) -> (u64, u64) {
    let (wire, held) = wired(true);
    let mut port = held.port;
    let limits = SafetySettings::default().validation;
    let (g, start) = (placement().reference_point, placement().start);
    let mut dice = Dice(7);
    let (mut damaged, mut believed, mut good) = (0, 0, 0);
    let mut last = String::new();
    let mut trusted = Duration::ZERO;
    let origin = smooth(1e-3);
    for frame in 1..=frames {
        let now = ms(frame);
        let (position, turn) = smooth(now.as_secs_f64());
        let answer = answer_of(&position, &turn);
        let is_damaged = frame > 1 && dice.roll(20) == 0;
        damaged += u64::from(is_damaged);
        let heard = if is_damaged {
            damage(&answer, &last, &mut dice)
        } else {
            Some(answer.clone())
        };
        last = answer;
        wire.with(|ends| {
            if let Some(heard) = heard {
                let _ = ends.exchange.hear(&heard); // refused or not: the device tells
            }
        });
        let report = port.tick(now, |_| None);
        if report.reading.fault.is_some() || report.reading.sample.time != now {
            continue;
        }
        good += 1;
        believed += u64::from(is_damaged);
        let sample = report.reading.sample;
        let moved = position - origin.0;
        let wrong = (sample.pose * g - start * g - moved).norm();
        // A message has no checksum of its own (TCP has one): what may pass is what a hand could have done since the state that was believed before, and back.
        let passed = now.saturating_sub(trusted).as_secs_f64() + 1e-3;
        assert!(
            wrong <= 2.0 * limits.max_speed * passed,
            "{wrong} m at {now:?}"
        );
        let turned = sample
            .pose
            .rotation
            .angle_to(&(turn * origin.1.inverse() * start.rotation));
        assert!(
            turned <= 2.0 * limits.max_turn_rate * passed,
            "{turned} rad at {now:?}"
        );
        trusted = now;
    }
    assert!(good > frames / 4, "{good} of {frames}");
    (damaged, believed)
}

#[test]
fn no_wrong_pose_is_believed_of_damaged_answers() {
    let (damaged, _) = damaged_frames(100_000);
    assert!(damaged > 4000, "{damaged}");
}

/// `cargo test --release -p taut-bridge --test all haply:: -- --ignored --nocapture`
#[test]
#[ignore = "minutes"]
fn no_wrong_pose_is_believed_of_ten_million_answers() {
    let (damaged, believed) = damaged_frames(10_000_000);
    println!("{damaged} damaged of 10000000, {believed} of these within what a hand can do");
}

#[test]
fn an_address_names_a_service() {
    assert_eq!(ServiceAddress::default().to_string(), "127.0.0.1:10001");
}
