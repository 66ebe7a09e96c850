//! A floor under a device of a user's own, in whatever language: felt, lost, felt again; and what a test sees and switches of it.

use std::thread;
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector6};
use taut_bridge::{
    ArmingState, Command, CommandSource, Device, DeviceChoice, DeviceFault, DevicePort, Hand,
    Placement, Pose, Rearm, SafetySettings,
};

use super::{PATIENCE, ms, wait_until};

// Of tests/plugin_c/plant.h.
pub const GOOD: i64 = 0;
pub const HANGS: i64 = 1;
pub const NOT_A_NUMBER: i64 = 2;
pub const LONG_QUATERNION: i64 = 3;
pub const TOO_HOT: i64 = 4;
pub const UNPLUGGED: i64 = 5;
pub const NOTHING_NEW: i64 = 6;
pub const NOT_CALIBRATED: i64 = 7;

/// What every hand goes through in [`goes_wrong`], and what the port calls it.
pub const FAULTS: [(i64, &str); 7] = [
    (HANGS, "was lost"),
    (NOT_A_NUMBER, "not finite"),
    (LONG_QUATERNION, "not finite"),
    (TOO_HOT, "was lost"),
    (UNPLUGGED, "was lost"),
    (NOTHING_NEW, "was lost"),
    (NOT_CALIBRATED, "was lost"),
];

/// Numbers of the stand-in: `mode`, `served`, `force`, `torque`, `after`, `closes`, as in plant.h.
pub trait Inside {
    fn get(&self, name: &str) -> i64;

    fn set(&self, name: &str, value: i64);

    fn wait(&self, what: &str, done: &dyn Fn() -> bool) {
        wait_until(what, done);
    }
}

pub fn opened(choice: &str) -> Result<Box<dyn Device>, String> {
    opened_with(choice, 0)
}

/// `priority` asks for real time for the driver's thread; 0 does not.
fn opened_with(choice: &str, priority: u8) -> Result<Box<dyn Device>, String> {
    let DeviceChoice::Input(input) = choice.parse().map_err(|e| format!("{e}"))? else {
        panic!("it is opened");
    };
    let placement = Placement::plain(Pose::identity(), Point3::origin());
    input
        .open(placement, priority)
        .map_err(|error| error.to_string())
}

/// A port around the device, on a clock that goes a millisecond by tick, however long that takes.
pub struct Stage {
    pub port: DevicePort,
    pub time: u64,
    /// Height of a floor from the highest place so far, m, and its stiffness, N/m.
    pub floor: (f64, f64),
    /// The highest place so far, m. Each hand begins at 0, which it may have left for good before a busy machine makes the first tick.
    top: f64,
    /// How many writes a line had made when it was lost.
    lost_at: Option<i64>,
    /// Up to this difference, uN, a device has the force that it was told: what its digits may change, and no more than is allowed beside the slew.
    rounded: i64,
    /// When the last tick was made.
    ticked: Instant,
    /// Longest time between two ticks.
    longest_gap: Duration,
}

impl Stage {
    /// A plug-in, whose hand is seen where it is, and not from where the first tick found it: it comes down to rest within a quarter of a second.
    pub fn new(choice: &str, rearm: Rearm) -> Self {
        Self::with_driver(&format!("{choice},anchor=workbench"), rearm, 0)
    }

    fn with_driver(choice: &str, rearm: Rearm, priority: u8) -> Self {
        let settings = SafetySettings {
            rearm,
            ..SafetySettings::default()
        };
        let device = opened_with(choice, priority).unwrap_or_else(|error| panic!("{error}"));
        let mut port = DevicePort::new(device, settings, Point3::origin(), &Pose::identity());
        port.restart(CommandSource::Same);
        Self {
            port,
            time: 1000,
            floor: (-0.02, 200.0),
            top: 0.0,
            lost_at: None,
            rounded: 0,
            ticked: Instant::now(),
            longest_gap: Duration::ZERO,
        }
    }

    /// The floor also turns the hand.
    pub fn tick(&mut self) -> (Option<DeviceFault>, f64) {
        self.time += 1;
        let now = ms(self.time);
        self.longest_gap = self.longest_gap.max(self.ticked.elapsed());
        self.ticked = Instant::now();
        let Self { port, top, .. } = self;
        let (floor, stiffness) = self.floor;
        let report = port.tick(now, |reading| {
            let height = reading.sample.pose.translation.vector.z;
            *top = top.max(height);
            let below = (*top + floor - height).max(0.0);
            let wrench = Vector6::new(0.0, 0.0, stiffness * below, 20.0 * below, 0.0, 0.0);
            Some(Command::fresh(now, wrench))
        });
        (report.reading.fault, report.wrench.norm())
    }

    /// Milliseconds of its clock that it took.
    pub fn until(
        &mut self,
        what: &str,
        done: impl Fn(&Self, Option<DeviceFault>, f64) -> bool,
    ) -> u64 {
        let (begun, from) = (Instant::now(), self.time);
        loop {
            let (fault, force) = self.tick();
            if done(self, fault, force) {
                return self.time - from;
            }
            assert!(begun.elapsed() < PATIENCE, "{what}: {fault:?}, {force} N");
            thread::sleep(ms(1));
        }
    }

    pub fn until_felt(&mut self, inside: &dyn Inside) -> u64 {
        self.until("the floor", |_, fault, force| {
            fault.is_none() && force > 0.3 && inside.get("force") > 300_000
        })
    }

    /// 120 ms on its clock after the last good sample there is no force.
    pub fn is_without_force_in_time(&mut self) -> Option<DeviceFault> {
        let mut fault = None;
        for _ in 0..119 {
            fault = self.tick().0;
        }
        let (_, force) = self.tick();
        assert_eq!(force, 0.0, "{fault:?}");
        fault
    }
}

/// Whether the port called it `named`; what it does is the same either way.
fn went_wrong(stage: &mut Stage, inside: &dyn Inside, mode: i64, named: &str) -> bool {
    stage.until_felt(inside);
    if stage.port.info().actuated_degrees_of_freedom == 6 {
        assert!(inside.get("torque") > 0, "no torque");
    }
    inside.set("served", 0);
    inside.set("after", -1);
    let closes = inside.get("closes");
    inside.set("mode", mode);
    inside.wait("it goes wrong", &|| {
        inside.get("served") > 0 || inside.get("closes") > closes
    });
    let fault = stage.is_without_force_in_time().expect(named);
    let is_late = matches!(fault, DeviceFault::Lost { .. });
    let is_named = fault.to_string().contains(named);
    assert!(is_named || is_late, "{named}: {fault}");
    if mode != HANGS {
        stage.until("zero at the motors", |_, _, _| inside.get("force") == 0);
    }
    if [TOO_HOT, UNPLUGGED].contains(&mode) {
        inside.wait("it is closed", &|| inside.get("closes") > closes);
    }
    inside.set("mode", GOOD);
    let back = stage.until_felt(inside);
    println!("{fault}: felt again after {back} ms");
    assert!(inside.get("after") <= 0, "a hang kept a force");
    is_named
}

/// The stand-in says what it is.
pub fn is_a_whole_hand(choice: &str, name: &str) {
    let device = opened(choice).unwrap_or_else(|error| panic!("{error}"));
    let info = device.info();
    assert_eq!(info.name, name);
    assert_eq!(info.sensed_degrees_of_freedom, 6);
    assert_eq!(info.actuated_degrees_of_freedom, 6);
    assert_eq!((info.limits.max_force, info.limits.max_torque), (12.0, 0.5));
}

/// Everything that goes wrong with a device that has been felt, and what the port calls it.
pub fn goes_wrong(choice: &str, inside: &dyn Inside, modes: &[(i64, &str)]) {
    let mut stage = Stage::new(choice, Rearm::Automatic);
    for &(mode, named) in modes {
        // Where a busy machine brought a sample late before it went wrong, that is what the port names: then it goes wrong once more.
        let begun = Instant::now();
        while !went_wrong(&mut stage, inside, mode, named) {
            assert!(begun.elapsed() < PATIENCE, "never called {named}");
        }
    }
    drop(stage);
    assert_eq!(inside.get("force"), 0, "a force stayed");
}

/// What the port allows from one command to the next, uN.
const SLEW: i64 = 500_000;
/// Writes that a busy machine may have on the way when a tick is made.
const ON_THE_WAY: i64 = 8;

impl Stage {
    /// A tick whose force the device has before the next, or which it has had the time to take: two ticks in one write would be no fault of a
    /// driver. A line that writes nothing for `patience` is lost, and not waited for until it writes again.
    fn written_tick(&mut self, inside: &dyn Inside, patience: Duration) {
        let rounded = self.rounded;
        let near = |force: i64, other: i64| (force - other).abs() <= rounded;
        let had = inside.get("force");
        self.tick();
        let ticked = (self.port.rendered().fixed_rows::<3>(0).norm() * 1e6) as i64;
        // The first step from zero, and the device had as much before: the port was told of a zero that may be still on its way, and what the device has
        // is older than that.
        let is_older = near(had, SLEW) && near(ticked, SLEW);
        let (begun, before) = (Instant::now(), inside.get("writes"));
        loop {
            thread::sleep(ms(1));
            let writes = inside.get("writes");
            let has_it = !is_older && near(inside.get("force"), ticked);
            if has_it || writes >= before + ON_THE_WAY {
                self.lost_at = None;
                return;
            }
            let waits = if self.lost_at == Some(writes) {
                ms(5)
            } else {
                patience
            };
            if begun.elapsed() > waits {
                assert!(patience < PATIENCE, "it is not written");
                self.lost_at = Some(writes);
                return;
            }
        }
    }

    /// Until the hand feels 2 N.
    fn until_pressed(&mut self, inside: &dyn Inside) {
        let begun = Instant::now();
        self.lost_at = None;
        while inside.get("force") < 2_000_000 {
            assert!(
                begun.elapsed() < PATIENCE,
                "{} uN is felt",
                inside.get("force")
            );
            self.written_tick(inside, PATIENCE);
        }
    }
}

/// A hand that no force moves: what a write is then, the hand's own motion does not explain.
pub const VICE: Hand = Hand {
    mass: 5.0,
    damping: 5000.0,
    stiffness: 1e5,
    rotational_inertia: 1e-2,
    rotational_damping: 10.0,
    rotational_stiffness: 200.0,
};

/// What a device goes through in [`no_write_jumps`].
pub struct Faults {
    pub modes: &'static [i64],
    /// For how long, ms.
    pub ticks: &'static [u64],
    /// Height of a floor of 1000 N/m from the highest place so far, m. A hand in a vice does not move: 3 mm are 3 N.
    pub floor: f64,
    /// uN from one write to the next: 0.5 N/ms, and rounding.
    pub allowed: i64,
    /// The driver must not let go meanwhile.
    pub keeps_force: bool,
    /// Without a write for this long the line is lost.
    pub patience: Duration,
}

/// Samples that are bad while the device itself is read and written on.
pub const BAD_SAMPLES: Faults = Faults {
    modes: &[NOT_A_NUMBER, LONG_QUATERNION, NOT_CALIBRATED, NOTHING_NEW],
    ticks: &[1, 3, 10, 30, 300],
    floor: -0.005, // a hand of their own goes below it
    allowed: 510_000,
    keeps_force: true,
    patience: PATIENCE,
};

/// Real time for a driver, as `taut bridge` asks for it: a driver that stands for 50 ms between taking a command and writing it writes for a hand that
/// feels nothing any more, which no driver can help.
const DRIVER_PRIORITY: u8 = 80;

/// What the port promises of every write holds at the device: samples that are bad for a moment or for long make no jump there, and neither does
/// the way back after the driver itself has let go.
pub fn no_write_jumps(choice: &str, inside: &dyn Inside, faults: &Faults) {
    let allowed = faults.allowed;
    let mut stage = Stage::with_driver(choice, Rearm::Automatic, DRIVER_PRIORITY);
    stage.floor = (faults.floor, 1000.0);
    stage.rounded = (allowed - SLEW) / 2;
    for &mode in faults.modes {
        for &ticks in faults.ticks {
            stage.until_pressed(inside);
            inside.set("jump", 0);
            if faults.keeps_force {
                inside.set("fall", 0);
            }
            stage.longest_gap = Duration::ZERO;
            inside.set("served", 0);
            inside.set("mode", mode);
            inside.wait("it goes wrong", &|| inside.get("served") > 0);
            for _ in 0..ticks {
                stage.written_tick(inside, faults.patience);
            }
            inside.set("mode", GOOD);
            stage.until_pressed(inside);
            let jump = inside.get("jump");
            assert!(jump <= allowed, "mode {mode} for {ticks}: {jump} uN");
            // A driver lets go of its own where nobody ticks for 20 ms, which a busy machine brings about.
            if faults.keeps_force && stage.longest_gap < ms(15) {
                let fall = inside.get("fall");
                assert!(fall <= allowed, "mode {mode} for {ticks}: {fall} uN let go");
            }
        }
    }
    // Nobody ticks any more.
    inside.wait("zero without a write", &|| inside.get("force") == 0);
    inside.set("jump", 0);
    stage.until_pressed(inside);
    let jump = inside.get("jump");
    assert!(jump <= allowed, "after the driver let go: {jump} uN");
}

/// A device that was gone renders nothing until a person arms it again.
pub fn a_person_arms(choice: &str, inside: &dyn Inside) {
    let mut stage = Stage::new(choice, Rearm::Manual);
    let in_order = |stage: &mut Stage| {
        stage.until("it is there", |_, fault, _| fault.is_none());
        for _ in 0..20 {
            assert_eq!(stage.tick().1, 0.0, "a force that nobody armed");
            thread::sleep(ms(1));
        }
        stage.port.ask_to_arm();
    };
    in_order(&mut stage);
    stage.until_felt(inside);
    inside.set("mode", UNPLUGGED);
    stage.until("it is gone", |_, fault, force| {
        fault.is_some() && force == 0.0
    });
    inside.set("mode", GOOD);
    in_order(&mut stage);
    assert_ne!(stage.port.state(), ArmingState::Armed);
    stage.until_felt(inside);
}
