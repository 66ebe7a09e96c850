//! The thread: currents out and encoders in once a millisecond, and the board opened again when it is gone.
//!
//! As with every force device here no force outlives its reason: zero is sent when the device's loop has not written for 20 ms, and at every end; and the
//! firmware turns the motors off 0.5 s after the last report.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use nalgebra::Vector3;

use super::kinematics::WoodenModel;
use super::line::{ReportLine, open};
use super::report::{BoardReport, HostReport};
use crate::devices::{ArmPort, ArmState};
use crate::haply::{ForceHold, PushedForce};
use crate::realtime::{self, Ticker, monotonic_now};
use crate::spidar_uart::Counters;

/// From report to report.
const PERIOD: Duration = Duration::from_millis(1);
/// Where in the millisecond a report goes out: just after the device's loop.
const PHASE: Duration = Duration::from_micros(350);
/// A report that is not there by then is none.
const ANSWER_WITHIN: Duration = Duration::from_millis(3);
/// Reports that are read in one period.
const MAX_READ: usize = 16;
/// After the counters were set, reports from before may still come.
const SETTLE: Duration = Duration::from_millis(50);
/// Without a believed report for this long the board is opened anew.
const GIVEN_UP: Duration = Duration::from_millis(300);
/// Between two attempts.
const RETRY: Duration = Duration::from_millis(200);

/// Why there is no board.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WoodenError {
    /// It cannot be opened.
    #[error(
        "no WoodenHaptics board can be opened ({0}); plug it in, or let your user read it: echo 'KERNEL==\"hidraw*\", ATTRS{{idVendor}}==\"16c0\", MODE=\"0660\", TAG+=\"uaccess\"' | sudo tee /etc/udev/rules.d/70-taut-wooden.rules, then plug it in anew"
    )]
    Line(String),
    /// No thread.
    #[error(
        "cannot start a thread for the WoodenHaptics board: {0}; end other programs or raise the limit"
    )]
    Thread(String),
}

/// A board under a thread of its own. Dropping it leaves no force.
pub struct WoodenBoard {
    newest: triple_buffer::Output<ArmState>,
    force: triple_buffer::Input<PushedForce>,
    pushed: PushedForce,
    end: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<()>>,
}

impl WoodenBoard {
    /// Opens the board at `path`, or the first on USB, and sets its counters: the arm is taken to be at its home. `priority` asks for real time, 0 does not.
    ///
    /// # Errors
    /// [`WoodenError`].
    pub fn open(
        path: Option<PathBuf>,
        model: WoodenModel,
        priority: u8,
    ) -> Result<Self, WoodenError> {
        let mut line = open(path.as_deref()).map_err(WoodenError::Line)?;
        line.write(&HostReport::SetCounters(model.home).bytes())
            .map_err(WoodenError::Line)?;
        tracing::info!("calibrated: the arm was taken to be at its home");
        let (state, newest) = triple_buffer::TripleBuffer::new(&ArmState::default()).split();
        let (force, taken) = triple_buffer::TripleBuffer::new(&PushedForce::default()).split();
        let end = Arc::new(AtomicBool::new(false));
        let mut talker = Talker {
            path,
            model,
            out: state,
            force: taken,
            held: ForceHold::default(),
            judge: Counters::new(model.metres_per_count()),
            state: ArmState::default(),
            encoders: model.home,
            before: None,
            end: Arc::clone(&end),
        };
        let thread = thread::Builder::new()
            .name("taut-wooden".to_owned())
            .spawn(move || {
                if priority > 0 {
                    let grant = realtime::request_fifo(priority);
                    if !grant.is_granted() {
                        tracing::warn!("{grant}: reports to the WoodenHaptics board may be late");
                    }
                }
                thread::sleep(SETTLE);
                talker.run(line);
            })
            .map_err(|error| WoodenError::Thread(error.to_string()))?;
        Ok(Self {
            newest,
            force,
            pushed: PushedForce::default(),
            end,
            thread: Some(thread),
        })
    }
}

impl ArmPort for WoodenBoard {
    fn newest(&mut self) -> ArmState {
        *self.newest.read()
    }

    fn push(&mut self, force: [f64; 3]) {
        self.pushed.writes += 1;
        self.pushed.force = force;
        self.force.write(self.pushed);
    }
}

impl Drop for WoodenBoard {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // it panics nowhere
        }
    }
}

/// The thread's own.
struct Talker {
    path: Option<PathBuf>,
    model: WoodenModel,
    out: triple_buffer::Input<ArmState>,
    force: triple_buffer::Output<PushedForce>,
    held: ForceHold,
    judge: Counters,
    state: ArmState,
    /// The newest that were believed.
    encoders: [i16; 6],
    before: Option<(Vector3<f64>, Duration)>,
    end: Arc<AtomicBool>,
}

impl Talker {
    fn run(&mut self, first: Box<dyn ReportLine>) {
        let mut next = Some(first);
        let mut told = String::new();
        while !self.is_over() {
            let lost = match next.take().map_or_else(|| open(self.path.as_deref()), Ok) {
                Ok(mut line) => {
                    // Of what was on its way from before nothing is believed.
                    let lost = drained(line.as_mut()).and_then(|()| self.turn(line.as_mut()));
                    let _ = line.write(&HostReport::Currents([0; 3]).bytes()); // gone as well, if it is not taken
                    match lost {
                        Ok(()) => return,
                        Err(lost) => lost,
                    }
                }
                Err(lost) => lost,
            };
            self.state.is_usable = false;
            self.out.write(self.state);
            if lost != told {
                tracing::warn!("the WoodenHaptics board is gone: {lost}; looking for it");
                told = lost;
            }
            thread::sleep(RETRY);
        }
    }

    fn is_over(&self) -> bool {
        self.end.load(Ordering::Relaxed)
    }

    fn turn(&mut self, line: &mut dyn ReportLine) -> Result<(), String> {
        let mut believed = monotonic_now();
        let mut ticker = Ticker::at_phase(PERIOD, PHASE);
        while !self.is_over() {
            ticker.wait();
            let pushed = *self.force.read();
            let force = self
                .held
                .take(monotonic_now(), &pushed)
                .filter(|_| self.state.is_usable);
            let force = Vector3::from(force.unwrap_or_default());
            let currents = self.model.currents(&self.encoders, &force);
            line.write(&HostReport::Currents(currents).bytes())?;
            if let Some(report) = newest_report(line)? {
                let now = monotonic_now();
                if self.take(now, &report) {
                    believed = now;
                } else if self.judge.were_reset() {
                    return Err(
                        "it began to count anew; put the arm at its home, and start again"
                            .to_owned(),
                    );
                }
            }
            if monotonic_now().saturating_sub(believed) > GIVEN_UP {
                return Err("no report is to be believed".to_owned());
            }
        }
        Ok(())
    }

    /// Whether the report is believed; if so it is handed on.
    fn take(&mut self, now: Duration, report: &BoardReport) -> bool {
        let [a, b, c, d, e, f] = report.encoders;
        if self.judge.take(now, &[a, b, c, d, e, f, 0, 0]).is_none() {
            return false;
        }
        self.encoders = report.encoders;
        let position = self.model.position(&self.encoders);
        let velocity = self.before.map_or(Vector3::zeros(), |(before, then)| {
            (position - before) / now.saturating_sub(then).as_secs_f64().max(1e-4)
        });
        self.before = Some((position, now));
        self.state = ArmState {
            reports: self.state.reports + 1,
            is_usable: true,
            position: position.into(),
            velocity: velocity.into(),
            orientation: self
                .model
                .orientation(&self.encoders)
                .map(|q| [q.w, q.i, q.j, q.k]),
            turning: None,
            buttons: 0,
        };
        self.out.write(self.state);
        true
    }
}

/// The newest whole report of those that wait.
fn newest_report(line: &mut dyn ReportLine) -> Result<Option<BoardReport>, String> {
    let mut newest = None;
    let mut buffer = [0; 64];
    let mut wait = ANSWER_WITHIN;
    for _ in 0..MAX_READ {
        match line.read(&mut buffer, wait)? {
            0 => break,
            bytes => newest = BoardReport::parse(&buffer[..bytes]).or(newest),
        }
        wait = Duration::ZERO;
    }
    Ok(newest)
}

fn drained(line: &mut dyn ReportLine) -> Result<(), String> {
    let mut buffer = [0; 64];
    while line.read(&mut buffer, Duration::ZERO)? > 0 {}
    Ok(())
}
