//! The thread on the serial port: a force out and a pose in once a millisecond, and the board opened again when it is gone.
//!
//! As with every force device here no force outlives its reason: zero is sent when the device's loop has not written for 20 ms, and at every end.

use std::io::{Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use serialport::SerialPort;

use super::frame::{Frame, LINE, force_frame};
use crate::devices::{ArmPort, ArmState};
use crate::haply::{ForceHold, PushedForce};
use crate::realtime::{self, Ticker, monotonic_now};
use crate::spidar_uart::Counters;

/// Nominal: the board is on USB, which has no baud.
const BAUD: u32 = 115_200;
/// From line to line.
const PERIOD: Duration = Duration::from_millis(1);
/// Where in the millisecond a line goes out: just after the device's loop.
const PHASE: Duration = Duration::from_micros(350);
/// An answer that is not there by then is none.
const ANSWER_WITHIN: Duration = Duration::from_millis(3);
/// Without a believed line for this long the port is opened anew.
const GIVEN_UP: Duration = Duration::from_millis(300);
/// Lines of zero force at an end, in case one is lost.
const LAST_LINES: u32 = 3;
/// Between two attempts.
const RETRY: Duration = Duration::from_millis(200);
/// What a line's lengths and angles are rounded to where they are judged: 10 um, 0.1 mrad.
const JUDGED: (f64, f64) = (1e-5, 1e-4);
/// Most bytes without a line's end.
const MAX_BUFFER: usize = 16 * LINE;

/// Why there is no board.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PolhemError {
    /// The port cannot be opened.
    #[error(
        "the serial port {path} cannot be opened ({cause}); look at the cable and at `taut doctor`, and let your user open it: sudo usermod -aG dialout $USER, then log in again"
    )]
    Port {
        /// As given.
        path: String,
        /// What the system says.
        cause: String,
    },
    /// No thread.
    #[error(
        "cannot start a thread for the Polhem board: {0}; end other programs or raise the limit"
    )]
    Thread(String),
}

/// A board under a thread of its own. Dropping it leaves no force.
pub struct PolhemBoard {
    newest: triple_buffer::Output<ArmState>,
    force: triple_buffer::Input<PushedForce>,
    pushed: PushedForce,
    end: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<()>>,
}

impl PolhemBoard {
    /// Opens the port; a board that says nothing yet is waited for. `priority` asks for real time, 0 does not.
    ///
    /// # Errors
    /// [`PolhemError`].
    pub fn open(path: &str, priority: u8) -> Result<Self, PolhemError> {
        let port = open(path)?;
        let (state, newest) = triple_buffer::TripleBuffer::new(&ArmState::default()).split();
        let (force, taken) = triple_buffer::TripleBuffer::new(&PushedForce::default()).split();
        let end = Arc::new(AtomicBool::new(false));
        let mut line = Line {
            path: path.to_owned(),
            out: state,
            force: taken,
            held: ForceHold::default(),
            judge: Counters::new(JUDGED.0),
            state: ArmState::default(),
            before: None,
            buffer: Vec::with_capacity(MAX_BUFFER),
            end: Arc::clone(&end),
        };
        let thread = thread::Builder::new()
            .name("taut-polhem".to_owned())
            .spawn(move || {
                if priority > 0 {
                    let grant = realtime::request_fifo(priority);
                    if !grant.is_granted() {
                        tracing::warn!("{grant}: lines of the Polhem board may be late");
                    }
                }
                line.run(port);
            })
            .map_err(|error| PolhemError::Thread(error.to_string()))?;
        Ok(Self {
            newest,
            force,
            pushed: PushedForce::default(),
            end,
            thread: Some(thread),
        })
    }
}

impl ArmPort for PolhemBoard {
    fn newest(&mut self) -> ArmState {
        *self.newest.read()
    }

    fn push(&mut self, force: [f64; 3]) {
        self.pushed.writes += 1;
        self.pushed.force = force;
        self.force.write(self.pushed);
    }
}

impl Drop for PolhemBoard {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // it panics nowhere
        }
    }
}

type Port = Box<dyn SerialPort>;

fn open(path: &str) -> Result<Port, PolhemError> {
    serialport::new(path, BAUD)
        .timeout(ANSWER_WITHIN)
        .open()
        .map_err(|error| PolhemError::Port {
            path: path.to_owned(),
            cause: error.to_string(),
        })
}

/// The thread's own.
struct Line {
    path: String,
    out: triple_buffer::Input<ArmState>,
    force: triple_buffer::Output<PushedForce>,
    held: ForceHold,
    judge: Counters,
    state: ArmState,
    /// Position and time of the line believed before, for the velocity.
    before: Option<([f64; 3], Duration)>,
    buffer: Vec<u8>,
    end: Arc<AtomicBool>,
}

impl Line {
    fn run(&mut self, first: Port) {
        let mut next = Some(first);
        let mut told = String::new();
        while !self.is_over() {
            let lost = match next.take().map_or_else(|| open(&self.path), Ok) {
                Ok(mut port) => {
                    let lost = self.turn(&mut port);
                    self.let_go(&mut port);
                    match lost {
                        Ok(()) => return,
                        Err(error) => error.to_string(),
                    }
                }
                Err(error) => error.to_string(),
            };
            self.state.is_usable = false;
            self.out.write(self.state);
            if lost != told {
                tracing::warn!(
                    "the Polhem board on {} is gone: {lost}; looking for it",
                    self.path
                );
                told = lost;
            }
            thread::sleep(RETRY);
        }
    }

    fn is_over(&self) -> bool {
        self.end.load(Ordering::Relaxed)
    }

    /// Zero, as far as the line still takes it: said until it is answered, because a port that is closed may drop what it has not sent.
    fn let_go(&mut self, port: &mut Port) {
        for _ in 0..LAST_LINES {
            let said = port
                .write_all(&force_frame(&[0.0; 3]))
                .and_then(|()| port.flush());
            if said.is_err() || self.newest_frame(port).is_err() {
                return;
            }
        }
    }

    fn turn(&mut self, port: &mut Port) -> std::io::Result<()> {
        self.buffer.clear();
        let mut believed = monotonic_now();
        let mut ticker = Ticker::at_phase(PERIOD, PHASE);
        while !self.is_over() {
            ticker.wait();
            let now = monotonic_now();
            let pushed = *self.force.read();
            let force = self.held.take(now, &pushed).unwrap_or([0.0; 3]);
            port.write_all(&force_frame(&force))?;
            if let Some(frame) = self.newest_frame(port)? {
                let now = monotonic_now();
                if self.take(now, &frame) {
                    believed = now;
                } else if self.judge.were_reset() {
                    return Err(std::io::Error::other(
                        "it began anew at zero; calibrate it, and start again",
                    ));
                }
            }
            if monotonic_now().saturating_sub(believed) > GIVEN_UP {
                return Err(std::io::Error::other("no line is to be believed"));
            }
        }
        Ok(())
    }

    /// The newest whole line; what is no line is dropped.
    fn newest_frame(&mut self, port: &mut Port) -> std::io::Result<Option<Frame>> {
        let mut chunk = [0; 4 * LINE];
        match port.read(&mut chunk) {
            Ok(0) => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            Ok(bytes) => self.buffer.extend(&chunk[..bytes]),
            Err(error) if error.kind() == std::io::ErrorKind::TimedOut => {}
            Err(error) => return Err(error),
        }
        let mut newest = None;
        while let Some(end) = self.buffer.iter().position(|byte| *byte == b'\n') {
            newest = Frame::parse(&self.buffer[..=end]).ok().or(newest);
            self.buffer.drain(..=end);
        }
        if self.buffer.len() > MAX_BUFFER {
            self.buffer.clear();
        }
        Ok(newest)
    }

    /// Whether the frame is believed; if so it is handed on.
    fn take(&mut self, now: Duration, frame: &Frame) -> bool {
        let [x, y, z] = frame.position.map(|part| (part / JUDGED.0) as i16); // wraps nowhere within 0.3 m, and saturates
        let [a, b, c, d] = frame.angles.map(|part| (part / JUDGED.1) as i16);
        if self.judge.take(now, &[x, y, z, a, b, c, d, 0]).is_none() {
            return false;
        }
        let velocity = self.before.map_or([0.0; 3], |(before, then)| {
            let passed = now.saturating_sub(then).as_secs_f64().max(1e-4);
            std::array::from_fn(|i| (frame.position[i] - before[i]) / passed)
        });
        self.before = Some((frame.position, now));
        let q = frame.orientation();
        self.state = ArmState {
            reports: self.state.reports + 1,
            is_usable: true,
            position: frame.position,
            velocity,
            orientation: Some([q.w, q.i, q.j, q.k]),
            turning: None,
            buttons: 0,
        };
        self.out.write(self.state);
        true
    }
}
