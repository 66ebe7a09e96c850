//! The port with a device that says whatever a test wants.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use nalgebra::{Point3, Vector6};
use proptest::prelude::*;

use super::*;
use crate::device::{Device, DeviceFault, DeviceInfo, DeviceLimits, DeviceSample, Pose};

type Answer = Result<DeviceSample, DeviceFault>;

/// Gives the sample that it was told to give.
struct Puppet {
    info: DeviceInfo,
    answer: Arc<Mutex<Answer>>,
}

impl Device for Puppet {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, _now: Duration) -> Answer {
        *self.answer.lock().expect("no test panics here")
    }

    fn write(&mut self, _now: Duration, _wrench: &Vector6<f64>) {}
}

/// A port and the string of its puppet.
struct Stage {
    port: DevicePort,
    answer: Arc<Mutex<Answer>>,
    now: Duration,
    told: Vec<SafetyEvent>,
}

const TICK: Duration = Duration::from_millis(1);
/// Age of the last good input from which there is no force: the margin before the promise of 120 ms.
const GONE: Duration = SafetySettings::HOLD.saturating_add(SafetySettings::RAMP_OUT);

fn ms(time: u64) -> Duration {
    Duration::from_millis(time)
}

fn sample(now: Duration) -> DeviceSample {
    // 0.2 m/s, never the same twice.
    let x = 0.2 * now.as_secs_f64();
    DeviceSample {
        time: now,
        pose: Pose::translation(x, 0.0, 0.0),
        velocity: Vector6::x() * 0.2,
        buttons: 0,
    }
}

impl Stage {
    fn new(settings: SafetySettings) -> Self {
        let answer = Arc::new(Mutex::new(Err(DeviceFault::NotStarted)));
        let puppet = Puppet {
            info: DeviceInfo {
                name: "puppet".to_owned(),
                sensed_degrees_of_freedom: 6,
                actuated_degrees_of_freedom: 6,
                limits: DeviceLimits::UNLIMITED,
                rate_hz: 1000.0,
            },
            answer: Arc::clone(&answer),
        };
        let start = Pose::identity();
        Self {
            port: DevicePort::new(Box::new(puppet), settings, Point3::origin(), &start),
            answer,
            now: ms(1000),
            told: Vec::new(),
        }
    }

    /// In full force, and its events forgotten.
    fn armed(settings: SafetySettings, command: Vector6<f64>) -> Self {
        let mut stage = Self::new(settings);
        for _ in 0..700 {
            let _ = stage.good(command);
        }
        assert_eq!(stage.port.state(), ArmingState::Armed, "{:?}", stage.told);
        stage.told.clear();
        stage
    }

    fn tick(&mut self, answer: Answer, command: Option<Command>) -> TickReport {
        self.now += TICK;
        *self.answer.lock().expect("no test panics here") = answer;
        let report = self.port.tick(self.now, |_| command);
        self.told.extend(report.events.iter());
        report
    }

    /// A tick with everything in order.
    fn good(&mut self, wrench: Vector6<f64>) -> TickReport {
        let now = self.now + TICK;
        self.tick(Ok(sample(now)), Some(Command::fresh(now, wrench)))
    }

    fn kinds(&self) -> Vec<EventKind> {
        self.told.iter().map(|event| event.kind).collect()
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
fn the_force_ramps_in_by_itself_or_when_somebody_asks() {
    let mut stage = Stage::new(SafetySettings::default());
    for tick in 0..=500 {
        let felt = stage.good(force(10.0)).wrench[0];
        assert!(
            (felt - 10.0 * f64::from(tick) / 500.0).abs() < 1e-9,
            "{tick}: {felt}"
        );
    }
    assert_eq!(stage.kinds(), [EventKind::Arming, EventKind::Armed]);

    let mut stage = Stage::new(manual());
    for _ in 0..1000 {
        assert_eq!(stage.good(force(10.0)).wrench, Vector6::zeros());
    }
    assert_eq!(stage.port.state(), ArmingState::Disarmed);
    stage.port.ask_to_arm();
    for _ in 0..=501 {
        let _ = stage.good(force(10.0));
    }
    assert_eq!(stage.port.rendered(), &force(10.0));
}

#[test]
fn nobody_arms_a_device_that_is_not_in_order() {
    let mut stage = Stage::new(manual());
    stage.port.ask_to_arm();
    let _ = stage.tick(Err(DeviceFault::NotStarted), None);
    for _ in 0..500 {
        let _ = stage.good(force(10.0));
    }
    assert_eq!(
        stage.kinds(),
        [
            EventKind::DeviceNotStarted,
            EventKind::ArmRefused,
            EventKind::DeviceBack
        ]
    );
    assert_eq!(stage.port.rendered(), &Vector6::zeros());
}

#[test]
fn silence_is_held_for_20_ms_then_gone_before_120_ms_and_ramps_in_again_by_itself() {
    // Also where a person has to arm after a fault: silence is none.
    let mut stage = Stage::new(manual());
    let _ = stage.good(force(10.0));
    stage.port.ask_to_arm();
    for _ in 0..700 {
        let _ = stage.good(force(10.0));
    }
    let last = stage.now;
    stage.told.clear();
    let mut before = 10.0;
    for age in 1..=300 {
        let now = stage.now + TICK;
        let felt = stage
            .tick(Ok(sample(now)), Some(Command::fresh(last, force(10.0))))
            .wrench[0];
        match age {
            0..=20 => assert_eq!(felt, 10.0),
            21..115 => assert!(felt < before && felt > 0.0),
            _ => assert_eq!(felt, 0.0),
        }
        assert!(
            before - felt <= 10.0 / 95.0 + 1e-9,
            "step of {} N",
            before - felt
        );
        before = felt;
    }
    assert_eq!(stage.kinds(), [EventKind::ForceStale]);
    for _ in 0..600 {
        let _ = stage.good(force(10.0));
    }
    assert_eq!(
        stage.kinds(),
        [EventKind::ForceStale, EventKind::Arming, EventKind::Armed]
    );
}

#[test]
fn a_fault_waits_for_a_person_where_that_is_wanted() {
    let mut stage = Stage::new(manual());
    let _ = stage.good(force(10.0));
    stage.port.ask_to_arm();
    for _ in 0..700 {
        let _ = stage.good(force(10.0));
    }
    stage.told.clear();
    let mut jump = sample(stage.now + TICK);
    jump.pose.translation.vector.x += 0.2;
    let _ = stage.tick(Ok(jump), Some(Command::fresh(stage.now, force(10.0))));
    for _ in 0..1000 {
        let _ = stage.good(force(10.0));
    }
    assert_eq!(stage.port.state(), ArmingState::Faulted);
    assert_eq!(
        stage.kinds(),
        [
            EventKind::DeviceTeleported,
            EventKind::DeviceBack,
            EventKind::RearmNeeded
        ]
    );
    assert!(
        (stage.told[0].value - 200.2).abs() < 0.1,
        "{}",
        stage.told[0]
    );
    stage.port.ask_to_arm();
    let _ = stage.good(force(10.0));
    assert_eq!(stage.port.state(), ArmingState::Arming);
}

#[test]
fn the_dead_mans_button_is_the_force() {
    let settings = SafetySettings {
        dead_man: Some(2),
        ..manual()
    };
    let mut stage = Stage::new(settings);
    let mut run = |ticks: u32, buttons: u16| {
        for _ in 0..ticks {
            let now = stage.now + TICK;
            let held = DeviceSample {
                buttons,
                ..sample(now)
            };
            let _ = stage.tick(Ok(held), Some(Command::fresh(now, force(10.0))));
        }
        (stage.port.rendered()[0], stage.port.state())
    };
    // What is held at the start was not pressed.
    assert_eq!(run(700, 0b100), (0.0, ArmingState::Disarmed));
    assert_eq!(run(10, 0), (0.0, ArmingState::Disarmed));
    assert_eq!(run(10, 0b011), (0.0, ArmingState::Disarmed));
    assert_eq!(run(700, 0b100), (10.0, ArmingState::Armed));
    assert!(run(50, 0).0 < 10.0);
    assert_eq!(run(60, 0), (0.0, ArmingState::Disarmed));
    assert_eq!(run(700, 0b110), (10.0, ArmingState::Armed));
    assert!(stage.kinds().contains(&EventKind::DeadManReleased));
}

#[test]
fn who_disarms_is_asked_before_there_is_force_again() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    stage.port.ask_to_disarm();
    for _ in 0..1000 {
        let _ = stage.good(force(10.0));
    }
    assert_eq!(stage.port.rendered(), &Vector6::zeros());
    assert_eq!(stage.kinds(), [EventKind::Disarmed]);
    stage.port.ask_to_arm();
    for _ in 0..600 {
        let _ = stage.good(force(10.0));
    }
    assert_eq!(stage.port.rendered(), &force(10.0));
}

#[test]
fn nan_holds_the_last_force_and_lets_it_fade() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    for age in 1..=300 {
        let broken = Vector6::new(1.0, 2.0, 3.0, 0.0, f64::NAN, 0.0);
        let felt = stage.good(broken).wrench[0];
        assert!(felt <= 10.0 && felt.is_finite());
        assert_eq!(felt == 0.0, ms(age) >= GONE, "{felt} N at {age} ms");
    }
    assert_eq!(stage.kinds(), [EventKind::WrenchNotFinite]);
}

#[test]
fn a_stalled_port_drops_the_force_by_the_slew_limit() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    let last = stage.now;
    stage.now += ms(5000);
    let mut before = 10.0;
    for _ in 0..20 {
        let now = stage.now + TICK;
        let felt = stage
            .tick(Ok(sample(now)), Some(Command::fresh(last, force(10.0))))
            .wrench[0];
        assert!(before - felt <= 0.5 + 1e-9);
        before = felt;
    }
    assert_eq!(before, 0.0);
    assert_eq!(stage.kinds()[0], EventKind::PortStalled);
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
    let (felt, told) = early(10.2);
    assert!((felt - 10.025).abs() < 1e-9, "{felt} N");
    assert_eq!(told, []);
    let (_, told) = early(12.0);
    assert_eq!(told, [EventKind::ForceSlewLimited]);
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
fn a_driver_that_repeats_itself_has_lost_its_device() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    let last = sample(stage.now);
    for age in 1..=200 {
        let now = stage.now + TICK;
        let felt = stage
            .tick(Ok(last), Some(Command::fresh(now, force(10.0))))
            .wrench[0];
        assert_eq!(felt == 0.0, ms(age) >= GONE, "{felt} N at {age} ms");
    }
    assert_eq!(stage.kinds(), [EventKind::DeviceLost]);
}

#[test]
fn commands_ahead_of_the_clock_prolong_no_silence() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    let last = stage.now;
    for age in 1..=200 {
        let now = stage.now + TICK;
        let made = if age <= 20 { last } else { now + ms(50) };
        let felt = stage
            .tick(Ok(sample(now)), Some(Command::fresh(made, force(10.0))))
            .wrench[0];
        assert_eq!(felt == 0.0, ms(age) >= GONE, "{felt} N at {age} ms");
    }
    assert_eq!(stage.kinds(), [EventKind::CommandNotOnClock]);
}

/// One of the things that go wrong, for some ticks.
#[derive(Clone, Copy, Debug)]
enum Fault {
    Origin,
    Frozen,
    Nan,
    Jump,
    TimeBack,
    Unplugged,
    WrenchNan,
    CommandsStop,
    ConstraintsStop,
    CommandsAhead,
    Disarm,
    None,
}

fn faults() -> impl Strategy<Value = Vec<(Fault, u64, f64)>> {
    let fault = prop_oneof![
        Just(Fault::Origin),
        Just(Fault::Frozen),
        Just(Fault::Nan),
        Just(Fault::Jump),
        Just(Fault::TimeBack),
        Just(Fault::Unplugged),
        Just(Fault::WrenchNan),
        Just(Fault::CommandsStop),
        Just(Fault::ConstraintsStop),
        Just(Fault::CommandsAhead),
        Just(Fault::Disarm),
        Just(Fault::None),
    ];
    prop::collection::vec((fault, 1_u64..200, -30.0..30.0_f64), 1..12)
}

proptest! {
    #[test]
    fn whatever_goes_wrong_the_force_changes_slowly_and_is_gone_in_time(
        sequence in faults(),
        automatic in any::<bool>(),
    ) {
        let settings = SafetySettings {
            rearm: if automatic { Rearm::Automatic } else { Rearm::Manual },
            ..SafetySettings::default()
        };
        let mut stage = Stage::new(settings);
        let _ = stage.good(force(5.0));
        stage.port.ask_to_arm();
        for _ in 0..600 {
            let _ = stage.good(force(5.0));
        }
        // When the newest good sample and the newest good command came.
        let (mut good_sample, mut good_command) = (stage.now, stage.now);
        let mut before = *stage.port.rendered();
        let mut last_pose = Some(sample(stage.now).pose);
        // Ticks for which the pose has been the same.
        let mut stood = 0_u64;
        let mut after_fault = false;
        for (fault, ticks, newtons) in sequence {
            let begun = stage.now;
            let mut jumped = false;
            for tick in 0..ticks {
                let now = stage.now + TICK;
                let mut answer = Ok(sample(now));
                let mut command = Command::fresh(now, Vector6::new(newtons, 3.0, 0.0, 0.0, 0.3, 0.0));
                let (mut sample_is_good, mut command_is_good) = (true, true);
                match fault {
                    Fault::Origin => answer = Ok(DeviceSample { pose: Pose::identity(), ..sample(now) }),
                    Fault::Frozen => answer = Ok(DeviceSample { time: now, ..sample(begun) }),
                    Fault::Nan => answer = Ok(DeviceSample { pose: Pose::translation(f64::NAN, 0.0, 0.0), ..sample(now) }),
                    Fault::Jump => answer = Ok(DeviceSample { pose: Pose::translation(9.0, 0.0, 0.0), ..sample(now) }),
                    Fault::TimeBack => answer = Ok(DeviceSample { time: now - ms(300), ..sample(now) }),
                    Fault::Unplugged => answer = Err(DeviceFault::Lost { age: now - begun }),
                    Fault::WrenchNan => command.wrench[3] = f64::NAN,
                    Fault::CommandsStop => command.origin = good_command,
                    Fault::ConstraintsStop => command.constraint_age = now - begun,
                    Fault::CommandsAhead => command.origin = now + ms(50),
                    Fault::Disarm => stage.port.ask_to_disarm(),
                    Fault::None => {}
                }
                if matches!(fault, Fault::Origin | Fault::Frozen | Fault::Nan | Fault::Jump | Fault::TimeBack | Fault::Unplugged) {
                    sample_is_good = false;
                }
                if matches!(fault, Fault::WrenchNan | Fault::CommandsStop | Fault::CommandsAhead | Fault::Disarm) {
                    command_is_good = false;
                }
                let pose = answer.map(|sample| sample.pose).ok();
                stood = if pose == last_pose { stood + 1 } else { 0 };
                // A device that has stood somewhere else for long enough is there, and one that stands still after another fault rests: where it froze
                // before, it comes back somewhere else.
                let stands = match fault {
                    Fault::Origin | Fault::Jump => stood > 100,
                    Fault::Frozen => (after_fault || jumped) && tick > 100,
                    _ => false,
                };
                if stands {
                    sample_is_good = true;
                }
                // What stands still froze when it moved last.
                if matches!(fault, Fault::Frozen) && pose != last_pose {
                    sample_is_good = true;
                }
                last_pose = pose;
                let report = stage.tick(answer, Some(command));
                jumped |= tick == 0 && stage.port.fault().is_some();
                if sample_is_good {
                    good_sample = stage.now;
                }
                if command_is_good {
                    good_command = stage.now;
                }
                let felt = report.wrench;
                prop_assert!(felt.iter().all(|x| x.is_finite()));
                let part = |wrench: &Vector6<f64>, start: usize| wrench.fixed_rows::<3>(start).norm();
                prop_assert!(part(&felt, 0) <= 20.0 * (1.0 + 1e-12));
                prop_assert!(part(&felt, 3) <= 0.5 * (1.0 + 1e-12));
                prop_assert!(part(&(felt - before), 0) <= 0.5 * (1.0 + 1e-9));
                prop_assert!(part(&(felt - before), 3) <= 0.05 * (1.0 + 1e-9));
                let silent = stage.now - good_sample.min(good_command);
                if silent >= SafetySettings::ZERO_AFTER {
                    prop_assert_eq!(felt, Vector6::zeros(), "{:?} for {:?}", fault, silent);
                }
                before = felt;
            }
            after_fault = stage.port.fault().is_some();
        }
    }
}
