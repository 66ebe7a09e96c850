//! The Polhem text board: the driver on a pseudo-terminal, under a virtual clock, and on lines that are damaged.
#![cfg(unix)]

use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector6};
use taut_bridge::polhem::{Frame, SimulatedPolhem, force_frame};
use taut_bridge::pseudo_terminal::{FarEnd, PseudoTerminal};
use taut_bridge::realtime::monotonic_now;
use taut_bridge::spidar_uart::Counters;
use taut_bridge::{
    ArmDevice, ArmPort, ArmState, Command, CommandSource, Device, DeviceChoice, DeviceFault,
    DevicePort, Hand, InputChoice, Placement, PolhemSettings, Pose, SafetySettings,
};

/// Only a hang takes this long.
const PATIENCE: Duration = Duration::from_secs(60);

fn ms(time: u64) -> Duration {
    Duration::from_millis(time)
}

fn placement() -> Placement {
    Placement::plain(Pose::identity(), Point3::origin())
}

fn port(device: Box<dyn Device>) -> DevicePort {
    let start = Pose::identity();
    let mut port = DevicePort::new(device, SafetySettings::default(), Point3::origin(), &start);
    port.restart(CommandSource::Same);
    port
}

/// A floor 20 mm below the start, with a torque that nobody can render.
fn tick(port: &mut DevicePort, now: Duration) -> (Option<DeviceFault>, f64) {
    let report = port.tick(now, |reading| {
        let below = (-0.02 - reading.sample.pose.translation.vector.z).max(0.0);
        let wrench = Vector6::new(0.0, 0.0, 200.0 * below, 0.0, 0.4, 0.0);
        Some(Command::fresh(now, wrench))
    });
    assert_eq!(report.wrench.fixed_rows::<3>(3).norm(), 0.0, "a torque");
    (report.reading.fault, report.wrench.norm())
}

fn tick_until(port: &mut DevicePort, what: &str, done: impl Fn(Option<DeviceFault>, f64) -> bool) {
    let begun = Instant::now();
    loop {
        let (fault, force) = tick(port, monotonic_now());
        if done(fault, force) {
            return;
        }
        assert!(begun.elapsed() < PATIENCE, "{what}: {fault:?}, {force} N");
        thread::sleep(ms(1));
    }
}

#[test]
fn a_floor_is_felt_through_the_serial_line_and_again_after_the_cable_was_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("polhem");
    let arm = Arc::new(Mutex::new(SimulatedPolhem::new(Hand::LIGHT, None, None)));
    let plug = || PseudoTerminal::start_shared(Arc::clone(&arm), Some(&link)).expect("a terminal");
    let terminal = plug();
    let choice = format!("polhem:{}", link.display())
        .parse()
        .expect("a driver");
    let DeviceChoice::Input(input) = choice else {
        panic!("it is opened");
    };
    assert!(matches!(&input, InputChoice::Polhem(_)));
    let mut port = port(input.open(placement(), 0).expect("it is there"));
    let felt = |fault: Option<DeviceFault>, force: f64| fault.is_none() && force > 0.3;
    tick_until(&mut port, "the floor", felt);
    tick_until(&mut port, "the floor at the arm", |_, _| {
        terminal.device().rendered().z > 0.3
    });

    drop(terminal);
    tick_until(&mut port, "the cable is out", |fault, force| {
        fault.is_some() && force == 0.0
    });
    let terminal = plug();
    tick_until(&mut port, "the cable is in", felt);
    drop(port);
    let begun = Instant::now();
    while terminal.device().rendered().norm() != 0.0 {
        assert!(begun.elapsed() < PATIENCE, "a force stayed");
        thread::sleep(ms(1));
    }
}

/// The wire without a port, under a virtual clock.
#[derive(Clone)]
struct Direct(Arc<Mutex<(SimulatedPolhem, ArmState, [f64; 3])>>);

impl Direct {
    /// A line and its answer.
    fn turn(&self, now: Duration) {
        let (arm, state, force) = &mut *self.0.lock().expect("not poisoned");
        let mut answer = Vec::new();
        arm.take(now, &force_frame(force), &mut answer);
        let frame = Frame::parse(&answer).expect("a line");
        let q = frame.orientation();
        *state = ArmState {
            reports: state.reports + 1,
            is_usable: true,
            position: frame.position,
            orientation: Some([q.w, q.i, q.j, q.k]),
            ..ArmState::default()
        };
    }
}

impl ArmPort for Direct {
    fn newest(&mut self) -> ArmState {
        self.0.lock().expect("not poisoned").1
    }

    fn push(&mut self, force: [f64; 3]) {
        self.0.lock().expect("not poisoned").2 = force;
    }
}

#[test]
fn the_force_is_gone_120_ms_after_the_last_line_and_back_within_a_second() {
    let arm = SimulatedPolhem::new(Hand::LIGHT, None, None);
    let wire = Direct(Arc::new(Mutex::new((arm, ArmState::default(), [0.0; 3]))));
    let device = ArmDevice::new(
        Box::new(wire.clone()),
        PolhemSettings::at("here").arm(),
        placement(),
    );
    let mut port = port(Box::new(device));
    let mut time = 0;
    let mut run = |port: &mut DevicePort, until: u64, answers: bool| {
        let mut zero_since = None;
        while time < until {
            time += 1;
            if answers {
                wire.turn(ms(time));
            }
            let (_, force) = tick(port, ms(time));
            zero_since = if force == 0.0 {
                zero_since.or(Some(time))
            } else {
                None
            };
        }
        zero_since
    };
    assert_eq!(run(&mut port, 3000, true), None, "no floor is felt");
    let gone = run(&mut port, 3300, false).expect("a force without lines");
    assert!(gone <= 3120, "{gone}");
    let _ = run(&mut port, 3900, true);
    assert_eq!(run(&mut port, 4000, true), None, "no force after 0.7 s");
}

/// A linear congruential generator: the same damage each time.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % sides
    }
}

/// Loses, repeats, cuts and changes one line in ten: how many were damaged, and of these believed.
fn damaged_lines(lines: u64) -> (u64, u64) {
    let mut judge = Counters::new(1e-5);
    let mut dice = Dice(5);
    let (mut damaged, mut believed, mut good) = (0, 0, 0);
    let mut last = Vec::new();
    for time in 0..lines {
        let wave = |rate: f64| (rate * time as f64 * 1e-3).sin();
        let truth = Frame {
            position: [0.1 * wave(3.0), 0.08 * wave(4.1), 0.12 * wave(5.3)],
            angles: [
                0.7 * wave(2.0),
                0.5 * wave(1.7),
                0.9 * wave(2.9),
                0.4 * wave(3.7),
            ],
            info: 1,
        };
        let whole = truth.line().expect("short enough").to_vec();
        let mut line = whole.clone();
        let is_damaged = dice.roll(10) == 0;
        if is_damaged {
            damaged += 1;
            let at = dice.roll(line.len() as u64) as usize;
            match dice.roll(5) {
                0 => line.clear(),
                1 => line = last.clone(),
                2 => line.truncate(at),
                3 => line[at] ^= 1 << dice.roll(8),
                _ => drop(line.remove(at)),
            }
        }
        last = whole;
        let Ok(frame) = Frame::parse(&line) else {
            continue;
        };
        let [x, y, z] = frame.position.map(|part| (part / 1e-5) as i16);
        let [a, b, c, d] = frame.angles.map(|part| (part / 1e-4) as i16);
        if judge.take(ms(time), &[x, y, z, a, b, c, d, 0]).is_none() {
            continue;
        }
        good += 1;
        believed += u64::from(is_damaged);
        let off = (0..3)
            .map(|i| (frame.position[i] - truth.position[i]).abs())
            .fold(0.0, f64::max);
        let turned = frame.orientation().angle_to(&truth.orientation());
        // What a hand could have done meanwhile: 150 m/s^2 over two milliseconds, and the line before.
        assert!(
            off <= 3e-3 && turned <= 0.03,
            "{off} m, {turned} rad at {time} ms"
        );
    }
    assert!(good > lines * 7 / 10, "{good} of {lines}");
    (damaged, believed)
}

#[test]
fn no_wrong_pose_is_believed_of_damaged_lines() {
    let (damaged, _) = damaged_lines(100_000);
    assert!(damaged > 5000, "{damaged}");
}

/// `cargo test --release -p taut-bridge --test polhem -- --ignored --nocapture`
#[test]
#[ignore = "minutes"]
fn no_wrong_pose_is_believed_of_ten_million_lines() {
    let (damaged, believed) = damaged_lines(10_000_000);
    println!("{damaged} damaged of 10000000, {believed} of these within what a hand can do");
}
