//! The thread that calls a library, or a process in Python: read and write in turn, and the device opened again when it is gone.
//!
//! A thread of its own, so that the device's loop goes on while a library hangs: its samples stop, and the port holds and fades. What no thread can do is
//! to hand a hanging library the zero; that waits until the call returns, and is the library's first command then.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use super::claims::{PluginInfo, RawSample, Worth};
use super::pace::Pace;
use super::{Answer, Language, OpenDevice, Opener, PluginError};
use crate::devices::{ArmPort, ArmState};
use crate::realtime::{self, Ticker, monotonic_now};

/// Shortest from call to call.
const PERIOD: Duration = Duration::from_millis(1);
/// Where in the millisecond the calls are: just after the device's loop, whose wrench they carry.
const PHASE: Duration = Duration::from_micros(350);
/// Without a write of the device's loop for this long the wrench is zero.
const HOLDS: Duration = Duration::from_millis(20);
/// Between two attempts to open.
const RETRY: Duration = Duration::from_millis(200);
/// For the first one.
const OPEN_WITHIN: Duration = Duration::from_secs(10);
/// A device that was there for longer and is gone is told of again.
const HELD_ON: Duration = Duration::from_secs(1);
/// For the last calls. A library that hangs longer is left to itself.
const CLOSE_WITHIN: Duration = Duration::from_secs(1);

/// What the device's loop wants: force then torque.
#[derive(Clone, Copy, Debug, Default)]
struct Wanted {
    writes: u64,
    wrench: [f64; 6],
}

/// A library under a thread of its own. Dropping it closes the device.
pub struct Plugin {
    newest: triple_buffer::Output<ArmState>,
    wanted: triple_buffer::Input<Wanted>,
    next: Wanted,
    end: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Plugin {
    /// Loads what is at `path`, written in `language`, and opens its device with `options`; `priority` asks for real time, 0 does not.
    ///
    /// # Errors
    /// [`PluginError`].
    pub fn open(
        path: &Path,
        language: &Language,
        options: &str,
        priority: u8,
    ) -> Result<(Self, PluginInfo), PluginError> {
        let (out, newest) = triple_buffer::TripleBuffer::new(&ArmState::default()).split();
        let (wanted, taken) = triple_buffer::TripleBuffer::new(&Wanted::default()).split();
        let end = Arc::new(AtomicBool::new(false));
        let (ready, readied) = sync_channel(1);
        let opener = language.opener(path, options, priority, &end)?;
        let mut talker = Talker {
            out,
            wanted: taken,
            written: (0, Duration::ZERO),
            state: ArmState::default(),
            was_slow: false,
            end: Arc::clone(&end),
        };
        let thread = thread::Builder::new()
            .name("taut-plugin".to_owned())
            .spawn(move || talker.run(opener, priority, &ready))
            .map_err(|error| PluginError::Thread(error.to_string()))?;
        match readied.recv_timeout(OPEN_WITHIN) {
            Ok(Ok(info)) => Ok((
                Self {
                    newest,
                    wanted,
                    next: Wanted::default(),
                    end,
                    thread: Some(thread),
                },
                info,
            )),
            Ok(Err(error)) => Err(error),
            Err(_) => {
                end.store(true, Ordering::Relaxed);
                Err(PluginError::Hangs {
                    path: path.to_owned(),
                    seconds: OPEN_WITHIN.as_secs(),
                })
            }
        }
    }
}

impl ArmPort for Plugin {
    fn newest(&mut self) -> ArmState {
        *self.newest.read()
    }

    fn twist(&mut self, torque: [f64; 3]) {
        self.next.wrench[3..].copy_from_slice(&torque);
    }

    fn push(&mut self, force: [f64; 3]) {
        self.next.writes += 1;
        self.next.wrench[..3].copy_from_slice(&force);
        self.wanted.write(self.next);
    }
}

impl Drop for Plugin {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        let Some(thread) = self.thread.take() else {
            return;
        };
        let until = monotonic_now() + CLOSE_WITHIN;
        while !thread.is_finished() {
            if monotonic_now() > until {
                tracing::error!(
                    "the plug-in hangs and cannot be closed: switch its device off, it may still push"
                );
                return;
            }
            thread::sleep(PERIOD);
        }
        let _ = thread.join(); // it panics nowhere
    }
}

/// The thread's own.
struct Talker {
    out: triple_buffer::Input<ArmState>,
    wanted: triple_buffer::Output<Wanted>,
    /// Writes of the device's loop, and when the last was seen.
    written: (u64, Duration),
    state: ArmState,
    was_slow: bool,
    end: Arc<AtomicBool>,
}

impl Talker {
    fn run(
        &mut self,
        mut opener: Box<dyn Opener>,
        priority: u8,
        ready: &SyncSender<Result<PluginInfo, PluginError>>,
    ) {
        let (mut lost, info) = match opener.open() {
            Ok((mut device, info)) => {
                // After the library's own threads were started, which would inherit it.
                if priority > 0 {
                    let grant = realtime::request_fifo(priority);
                    if !grant.is_granted() {
                        tracing::warn!("{grant}: calls of the plug-in may be late");
                    }
                }
                let _ = ready.try_send(Ok(info.clone()));
                (self.turn(&mut *device, &info), info)
            }
            Err(error) => {
                let _ = ready.try_send(Err(error));
                return;
            }
        };
        let mut told = String::new();
        let mut begun = monotonic_now();
        while let Err(why) = lost {
            self.not_ready();
            // One that breaks at once, again and again, is told once.
            let held_on = monotonic_now().saturating_sub(begun) > HELD_ON;
            if why != told || held_on {
                tracing::warn!("{} is gone: {why}; looking for it", info.name);
                told = why;
            }
            begun = monotonic_now();
            thread::sleep(RETRY);
            if self.is_over() {
                return;
            }
            lost = match again(&mut *opener, &info) {
                Ok(mut device) => {
                    begun = monotonic_now();
                    self.turn(&mut *device, &info)
                }
                Err(why) => Err(why),
            };
        }
    }

    fn is_over(&self) -> bool {
        self.end.load(Ordering::Relaxed)
    }

    /// Calls until the end, or until the device is gone.
    fn turn(&mut self, device: &mut dyn OpenDevice, info: &PluginInfo) -> Result<(), String> {
        let period = PERIOD.max(Duration::from_secs_f64(1.0 / info.rate_hz));
        let mut ticker = Ticker::at_phase(period, PHASE);
        let mut pace = Pace::new(&info.name);
        while !self.is_over() {
            ticker.wait();
            let begun = monotonic_now();
            let (answer, sample) = device.read();
            pace.read();
            self.slow(begun);
            match answer {
                Answer::Good => self.take(&sample, info.with_orientation),
                Answer::NothingNew => {}
                Answer::NotReady => self.not_ready(),
                Answer::Gone | Answer::Failed(_) => return Err(device.error_text(answer)),
            }
            if !info.has_motors {
                continue;
            }
            let wrench = self.wrench();
            let at_write = monotonic_now();
            let answer = device.write(&wrench);
            self.slow(at_write);
            pace.cycle(begun);
            match answer {
                Answer::Good | Answer::NothingNew => {}
                Answer::NotReady => self.not_ready(),
                Answer::Gone | Answer::Failed(_) => return Err(device.error_text(answer)),
            }
        }
        if info.has_motors {
            device.write(&[0.0; 6]);
        }
        Ok(())
    }

    /// The sample is handed on; one that is no pose as NaN, which the device names.
    fn take(&mut self, sample: &RawSample, with_orientation: bool) {
        let worth = sample.worth(with_orientation);
        if worth == Worth::Stale {
            return;
        }
        let is_good = worth == Worth::Good;
        self.state = ArmState {
            reports: self.state.reports + 1,
            is_usable: true,
            position: if is_good {
                sample.position
            } else {
                [f64::NAN; 3]
            },
            velocity: sample.velocity,
            orientation: with_orientation.then_some(sample.orientation),
            turning: sample.turning().filter(|_| with_orientation),
            buttons: (sample.buttons & 0xffff) as u16,
        };
        self.out.write(self.state);
    }

    fn not_ready(&mut self) {
        self.state.is_usable = false;
        self.out.write(self.state);
    }

    /// What the device's loop wants, where it wrote of late and the device has a pose.
    fn wrench(&mut self) -> [f64; 6] {
        let wanted = *self.wanted.read();
        let now = monotonic_now();
        if wanted.writes != self.written.0 {
            self.written = (wanted.writes, now);
        }
        let is_fresh = wanted.writes > 0 && now.saturating_sub(self.written.1) < HOLDS;
        let has_pose = self.state.is_usable && self.state.position[0].is_finite();
        if is_fresh && has_pose && wanted.wrench.iter().all(|part| part.is_finite()) {
            wanted.wrench
        } else {
            [0.0; 6]
        }
    }

    /// Tells once of a library that waits where it must not.
    fn slow(&mut self, begun: Duration) {
        let took = monotonic_now().saturating_sub(begun);
        if took > HOLDS && !std::mem::replace(&mut self.was_slow, true) {
            tracing::warn!(
                "a call of the plug-in took {} ms: the force was taken away meanwhile; read and write must not wait",
                took.as_millis()
            );
        }
    }
}

/// Opens the device again; another one is none.
fn again<'a>(
    opener: &'a mut dyn Opener,
    before: &PluginInfo,
) -> Result<Box<dyn OpenDevice + 'a>, String> {
    let (device, info) = opener.open().map_err(|e| e.to_string())?;
    if info == *before {
        Ok(device)
    } else {
        Err(format!("{} was plugged in instead; start again", info.name))
    }
}
