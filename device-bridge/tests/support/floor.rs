//! A floor under a device, felt through its port, beside a device that runs by itself or step by step with it; and damage that is the same each time.

use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector6};
use taut_bridge::{
    ArmPort, ArmState, Command, CommandSource, Device, DeviceFault, DevicePort, Placement, Pose,
    SafetySettings,
};

use super::{PATIENCE, ms, wait_until};

/// A device whose port ticks on a floor.
pub struct OnFloor {
    pub port: DevicePort,
    floor: fn(&Pose) -> Vector6<f64>,
    /// The highest place so far, m. A hand on its way down and up may be anywhere when a busy machine makes the first tick.
    top: f64,
    /// The virtual clock, ms.
    time: u64,
}

impl OnFloor {
    /// `floor` is the wrench at a pose whose heights count from the highest place so far; a torque of it is one that nobody can render.
    pub fn new(
        device: Box<dyn Device>,
        placement: &Placement,
        floor: fn(&Pose) -> Vector6<f64>,
    ) -> Self {
        let (safety, point) = (SafetySettings::default(), placement.reference_point);
        let mut port = DevicePort::new(device, safety, point, &placement.start);
        port.restart(CommandSource::Same);
        Self {
            port,
            floor,
            top: f64::NEG_INFINITY,
            time: 0,
        }
    }

    /// The fault, and the force on the device, N.
    pub fn tick(&mut self, now: Duration) -> (Option<DeviceFault>, f64) {
        let Self { floor, top, .. } = self;
        let report = self.port.tick(now, |reading| {
            let mut pose = reading.sample.pose;
            *top = top.max(pose.translation.vector.z);
            pose.translation.vector.z -= *top;
            Some(Command::fresh(now, floor(&pose)))
        });
        assert_eq!(report.wrench.fixed_rows::<3>(3).norm(), 0.0, "a torque");
        (report.reading.fault, report.wrench.norm())
    }

    /// Ticks until `done` of fault and force, with pauses of a millisecond, which is what the virtual clock counts, however long they take: a port that a busy
    /// machine lets stand for 20 ms time and again would find the device lost each time, and never arm.
    pub fn until(&mut self, what: &str, done: impl Fn(Option<DeviceFault>, f64) -> bool) {
        let begun = Instant::now();
        loop {
            self.time += 1;
            let (fault, force) = self.tick(ms(self.time));
            if done(fault, force) {
                return;
            }
            assert!(begun.elapsed() < PATIENCE, "{what}: {fault:?}, {force} N");
            thread::sleep(ms(1));
        }
    }

    pub fn until_felt(&mut self, what: &str) {
        self.until(what, |fault, force| fault.is_none() && force > 0.3);
    }

    pub fn until_gone(&mut self, what: &str) {
        self.until(what, |fault, force| fault.is_some() && force == 0.0);
    }

    /// The floor is felt, here and at the far end of `cable`, is gone without it and is back with another; nothing stays at the far end without a port.
    pub fn outlives<T>(mut self, cable: T, plug: impl Fn() -> T, far: impl Fn(&T) -> f64) {
        self.until_felt("the floor");
        self.until("the floor at the far end", |_, _| far(&cable) > 0.3);
        drop(cable);
        self.until_gone("the cable is out");
        let cable = plug();
        self.until_felt("the cable is in");
        self.until("the floor at the far end again", |_, _| far(&cable) > 0.3);
        drop(self);
        wait_until("a force stayed", || far(&cable) == 0.0);
    }

    /// Ticks once a millisecond of the virtual clock, after `wire`. Since when the force was zero at the end, ms.
    pub fn run(&mut self, until: u64, mut wire: impl FnMut(Duration)) -> Option<u64> {
        let mut zero_since = None;
        while self.time < until {
            self.time += 1;
            wire(ms(self.time));
            let (_, force) = self.tick(ms(self.time));
            zero_since = (force == 0.0).then(|| zero_since.unwrap_or(self.time));
        }
        zero_since
    }

    /// The floor is felt at `felt` ms with the `wire`, is gone 120 ms after the wire was cut, and is back within 0.7 s.
    pub fn loses_and_finds(&mut self, felt: u64, mut wire: impl FnMut(Duration)) {
        assert_eq!(self.run(felt, &mut wire), None, "no floor is felt");
        let gone = self.run(felt + 300, |_| ());
        let gone = gone.expect("a force without a wire");
        assert!(gone <= felt + 120, "{gone}");
        let _ = self.run(felt + 900, &mut wire);
        assert_eq!(self.run(felt + 1000, wire), None, "no force after 0.7 s");
    }
}

/// A linear congruential generator: the same damage each time.
pub struct Dice(pub u64);

impl Dice {
    pub fn roll(&mut self, sides: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % sides
    }

    /// Nothing, what came before it, a beginning, a bit changed, a byte twice, or a byte less.
    fn damage(&mut self, bytes: &mut Vec<u8>, before: &[u8]) {
        let at = self.roll(bytes.len() as u64) as usize;
        match self.roll(6) {
            0 => bytes.clear(),
            1 => *bytes = before.to_vec(),
            2 => bytes.truncate(at),
            3 => bytes[at] ^= 1 << self.roll(8),
            4 => bytes.insert(at, bytes[at]),
            _ => drop(bytes.remove(at)),
        }
    }
}

/// Damages one in ten of a device's answers, one each millisecond: how many were damaged, and how many of these `is_believed`, which is given the time and
/// what is heard, and sees to it that no wrong pose is.
pub fn damaged(
    answers: u64,
    answer: impl Fn(u64) -> Vec<u8>,
    mut is_believed: impl FnMut(u64, &[u8]) -> bool,
) -> (u64, u64) {
    let mut dice = Dice(5);
    let (mut damaged, mut believed, mut good) = (0, 0, 0);
    let mut before = Vec::new();
    for time in 0..answers {
        let whole = answer(time);
        let mut heard = whole.clone();
        let is_damaged = dice.roll(10) == 0;
        if is_damaged {
            damaged += 1;
            dice.damage(&mut heard, &before);
        }
        before = whole;
        if is_believed(time, &heard) {
            good += 1;
            believed += u64::from(is_damaged);
        }
    }
    assert!(good > answers * 8 / 10, "{good} of {answers}");
    assert!(damaged > answers / 20, "{damaged}");
    (damaged, believed)
}

/// The scene's axes are the device's.
pub fn placement() -> Placement {
    Placement::plain(Pose::identity(), Point3::origin())
}

/// A floor 20 mm below the top, with a torque that no arm can render.
pub fn floor(pose: &Pose) -> Vector6<f64> {
    let below = (-0.02 - pose.translation.vector.z).max(0.0);
    Vector6::new(0.0, 0.0, 200.0 * below, 0.0, 0.4, 0.0)
}

/// An arm's wire without a port, under a virtual clock.
pub struct Direct<A>(Arc<Mutex<Wire<A>>>);

/// What is at its ends.
pub struct Wire<A> {
    pub arm: A,
    pub state: ArmState,
    pub force: [f64; 3],
}

impl<A> Direct<A> {
    pub fn of(arm: A) -> Self {
        let (state, force) = (ArmState::default(), [0.0; 3]);
        Self(Arc::new(Mutex::new(Wire { arm, state, force })))
    }

    pub fn lock(&self) -> MutexGuard<'_, Wire<A>> {
        self.0.lock().expect("not poisoned")
    }
}

impl<A> Clone for Direct<A> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<A: Send> ArmPort for Direct<A> {
    fn newest(&mut self) -> ArmState {
        self.lock().state
    }

    fn push(&mut self, force: [f64; 3]) {
        self.lock().force = force;
    }
}
