//! The WoodenHaptics HID board: the driver on a socket in place of hidraw, under a virtual clock, and on reports that are damaged.
#![cfg(unix)]

use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3, Vector6};
use taut_bridge::realtime::monotonic_now;
use taut_bridge::spidar_uart::Counters;
use taut_bridge::wooden::{
    BoardReport, HostReport, SimulatedWooden, WOODEN_MODELS, WoodenModel, WoodenService,
};
use taut_bridge::{
    ArmDevice, ArmPort, ArmState, Command, CommandSource, Device, DeviceChoice, DeviceFault,
    DevicePort, Hand, InputChoice, Placement, Pose, SafetySettings, WoodenSettings,
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
fn a_floor_is_felt_through_the_reports_and_again_after_the_cable_was_out() {
    for model in ["woodenhaptics-2019", "polhem-1"] {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("board");
        let numbers = WoodenModel::named(model).expect("published");
        let arm = Arc::new(Mutex::new(SimulatedWooden::new(
            numbers,
            Hand::LIGHT,
            None,
            None,
        )));
        let plug = || WoodenService::start(Arc::clone(&arm), &path).expect("a socket");
        let service = plug();
        let choice = format!("wooden={},model={model}", path.display())
            .parse()
            .expect("a driver");
        let DeviceChoice::Input(input) = choice else {
            panic!("it is opened");
        };
        assert!(matches!(&input, InputChoice::Wooden(_)));
        let device = input.open(placement(), 0).expect("it is there");
        let sensed = if model == "polhem-1" { 6 } else { 3 };
        assert_eq!(device.info().sensed_degrees_of_freedom, sensed);
        let mut port = port(device);
        let felt = |fault: Option<DeviceFault>, force: f64| fault.is_none() && force > 0.3;
        tick_until(&mut port, "the floor", felt);
        tick_until(&mut port, "the floor at the arm", |_, _| {
            service.arm().rendered().z > 0.3
        });

        drop(service);
        tick_until(&mut port, "the cable is out", |fault, force| {
            fault.is_some() && force == 0.0
        });
        let service = plug();
        tick_until(&mut port, "the cable is in", felt);
        drop(port);
        let begun = Instant::now();
        while service.arm().rendered().norm() > 0.0 {
            assert!(begun.elapsed() < PATIENCE, "a force stayed");
            thread::sleep(ms(1));
        }
    }
}

#[test]
fn a_board_that_is_not_there_is_a_sentence() {
    let DeviceChoice::Input(input) = "wooden=/dev/no-such-hidraw".parse().expect("a driver") else {
        panic!("it is opened");
    };
    let error = input
        .open(placement(), 0)
        .err()
        .expect("nothing there")
        .to_string();
    assert!(
        error.contains("can be opened") && error.contains("udev"),
        "{error}"
    );
}

/// The wire without a socket, under a virtual clock.
#[derive(Clone)]
struct Direct(Arc<Mutex<Ends>>);

/// Arm, newest state, force and encoders.
type Ends = (SimulatedWooden, ArmState, [f64; 3], [i16; 6]);

const MODEL: WoodenModel = WOODEN_MODELS[0];

impl Direct {
    /// A report and its answer.
    fn turn(&self, now: Duration) {
        let (arm, state, force, encoders) = &mut *self.0.lock().expect("not poisoned");
        let currents = MODEL.currents(encoders, &Vector3::from(*force));
        let answer = arm.take(now, &HostReport::Currents(currents).bytes());
        *encoders = BoardReport::parse(&answer).expect("a report").encoders;
        *state = ArmState {
            reports: state.reports + 1,
            is_usable: true,
            position: MODEL.position(encoders).into(),
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
fn the_force_is_gone_120_ms_after_the_last_report_and_back_within_a_second() {
    let arm = SimulatedWooden::new(MODEL, Hand::LIGHT, None, None);
    let wire = Direct(Arc::new(Mutex::new((
        arm,
        ArmState::default(),
        [0.0; 3],
        MODEL.home,
    ))));
    let device = ArmDevice::new(
        Box::new(wire.clone()),
        WoodenSettings::default().arm(),
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
    assert_eq!(run(&mut port, 4500, true), None, "no floor is felt");
    let gone = run(&mut port, 4800, false).expect("a force without reports");
    assert!(gone <= 4620, "{gone}");
    let _ = run(&mut port, 5400, true);
    assert_eq!(run(&mut port, 5500, true), None, "no force after 0.7 s");
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

/// Loses, repeats, cuts and changes one report in ten: how many were damaged, and of these believed.
fn damaged_reports(reports: u64) -> (u64, u64) {
    let mut judge = Counters::new(MODEL.metres_per_count());
    let mut dice = Dice(5);
    let (mut damaged, mut believed, mut good) = (0, 0, 0);
    let mut last = Vec::new();
    for time in 0..reports {
        let wave = |rate: f64| (rate * time as f64 * 1e-3).sin();
        let place = Vector3::new(0.03 * wave(3.0), 0.03 * wave(2.1), 0.03 * wave(4.3));
        let encoders = MODEL.encoders(&place).expect("within reach");
        let whole = BoardReport { encoders, info: 1 }.bytes().to_vec();
        let mut report = whole.clone();
        let is_damaged = dice.roll(10) == 0;
        if is_damaged {
            damaged += 1;
            let at = dice.roll(report.len() as u64) as usize;
            match dice.roll(5) {
                0 => report.clear(),
                1 => report = last.clone(),
                2 => report.truncate(at),
                3 => report[at] ^= 1 << dice.roll(8),
                _ => drop(report.remove(at)),
            }
        }
        last = whole;
        let Some(heard) = BoardReport::parse(&report) else {
            continue;
        };
        let [a, b, c, d, e, f] = heard.encoders;
        if judge.take(ms(time), &[a, b, c, d, e, f, 0, 0]).is_none() {
            continue;
        }
        good += 1;
        believed += u64::from(is_damaged);
        let off = (MODEL.position(&heard.encoders) - place).norm();
        // What a hand could have done meanwhile: 150 m/s^2 over two milliseconds, and the report before.
        assert!(off <= 4e-3, "{off} m at {time} ms");
    }
    assert!(good > reports * 7 / 10, "{good} of {reports}");
    (damaged, believed)
}

#[test]
fn no_wrong_pose_is_believed_of_damaged_reports() {
    let (damaged, _) = damaged_reports(100_000);
    assert!(damaged > 5000, "{damaged}");
}

/// `cargo test --release -p taut-bridge --test wooden -- --ignored --nocapture`
#[test]
#[ignore = "minutes"]
fn no_wrong_pose_is_believed_of_ten_million_reports() {
    let (damaged, believed) = damaged_reports(10_000_000);
    println!("{damaged} damaged of 10000000, {believed} of these within what a hand can do");
}
