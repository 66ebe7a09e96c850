//! The thread that calls a library, or a process in Python: read and write in turn, and the device opened again when it is gone.
//!
//! A thread of its own, so that the device's loop goes on while a library hangs: its samples stop, and the port holds and fades. What no thread can do is
//! to hand a hanging library the zero; that waits until the call returns, and is the library's first command then.

use std::path::Path;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Duration;

use super::claims::{PluginInfo, RawSample, Worth};
use super::{Answer, Language, OpenDevice, Opener, PluginError};
use crate::devices::pace::Pace;
use crate::devices::wire_thread::{
    HOLDS, Line, PERIOD, PHASE, Wire, WireThread, ask_for_real_time,
};
use crate::devices::{ArmPort, ArmState};
use crate::realtime::{Ticker, monotonic_now};

/// For the first opening.
const OPEN_WITHIN: Duration = Duration::from_secs(10);

/// A library under a thread of its own. Dropping it closes the device.
pub struct Plugin {
    thread: WireThread<ArmState, [f64; 6]>,
    /// Force, then torque.
    wrench: [f64; 6],
}

impl Plugin {
    /// Loads what is at `path`, written in `language`, and opens its device with `options`; `priority` asks for real time, 0 does not.
    pub fn open(
        path: &Path,
        language: &Language,
        options: &str,
        priority: u8,
    ) -> Result<(Self, PluginInfo), PluginError> {
        let (ready, readied) = sync_channel(1);
        let talker = Talker {
            opener: language.opener(path, options, priority)?,
            calls: Calls {
                info: None,
                was_slow: false,
            },
            priority,
            ready,
        };
        let thread = WireThread::start("taut-plugin", "the plug-in", 0, talker)?;
        match readied.recv_timeout(OPEN_WITHIN) {
            Ok(Ok(info)) => Ok((
                Self {
                    thread,
                    wrench: [0.0; 6],
                },
                info,
            )),
            Ok(Err(error)) => Err(error),
            Err(_) => Err(PluginError::Hangs(path.to_owned(), OPEN_WITHIN.as_secs())),
        }
    }
}

impl ArmPort for Plugin {
    fn newest(&mut self) -> ArmState {
        *self.thread.newest()
    }

    fn twist(&mut self, torque: [f64; 3]) {
        self.wrench[3..].copy_from_slice(&torque);
    }

    fn push(&mut self, force: [f64; 3]) {
        self.wrench[..3].copy_from_slice(&force);
        self.thread.command(self.wrench);
    }

    fn let_go(&mut self) -> bool {
        self.thread.let_go()
    }
}

struct Talker {
    opener: Box<dyn Opener>,
    calls: Calls,
    priority: u8,
    ready: SyncSender<Result<PluginInfo, PluginError>>,
}

impl Wire for Talker {
    type State = ArmState;
    type Command = [f64; 6];
    type Lost = String;

    fn name(&self) -> String {
        let info = self.calls.info.as_ref();
        info.map_or_else(|| "the plug-in".to_owned(), |info| info.name.clone())
    }

    /// It is read first and written then, and measures that itself.
    fn answers(&self) -> bool {
        false
    }

    fn session(&mut self, line: &mut PluginLine) -> Result<(), String> {
        let end = line.end();
        let (mut device, info) = match (self.opener.open(&end), &self.calls.info) {
            (Ok(opened), _) => opened,
            (Err(error), Some(_)) => return Err(error.to_string()),
            (Err(error), None) => {
                let _ = self.ready.try_send(Err(error));
                return Ok(());
            }
        };
        match &self.calls.info {
            Some(before) if *before != info => {
                let name = info.name;
                return Err(format!("{name} was plugged in instead; start again"));
            }
            Some(_) => {}
            None => {
                // After the library's own threads were started, which would inherit it.
                ask_for_real_time(self.priority, &info.name);
                let _ = self.ready.try_send(Ok(info.clone()));
                self.calls.info = Some(info.clone());
            }
        }
        self.calls.turn(&mut *device, &info, line)
    }
}

type PluginLine = Line<ArmState, [f64; 6]>;

/// What goes on from call to call.
struct Calls {
    /// Of the device that was opened first.
    info: Option<PluginInfo>,
    was_slow: bool,
}

impl Calls {
    /// Calls until the end, or until the device is gone.
    fn turn(
        &mut self,
        device: &mut dyn OpenDevice,
        info: &PluginInfo,
        line: &mut PluginLine,
    ) -> Result<(), String> {
        let period = PERIOD.max(Duration::from_secs_f64(1.0 / info.rate_hz));
        let mut ticker = Ticker::at_phase(period, PHASE);
        let mut pace = Pace::new(&info.name);
        while !line.is_over() {
            ticker.wait();
            let begun = monotonic_now();
            let (answer, sample) = device.read();
            pace.read();
            self.slow(begun);
            match answer {
                Answer::Good => {
                    let reports = line.state.reports + 1;
                    if let Some(state) = state_of(&sample, info.with_orientation, reports) {
                        line.state = state;
                        line.publish();
                    }
                }
                Answer::NothingNew => {}
                Answer::NotReady => not_ready(line),
                Answer::Gone | Answer::Failed(_) => return Err(device.error_text(answer)),
            }
            if !info.has_motors {
                continue;
            }
            let at_write = monotonic_now();
            // Also without a pose: what to do then the port decides, which holds and fades.
            let answer = device.write(&line.command(at_write).unwrap_or_default());
            self.slow(at_write);
            pace.cycle(begun);
            match answer {
                Answer::Good => {}
                Answer::NothingNew => line.let_go(),
                Answer::NotReady => {
                    line.let_go();
                    not_ready(line);
                }
                Answer::Gone | Answer::Failed(_) => return Err(device.error_text(answer)),
            }
        }
        if info.has_motors {
            device.write(&[0.0; 6]);
        }
        Ok(())
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

/// The sample as the state of this number; `None` where it is too old. One that is no pose has NaN, which the device names.
fn state_of(sample: &RawSample, with_orientation: bool, reports: u64) -> Option<ArmState> {
    let worth = sample.worth(with_orientation);
    if worth == Worth::Stale {
        return None;
    }
    let is_good = worth == Worth::Good;
    Some(ArmState {
        reports,
        is_usable: true,
        age: Duration::try_from_secs_f64(sample.age).unwrap_or_default(), // it is none where the sample is none
        position: if is_good {
            sample.position
        } else {
            [f64::NAN; 3]
        },
        velocity: sample.velocity,
        orientation: with_orientation.then_some(sample.orientation),
        turning: sample.turning().filter(|_| with_orientation),
        buttons: (sample.buttons & 0xffff) as u16,
    })
}

fn not_ready(line: &mut PluginLine) {
    line.state.is_usable = false;
    line.publish();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_a_samples_age_goes_with_it() {
        let aged = |age| RawSample {
            position: [0.0; 3],
            velocity: [0.0; 3],
            age,
            ..RawSample::UNSET
        };
        for (age, handed_on) in [
            (0.0, Some(Duration::ZERO)),
            (0.004, Some(Duration::from_millis(4))),
            (0.02, None),
        ] {
            let state = state_of(&aged(age), false, 7);
            assert_eq!(state.map(|state| state.age), handed_on, "{age} s");
        }
        // No age is no pose, as ever.
        let unsaid = state_of(&aged(f64::NAN), false, 7).expect("a state");
        assert!(unsaid.position[0].is_nan() && unsaid.age.is_zero());
    }
}
