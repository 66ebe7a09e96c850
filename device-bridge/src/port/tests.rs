//! The port with a device that says whatever a test wants.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use nalgebra::{Point3, Vector6};

mod arming;
mod asking;
mod damping;
mod faults;
mod silence;

use super::*;
use crate::device::{Device, DeviceFault, DeviceInfo, DeviceSample, Pose};
use crate::ms;

type Answer = Result<DeviceSample, DeviceFault>;

/// Gives the sample that it was told to give, and remembers the last write.
struct Puppet {
    info: DeviceInfo,
    answer: Arc<Mutex<Answer>>,
    written: Arc<Mutex<Vector6<f64>>>,
}

impl Device for Puppet {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, _now: Duration) -> Answer {
        *self.answer.lock().expect("no test panics here")
    }

    fn write(&mut self, _now: Duration, wrench: &Vector6<f64>) {
        *self.written.lock().expect("no test panics here") = *wrench;
    }
}

/// A port and the string of its puppet.
struct Stage {
    port: DevicePort,
    answer: Arc<Mutex<Answer>>,
    written: Arc<Mutex<Vector6<f64>>>,
    now: Duration,
    period: Duration,
    /// Of the hand along x, m/s.
    speed: f64,
    events: Vec<SafetyEvent>,
}

const TICK: Duration = Duration::from_millis(1);
/// Age of the last good input from which there is no force: the margin before the promise of 120 ms.
const GONE: Duration = SafetySettings::HOLD.saturating_add(SafetySettings::RAMP_OUT);

/// Never the same twice.
fn sample_at(now: Duration, speed: f64) -> DeviceSample {
    DeviceSample {
        time: now,
        pose: Pose::translation(speed * now.as_secs_f64(), 0.0, 0.0),
        velocity: Vector6::x() * speed,
        buttons: 0,
    }
}

fn sample(now: Duration) -> DeviceSample {
    sample_at(now, 0.2)
}

impl Stage {
    fn new(settings: SafetySettings) -> Self {
        let answer = Arc::new(Mutex::new(Err(DeviceFault::NotStarted)));
        let written = Arc::<Mutex<Vector6<f64>>>::default();
        let puppet = Puppet {
            info: DeviceInfo::ideal("puppet", 6),
            answer: Arc::clone(&answer),
            written: Arc::clone(&written),
        };
        let start = Pose::identity();
        Self {
            port: DevicePort::new(Box::new(puppet), settings, Point3::origin(), &start),
            answer,
            written,
            now: ms(1000),
            period: settings.period,
            speed: 0.2,
            events: Vec::new(),
        }
    }

    /// In full force, and its events forgotten.
    fn armed(settings: SafetySettings, command: Vector6<f64>) -> Self {
        Self::armed_at(0.2, settings, command)
    }

    /// The same with a hand of this speed, m/s.
    fn armed_at(speed: f64, settings: SafetySettings, command: Vector6<f64>) -> Self {
        let mut stage = Self::new(settings);
        stage.speed = speed;
        for _ in 0..700 {
            let _ = stage.good(command);
        }
        assert_eq!(stage.port.state(), ArmingState::Armed, "{:?}", stage.events);
        stage.events.clear();
        stage
    }

    fn tick(&mut self, answer: Answer, command: Option<Command>) -> TickReport {
        self.now += self.period;
        *self.answer.lock().expect("no test panics here") = answer;
        let report = self.port.tick(self.now, |_| command);
        self.events.extend(report.events.iter());
        report
    }

    /// A sample in order, with a command of 10 N that was made at `made`: the force then, N.
    fn felt_of(&mut self, made: Duration) -> f64 {
        let sample = sample(self.now + TICK);
        let command = Command::fresh(made, force(10.0));
        self.tick(Ok(sample), Some(command)).wrench[0]
    }

    /// Ticks in order with these buttons held, commanded 10 N: the force then, N.
    fn held(&mut self, ticks: u32, buttons: u16) -> f64 {
        for _ in 0..ticks {
            let now = self.now + TICK;
            let held = DeviceSample {
                buttons,
                ..sample(now)
            };
            let _ = self.tick(Ok(held), Some(Command::fresh(now, force(10.0))));
        }
        self.port.rendered()[0]
    }

    /// Armed by a person, then asked not to be for 30 ms, and to be armed again.
    fn asked_on_the_way_down() -> Self {
        let mut stage = Self::armed_by_a_person();
        stage.port.ask_to_disarm();
        stage.good_for(ms(30), force(10.0));
        stage.port.ask_to_arm();
        stage
    }

    /// A tick with everything in order.
    fn good(&mut self, wrench: Vector6<f64>) -> TickReport {
        let now = self.now + self.period;
        let sample = sample_at(now, self.speed);
        self.tick(Ok(sample), Some(Command::fresh(now, wrench)))
    }

    /// Everything in order until `time` from now.
    fn good_for(&mut self, time: Duration, wrench: Vector6<f64>) {
        let end = self.now + time;
        while self.now < end {
            let _ = self.good(wrench);
        }
    }

    /// The newest command stays `made`.
    fn silent_for(&mut self, time: Duration, wrench: Vector6<f64>) {
        let (made, end) = (self.now, self.now + time);
        while self.now < end {
            let now = self.now + self.period;
            let sample = sample_at(now, self.speed);
            let _ = self.tick(Ok(sample), Some(Command::fresh(made, wrench)));
        }
    }

    /// Armed by a person, in full force, and its events forgotten.
    fn armed_by_a_person() -> Self {
        let mut stage = Self::new(manual());
        let _ = stage.good(force(10.0));
        stage.port.ask_to_arm();
        stage.good_for(ms(700), force(10.0));
        assert_eq!(stage.port.state(), ArmingState::Armed);
        stage.events.clear();
        stage
    }

    fn kinds(&self) -> Vec<EventKind> {
        self.events.iter().map(|event| event.kind).collect()
    }
}

fn force(newtons: f64) -> Vector6<f64> {
    Vector6::x() * newtons
}

fn manual() -> SafetySettings {
    SafetySettings {
        rearm: Rearm::Manual,
        ..SafetySettings::default()
    }
}

#[test]
fn a_stalled_port_drops_the_force_by_the_slew_limit() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    let last = stage.now;
    stage.now += ms(5000);
    let mut before = 10.0;
    for _ in 0..20 {
        let felt = stage.felt_of(last);
        // The first write uses up 2 ms, not five seconds.
        let most = if before == 10.0 { 1.0 } else { 0.5 };
        assert!(before - felt <= most + 1e-9);
        before = felt;
    }
    assert_eq!(before, 0.0);
    assert_eq!(stage.kinds()[0], EventKind::PortStalled);
}

/// A bridge between two sessions has no loop: its device is not late, it is not read.
#[test]
fn a_pause_after_the_force_was_led_down_is_no_stall() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    while !stage.port.release_step(stage.now) {
        stage.now += TICK;
    }
    stage.now += ms(4900);
    let _ = stage.good(force(0.0));
    assert!(!stage.kinds().contains(&EventKind::PortStalled));
    // Only that pause: the loop is held to its time again.
    stage.now += ms(4900);
    let _ = stage.good(force(0.0));
    assert!(stage.kinds().contains(&EventKind::PortStalled));
}

#[test]
fn a_tick_that_comes_early_limits_without_a_word() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    let mut early = |newtons: f64| {
        stage.now -= TICK * 19 / 20; // `tick` adds a whole one
        let now = stage.now + TICK;
        let felt = stage
            .tick(Ok(sample(now)), Some(Command::fresh(now, force(newtons))))
            .wrench[0];
        (felt, stage.kinds())
    };
    let (felt, events) = early(10.2);
    // 0.05 ms: 0.025 N, and 0.2 m/s explain 0.015 N more.
    assert!((felt - 10.04).abs() < 1e-3, "{felt} N");
    assert_eq!(events, []);
    let (_, events) = early(12.0);
    assert_eq!(events, [EventKind::ForceSlewLimited]);
}

#[test]
fn limits_that_could_not_fade_in_time_are_lowered() {
    let settings = SafetySettings {
        max_force: 200.0,
        ..SafetySettings::default()
    };
    let stage = Stage::new(settings);
    let reach = SafetySettings::FORCE_RATE * SafetySettings::RAMP_OUT.as_secs_f64();
    assert_eq!(stage.port.settings().max_force, reach);
}

#[test]
fn at_the_end_of_a_loop_the_force_comes_down_without_a_reading() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    let mut before = 10.0;
    let mut steps = 0;
    loop {
        stage.now += TICK;
        let done = stage.port.release_step(stage.now);
        let felt = stage.port.rendered()[0];
        assert!(before - felt <= 0.5 + 1e-9);
        before = felt;
        steps += 1;
        if done {
            break;
        }
    }
    assert_eq!((steps, before), (20, 0.0));
}

#[test]
fn a_port_that_is_dropped_leaves_no_force() {
    let stage = Stage::armed(SafetySettings::default(), force(10.0));
    let written = Arc::clone(&stage.written);
    assert_eq!(*written.lock().expect("whole"), force(10.0));
    drop(stage);
    assert_eq!(*written.lock().expect("whole"), Vector6::zeros());
}

#[test]
fn a_device_that_is_taken_out_of_its_port_renders_no_force() {
    let stage = Stage::armed(SafetySettings::default(), force(10.0));
    let written = Arc::clone(&stage.written);
    let device = stage.port.into_device();
    assert_eq!(*written.lock().expect("whole"), Vector6::zeros());
    assert_eq!(device.info().actuated_degrees_of_freedom, 6);
}

#[test]
fn a_wall_met_faster_than_the_slew_limit_is_felt_as_it_is() {
    // 1000 N/m at 0.9 m/s: 0.9 N/ms, in either direction; the force answers the sample before.
    for sign in [1.0, -1.0] {
        let mut stage = Stage::armed_at(0.9 * sign, SafetySettings::default(), force(0.0));
        for tick in 0..20 {
            let asked = force(sign * 0.9 * f64::from(tick));
            assert_eq!(stage.good(asked).wrench, asked);
        }
        assert_eq!(stage.events, []);
    }
}

#[test]
fn what_no_motion_explains_is_limited_whatever_the_command_says() {
    // A hostile server: 20 N at once. The hand nearly rests, or moves.
    for (speed, most) in [(1e-6, 0.5), (0.2, 0.8), (2.9, 2.5)] {
        let mut stage = Stage::armed_at(speed, SafetySettings::default(), force(0.0));
        let felt = stage.good(force(20.0)).wrench[0];
        assert!(felt <= most + 1e-3, "{felt} N at {speed} m/s");
    }
}

#[test]
fn a_slow_loop_renders_what_it_can_take_away_in_time() {
    let at = |hz: u32| SafetySettings {
        period: Duration::from_secs(1) / hz,
        ..SafetySettings::default()
    };
    let max_force = |hz| Stage::new(at(hz)).port.settings().max_force;
    // 8 writes of 1 N at 100 Hz.
    assert_eq!(max_force(100), 8.0);
    for hz in [300, 1000, 4000] {
        assert_eq!(max_force(hz), 20.0);
    }
}
