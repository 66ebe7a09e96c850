//! The boards on the serial port: a cycle a millisecond.
//!
//! What keeps a current from outliving its reason, beside what [`WireThread`] does, since no board is known to let go by itself: zero currents are sent
//! whenever no answer was believed for 20 ms, and first of all after the boards were found.

use std::io::{self, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use serialport::ClearBuffer;
use taut_spidar::{Geometry, PerString, Reading, STRINGS, StringFault, StringHardware};

use super::converter::{digit, digits_per_newton};
use super::counters::Counters;
use super::cycle::{BrokenCycle, Cycle};
use super::error::BoardsError;
use super::packet::{BoardInfo, INFO, INFO_ANSWER, INFO_PADDING, MAX_BOARDS, header};
use crate::devices::wire_thread::{HOLDS, Line, Wire, WireState, WireThread, ticker};
use crate::realtime::monotonic_now;
use crate::serial_port::{self, Port, PortError};

const BAUD: u32 = 2_000_000;
/// An answer that is not there by then is none: a busy machine is late by some milliseconds, cycle after cycle, and half of [`HOLDS`] harms no promise.
const ANSWER_WITHIN: Duration = Duration::from_millis(10);
/// The same of a board that is looked for: the line is asked once with each patience before it has none. A busy machine on either side answers late.
const FOUND_WITHIN: [Duration; 6] = [
    Duration::from_millis(15),
    Duration::from_millis(15),
    Duration::from_millis(60),
    Duration::from_millis(60),
    Duration::from_millis(200),
    Duration::from_millis(200),
];
/// Without a believed answer for this long the line is opened anew.
const GIVEN_UP: Duration = Duration::from_millis(300);
/// For the first counts, once the boards are found.
const COUNTS_WITHIN: Duration = Duration::from_secs(5);
/// Between two looks for them.
const LOOK: Duration = Duration::from_millis(1);
/// Cycles of zero currents at an end, in case one is lost.
const LAST_CYCLES: u32 = 3;

#[derive(Clone, Copy, Debug, Default)]
struct Counted {
    readings: u64,
    counts: [i32; STRINGS],
    is_there: bool,
}

impl WireState for Counted {
    fn lose(&mut self) {
        self.is_there = false;
    }
}

/// Motor boards on a serial line. Dropping it leaves no current.
pub struct SpidarBoards {
    /// Commands are digits of the boards' converters.
    thread: WireThread<Counted, [i16; STRINGS]>,
    digits_per_newton: PerString,
    seen: (u64, Duration),
}

impl SpidarBoards {
    /// Opens the line and looks for the boards; `priority` asks for real time, 0 does not. Waits for the first counts.
    pub fn open(path: &str, geometry: &Geometry, priority: u8) -> Result<Self, BoardsError> {
        let digits_per_newton = digits_per_newton(geometry)?;
        let count = geometry
            .metres_per_count
            .iter()
            .fold(f64::INFINITY, |least, count| least.min(count.abs()));
        let mut serial = Serial {
            path: path.to_owned(),
            found: None,
            counters: Counters::new(count),
            bytes: Vec::with_capacity(256),
            heard: Vec::with_capacity(512),
        };
        serial.found = Some(serial.find(&AtomicBool::new(false))?);
        let mut thread = WireThread::start("taut-spidar", "the motor boards", priority, serial)?;
        let until = monotonic_now() + COUNTS_WITHIN;
        while thread.newest().readings == 0 {
            if monotonic_now() > until {
                return Err(BoardsError::Counts(path.to_owned()));
            }
            thread::sleep(LOOK);
        }
        Ok(Self {
            thread,
            digits_per_newton,
            seen: (0, Duration::ZERO),
        })
    }
}

impl StringHardware for SpidarBoards {
    fn read_counts(&mut self, now: Duration) -> Result<Reading, StringFault> {
        let counted = *self.thread.newest();
        if counted.readings != self.seen.0 {
            self.seen = (counted.readings, now);
        }
        let age = now.saturating_sub(self.seen.1);
        if !counted.is_there || counted.readings == 0 || age > HOLDS {
            return Err(StringFault::Hardware);
        }
        Ok(Reading {
            time: self.seen.1,
            counts: counted.counts,
            tensions: None,
            buttons: 0,
        })
    }

    fn write_tensions(&mut self, _now: Duration, tensions: &PerString) {
        let digits = std::array::from_fn(|i| digit(tensions[i], self.digits_per_newton[i]));
        self.thread.command(digits);
    }

    fn let_go(&mut self) -> bool {
        self.thread.let_go()
    }
}

type BoardLine = Line<Counted, [i16; STRINGS]>;

struct Serial {
    path: String,
    /// For the first session.
    found: Option<(Port, Cycle)>,
    counters: Counters,
    bytes: Vec<u8>,
    heard: Vec<u8>,
}

impl Wire for Serial {
    type State = Counted;
    type Command = [i16; STRINGS];
    type Lost = String;

    fn name(&self) -> String {
        format!("the line of the motor boards on {}", self.path)
    }

    fn session(&mut self, line: &mut BoardLine) -> Result<(), String> {
        let found = self.found.take();
        let found = found.map_or_else(|| self.find(&line.end()), Ok);
        if found.is_err() && line.is_over() {
            return Ok(()); // they were not looked for to the end
        }
        let (mut port, cycle) = found.map_err(|error| error.to_string())?;
        let ended = self.turn(&mut port, &cycle, line);
        self.let_go(&mut port, &cycle);
        ended.map_err(|error| error.to_string())
    }
}

impl Serial {
    /// Opens the port and looks for the boards, until `end`.
    fn find(&mut self, end: &AtomicBool) -> Result<(Port, Cycle), BoardsError> {
        let path = self.path.clone();
        let failed = |cause: io::Error| PortError::new(&path, cause);
        let mut port = serial_port::open(&path, BAUD, FOUND_WITHIN[0])?;
        // An answer may be late, or one of a question before.
        let mut found = (None, 0, Vec::new());
        for patience in FOUND_WITHIN {
            let boards = self.ask_all(&mut port, patience, end).map_err(failed)?;
            let motors = boards
                .iter()
                .map(|(_, info)| usize::from(info.motors))
                .sum();
            let models: Vec<u8> = boards.iter().map(|(_, info)| info.model).collect();
            found = (Cycle::new(boards), motors, models);
            if found.0.is_some() {
                break;
            }
        }
        let (cycle, motors, models) = found;
        let cycle = cycle.ok_or_else(|| BoardsError::Motors(path.clone(), motors))?;
        cycle.set_up(&mut self.bytes);
        port.write_all(&self.bytes).map_err(failed)?;
        port.set_timeout(ANSWER_WITHIN)
            .map_err(|cause| failed(cause.into()))?;
        tracing::info!("motor boards on {path}: models {models:?}");
        Ok((port, cycle))
    }

    /// Asks each number on the line what it is, until `end`.
    fn ask_all(
        &mut self,
        port: &mut Port,
        patience: Duration,
        end: &AtomicBool,
    ) -> io::Result<Vec<(u8, BoardInfo)>> {
        port.set_timeout(patience)?;
        let mut boards = Vec::new();
        for board in (0..MAX_BOARDS).take_while(|_| !end.load(Ordering::Relaxed)) {
            self.bytes.clear();
            self.bytes.resize(INFO_PADDING.0, 0);
            self.bytes.push(header(board, INFO));
            self.bytes.resize(INFO_PADDING.0 + 1 + INFO_PADDING.1, 0);
            port.clear(ClearBuffer::Input)?;
            port.write_all(&self.bytes)?;
            let mut answer = [0; INFO_ANSWER];
            match port.read_exact(&mut answer) {
                Ok(()) => boards.extend(BoardInfo::parse(board, &answer).map(|info| (board, info))),
                Err(error) if error.kind() == io::ErrorKind::TimedOut => {}
                Err(error) => return Err(error),
            }
        }
        Ok(boards)
    }

    /// Cycles until the end, or until the line is lost.
    fn turn(&mut self, port: &mut Port, cycle: &Cycle, line: &mut BoardLine) -> io::Result<()> {
        let mut ticker = ticker();
        let mut believed = monotonic_now();
        while !line.is_over() {
            ticker.wait();
            let now = monotonic_now();
            let is_believed = now.saturating_sub(believed) < HOLDS;
            let digits = line.command_if(now, is_believed).unwrap_or_default();
            if let Ok(raw) = self.exchange(port, cycle, &digits)? {
                if let Some(counts) = self.counters.take(monotonic_now(), &raw) {
                    believed = monotonic_now();
                    line.state = Counted {
                        readings: line.state.readings + 1,
                        counts,
                        is_there: true,
                    };
                    line.publish();
                } else if self.counters.were_reset() {
                    return Err(io::Error::other(
                        "they began to count anew, so that the calibration is lost; hold the grip at the centre and start again",
                    ));
                }
            }
            if monotonic_now().saturating_sub(believed) > GIVEN_UP {
                return Err(io::Error::other("no answer is to be believed"));
            }
        }
        Ok(())
    }

    /// One cycle: what is sent, and what is answered.
    fn exchange(
        &mut self,
        port: &mut Port,
        cycle: &Cycle,
        digits: &[i16; STRINGS],
    ) -> io::Result<Result<[i16; STRINGS], BrokenCycle>> {
        cycle.send(digits, &mut self.bytes);
        // What came too late answers a cycle before: taken for this one's, it would leave every later answer one cycle late.
        port.clear(ClearBuffer::Input)?;
        port.write_all(&self.bytes)?;
        let until = monotonic_now() + ANSWER_WITHIN;
        self.heard.clear();
        let mut chunk = [0; 256];
        loop {
            match port.read(&mut chunk) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(bytes) => self.heard.extend(&chunk[..bytes]),
                Err(error) if error.kind() == io::ErrorKind::TimedOut => {}
                Err(error) => return Err(error),
            }
            let heard = cycle.hear(&self.heard);
            if heard != Err(BrokenCycle::Short) || monotonic_now() >= until {
                return Ok(heard);
            }
        }
    }

    /// Zero currents, as far as the line still takes them.
    fn let_go(&mut self, port: &mut Port, cycle: &Cycle) {
        for _ in 0..LAST_CYCLES {
            if self.exchange(port, cycle, &[0; STRINGS]).is_err() {
                return;
            }
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use serialport::TTYPort;

    use super::super::packet::CURRENT;
    use super::*;

    #[test]
    fn an_answer_that_came_too_late_is_not_the_next_cycles() {
        let (mut far, near) = TTYPort::pair().expect("a terminal");
        let mut port: Port = Box::new(near);
        port.set_timeout(ANSWER_WITHIN).expect("a patience");
        let eight = BoardInfo::of_model(7).expect("known");
        let cycle = Cycle::new(vec![(0, eight)]).expect("eight motors");
        let mut answer = vec![0; eight.cycle_answer()];
        answer[0] = header(0, CURRENT);
        answer.extend(&eight.answer(0)[..5]);
        assert_eq!(cycle.hear(&answer), Ok([0; STRINGS]), "it is a whole one");

        far.write_all(&answer).expect("room");
        while (port.bytes_to_read().expect("a terminal") as usize) < answer.len() {
            thread::yield_now();
        }
        let mut serial = Serial {
            path: String::new(),
            found: None,
            counters: Counters::new(3.485e-5),
            bytes: Vec::new(),
            heard: Vec::new(),
        };
        let heard = serial.exchange(&mut port, &cycle, &[0; STRINGS]);
        assert_eq!(heard.expect("a terminal"), Err(BrokenCycle::Short));
    }
}
