//! The board on the serial port: a force out and a pose in once a millisecond.

use std::io::{Read, Write};
use std::time::Duration;

use super::frame::{Frame, LINE as LINE_BYTES, force_frame, short_force_frame};
use crate::choice::InputError;
use crate::devices::ArmState;
use crate::devices::wire_thread::{ArmLine, ArmThread, Wire, WireThread, ticker};
use crate::realtime::monotonic_now;
use crate::serial_port::{self, Port};
use crate::spidar_uart::Counters;

/// Nominal: the board is on USB, which has no baud.
const BAUD: u32 = 115_200;
/// An answer that is not there by then is none.
const ANSWER_WITHIN: Duration = Duration::from_millis(3);
/// Without a believed line for this long the port is opened anew.
const GIVEN_UP: Duration = Duration::from_millis(300);
/// Lines of zero force at an end, in case one is lost.
const LAST_LINES: u32 = 3;
/// What a line's lengths and angles are rounded to where they are judged: 10 um, 0.1 mrad.
const JUDGED: (f64, f64) = (1e-5, 1e-4);
/// Most bytes without a line's end.
const MAX_BUFFER: usize = 16 * LINE_BYTES;

/// Opens the port; a board that says nothing yet is waited for. `priority` asks for real time, 0 does not.
///
/// # Errors
/// There is no such port, or no thread.
pub(crate) fn start(path: &str, priority: u8) -> Result<ArmThread, InputError> {
    let serial = Serial {
        path: path.to_owned(),
        opened: Some(serial_port::open(path, BAUD, ANSWER_WITHIN)?),
        judge: Counters::new(JUDGED.0),
        before: None,
        buffer: Vec::with_capacity(MAX_BUFFER),
        line_bytes: None,
    };
    Ok(WireThread::start(
        "taut-polhem",
        "the Polhem board",
        priority,
        serial,
    )?)
}

struct Serial {
    path: String,
    /// For the first session.
    opened: Option<Port>,
    judge: Counters,
    /// Position and time of the line believed before, for the velocity.
    before: Option<([f64; 3], Duration)>,
    buffer: Vec<u8>,
    /// Bytes of the board's lines, once they are known; those to it have as many.
    line_bytes: Option<usize>,
}

impl Wire for Serial {
    type State = ArmState;
    type Command = [f64; 3];
    type Lost = String;

    fn name(&self) -> String {
        format!("the Polhem board on {}", self.path)
    }

    fn session(&mut self, line: &mut ArmLine) -> Result<(), String> {
        let opened = self.opened.take();
        let mut port = opened
            .map_or_else(|| serial_port::open(&self.path, BAUD, ANSWER_WITHIN), Ok)
            .map_err(|error| error.to_string())?;
        let ended = self.turn(&mut port, line);
        self.let_go(&mut port);
        ended.map_err(|error| error.to_string())
    }
}

impl Serial {
    /// Zero, as far as the line still takes it: said until it is answered, because a port that is closed may drop what it has not sent.
    fn let_go(&mut self, port: &mut Port) {
        for _ in 0..LAST_LINES {
            let said = self.say(port, &[0.0; 3]).and_then(|()| port.flush());
            if said.is_err() || self.newest_frame(port).is_err() {
                return;
            }
        }
    }

    fn turn(&mut self, port: &mut Port, line: &mut ArmLine) -> std::io::Result<()> {
        self.buffer.clear();
        self.line_bytes = None;
        let mut believed = monotonic_now();
        let mut ticker = ticker();
        while !line.is_over() {
            ticker.wait();
            let force = line.command(monotonic_now()).unwrap_or_default();
            self.say(port, &force)?;
            if let Some(frame) = self.newest_frame(port)? {
                let now = monotonic_now();
                if self.take(now, &frame, line) {
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

    fn say(&self, port: &mut Port, force: &[f64; 3]) -> std::io::Result<()> {
        if self.line_bytes.is_none_or(|bytes| bytes == LINE_BYTES) {
            port.write_all(&force_frame(force))
        } else {
            port.write_all(&short_force_frame(force))
        }
    }

    /// The newest whole line; what is no line is dropped.
    fn newest_frame(&mut self, port: &mut Port) -> std::io::Result<Option<Frame>> {
        let mut chunk = [0; 4 * LINE_BYTES];
        match port.read(&mut chunk) {
            Ok(0) => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            Ok(bytes) => self.buffer.extend(&chunk[..bytes]),
            Err(error) if error.kind() == std::io::ErrorKind::TimedOut => {}
            Err(error) => return Err(error),
        }
        let newest = Frame::newest(&mut self.buffer, &mut self.line_bytes);
        if self.buffer.len() > MAX_BUFFER {
            self.buffer.clear();
        }
        Ok(newest)
    }

    /// Whether the frame is believed; if so it is handed on.
    fn take(&mut self, now: Duration, frame: &Frame, line: &mut ArmLine) -> bool {
        let [x, y, z] = frame.position.map(|part| (part / JUDGED.0) as i16); // wraps nowhere within 0.3 m, and saturates
        let [a, b, c, d] = frame.angles.map(|part| (part / JUDGED.1) as i16);
        if self.judge.take(now, &[x, y, z, a, b, c, d, 0]).is_none() {
            return false;
        }
        let q = frame.orientation();
        line.state = ArmState {
            orientation: Some([q.w, q.i, q.j, q.k]),
            ..line.state.moved(&mut self.before, now, frame.position)
        };
        line.publish();
        true
    }
}
