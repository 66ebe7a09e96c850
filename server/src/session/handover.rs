//! What one session leaves to the next of the same scene: where the bodies stand, and the device that moves the one in the hand.
//!
//! Friction, stiffness, a colour or the pose of something else is changed, and the body stays where it is: the next session begins there and not at
//! the scene's start. The device that this process opened stays open; one behind a bridge stays by itself.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use god_object::nalgebra::Vector6;
use god_object::{GodObject, Pose, StartError, World};
use taut_bridge::{Device, DeviceFault, DeviceInfo, DeviceSample, Felt};
use taut_scene::BuiltMotion;

use crate::loops::god_object::Stand;
use crate::session::setup::{DeviceOrigin, DeviceSource, SessionSetup};
use crate::shared::clock::{SessionClock, nanoseconds};
use crate::shared::lock::lock;

/// How much the clock of a kept device is ahead of the session's, ns. Set anew for each session: a device is wrapped once, however many it serves.
type Ahead = Arc<AtomicU64>;

/// What a session was made of, and what its loops leave when they end.
pub(crate) struct Handover {
    world: Arc<World>,
    start: Pose,
    motions: Vec<BuiltMotion>,
    origin: DeviceOrigin,
    clock: SessionClock,
    /// Of a device that is of a session before.
    ahead: Option<Ahead>,
    stand: Mutex<Option<Stand>>,
    device: Mutex<Option<Box<dyn Device>>>,
}

/// Where the body of a session began.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Beginning {
    /// Where the scene says.
    AtStart,
    /// Where it was in the session before.
    WhereItWas,
    /// Where the scene says, since it cannot be where it was: the reason.
    NotWhereItWas(String),
}

impl Beginning {
    /// What a person is told of whom it surprises.
    pub(crate) fn sentence(&self) -> Option<String> {
        match self {
            Self::AtStart | Self::WhereItWas => None,
            Self::NotWhereItWas(why) => Some(format!(
                "the body begins at the scene's start and not where it was: {why}"
            )),
        }
    }
}

impl Handover {
    /// Of a session as its scene says, before its bodies are placed.
    pub(super) fn of(setup: &SessionSetup) -> Self {
        Self {
            world: setup.world.clone(),
            start: setup.start,
            motions: setup.motions.clone(),
            origin: setup.device_origin.clone(),
            clock: SessionClock::start(),
            ahead: None,
            stand: Mutex::default(),
            device: Mutex::default(),
        }
    }

    pub(super) fn begins_at(&mut self, clock: SessionClock) {
        self.clock = clock;
    }

    pub(super) fn leave_stand(&self, stand: Stand) {
        *lock(&self.stand) = Some(stand);
    }

    pub(super) fn leave_device(&self, device: Box<dyn Device>) {
        *lock(&self.device) = Some(device);
    }

    /// Whether the same body is held and begins at the same place, among obstacles that move alike.
    fn is_of(&self, setup: &SessionSetup) -> bool {
        let (before, now) = (&self.world.body, &setup.world.body);
        self.start == setup.start
            && before.reference_point == now.reference_point
            && before.primitive == now.primitive
            && before.mesh.vertices() == now.mesh.vertices()
            && before.mesh.triangles() == now.mesh.triangles()
            && self.motions == setup.motions
    }

    /// Lets the bodies of `setup` begin where they were, if it is the same body and it can stand there; the time on the traces, and what came of it.
    /// A recorded session begins at the scene's start: what is computed again begins there.
    pub(super) fn place(&self, setup: &mut SessionSetup) -> (Duration, Beginning) {
        let is_same = setup.recording.is_none() && self.is_of(setup);
        let stand = lock(&self.stand);
        let Some(stand) = stand.as_ref().filter(|_| is_same) else {
            return (Duration::ZERO, Beginning::AtStart);
        };
        let at_start = setup.world.clone();
        for motion in &setup.motions {
            // A copy of the world, where something moves: others hold the one of the start.
            let world = Arc::make_mut(&mut setup.world);
            if let (Some(obstacle), Some(was)) = (
                world.obstacles.get_mut(motion.obstacle),
                stand.obstacles.get(motion.obstacle),
            ) {
                obstacle.pose = *was;
            }
        }
        match GodObject::check_start(&setup.world, &setup.settings, &stand.body) {
            Ok(()) => {
                setup.start = stand.body;
                (stand.on_traces, Beginning::WhereItWas)
            }
            Err(error) => {
                setup.world = at_start;
                let why = match error {
                    StartError::Penetration { obstacle } | StartError::TooNear { obstacle, .. } => {
                        format!("there it would be in \"{obstacle}\" now")
                    }
                    other => other.to_string(),
                };
                (Duration::ZERO, Beginning::NotWhereItWas(why))
            }
        }
    }

    /// Puts the device of before in the place of one that was opened as that was, on the clock of `now`, which is of the session that gets it.
    pub(super) fn give_device(&self, opened: &mut DeviceSource, now: &mut Self) {
        let left = lock(&self.device).take();
        if let (DeviceSource::Local(opened), Some(device)) = (opened, left)
            && now.origin == self.origin
        {
            let later = now.clock.since(&self.clock);
            let (device, ahead) = kept(device, self.ahead.clone(), later);
            now.ahead = Some(ahead);
            *opened = device;
        }
    }
}

/// A device for a session that began `later` than the one before, in which it was `ahead` already if it was kept then.
fn kept(
    device: Box<dyn Device>,
    ahead: Option<Ahead>,
    later: Duration,
) -> (Box<dyn Device>, Ahead) {
    let later = nanoseconds(later);
    match ahead {
        Some(ahead) => {
            ahead.fetch_add(later, Ordering::Relaxed);
            (device, ahead)
        }
        None => {
            let ahead = Arc::new(AtomicU64::new(later));
            let kept = KeptDevice {
                device,
                ahead: ahead.clone(),
            };
            (Box::new(kept), ahead)
        }
    }
}

/// A device whose clock began with a session before.
struct KeptDevice {
    device: Box<dyn Device>,
    ahead: Ahead,
}

impl KeptDevice {
    fn ahead(&self) -> Duration {
        Duration::from_nanos(self.ahead.load(Ordering::Relaxed))
    }
}

impl Device for KeptDevice {
    fn info(&self) -> &DeviceInfo {
        self.device.info()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let ahead = self.ahead();
        let sample = self.device.read(now + ahead)?;
        Ok(DeviceSample {
            time: sample.time.saturating_sub(ahead),
            ..sample
        })
    }

    fn write(&mut self, now: Duration, wrench: &Vector6<f64>) {
        self.device.write(now + self.ahead(), wrench);
    }

    fn let_go(&mut self) -> bool {
        self.device.let_go()
    }

    fn comes_from(&mut self, origin: Option<Duration>, obstacle_work: f64) {
        let origin = origin.map(|origin| origin + self.ahead());
        self.device.comes_from(origin, obstacle_work);
    }

    fn scale(&self) -> f64 {
        self.device.scale()
    }

    fn felt(&self) -> Option<Felt> {
        let felt = self.device.felt()?;
        let set_made = felt.set_made.map(|made| made.saturating_sub(self.ahead()));
        Some(Felt { set_made, ..felt })
    }

    fn computing_time(&self) -> Option<Duration> {
        self.device.computing_time()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ages of its samples and the longest time that it was told, ms.
    struct Told {
        info: DeviceInfo,
        newest: Arc<AtomicU64>,
    }

    impl Device for Told {
        fn info(&self) -> &DeviceInfo {
            &self.info
        }

        fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
            let told = now.as_millis() as u64;
            assert!(
                self.newest.swap(told, Ordering::Relaxed) <= told,
                "it ran back"
            );
            Ok(DeviceSample {
                time: now - Duration::from_millis(2),
                pose: Pose::identity(),
                velocity: Vector6::zeros(),
                buttons: 0,
            })
        }

        fn write(&mut self, now: Duration, _wrench: &Vector6<f64>) {
            let told = now.as_millis() as u64;
            assert!(
                self.newest.swap(told, Ordering::Relaxed) <= told,
                "it ran back"
            );
        }

        fn comes_from(&mut self, origin: Option<Duration>, _obstacle_work: f64) {
            assert_eq!(origin, Some(Duration::from_millis(9_999)));
        }
    }

    #[test]
    fn the_clock_of_a_kept_device_never_runs_back() {
        let newest = Arc::<AtomicU64>::default();
        let told = Told {
            info: DeviceInfo::without_force("told"),
            newest: newest.clone(),
        };
        let mut device: Box<dyn Device> = Box::new(told);
        let ms = Duration::from_millis;
        device.write(ms(5_000), &Vector6::zeros());
        // A hundred sessions more, each 0.1 s later than the one before.
        let mut ahead = None;
        for _ in 0..100 {
            let told_before = ahead.is_some();
            let place: *const dyn Device = &*device;
            let (again, since) = kept(device, ahead, ms(100));
            let is_same = std::ptr::addr_eq(place, &raw const *again);
            assert_eq!(is_same, told_before, "wrapped once");
            (device, ahead) = (again, Some(since));
        }
        let sample = device.read(ms(7)).expect("a sample");
        assert_eq!(sample.time, ms(5));
        assert_eq!(newest.load(Ordering::Relaxed), 10_007);
        let first = device.read(ms(8)).expect("a sample");
        assert_eq!(first.time, ms(6));
        device.write(ms(9), &Vector6::zeros());
        assert_eq!(newest.load(Ordering::Relaxed), 10_009);
        let young = device.read(ms(9)).expect("a sample");
        assert!(young.time <= ms(9));
    }

    #[test]
    fn what_a_force_comes_from_is_told_on_the_clock_of_the_device() {
        let told = Told {
            info: DeviceInfo::without_force("told"),
            newest: Arc::default(),
        };
        let mut device = KeptDevice {
            device: Box::new(told),
            ahead: Arc::new(AtomicU64::new(9_990_000_000)),
        };
        device.comes_from(Some(Duration::from_millis(9)), 0.0);
        assert_eq!(device.info().name, "told");
    }
}
