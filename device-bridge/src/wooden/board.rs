//! The board: currents out and encoders in once a millisecond. Its firmware turns the motors off 0.5 s after the last report.

use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use nalgebra::Vector3;

use super::kinematics::WoodenModel;
use super::line::{ReportLine, open};
use super::report::{BoardReport, HostReport};
use crate::choice::InputError;
use crate::devices::ArmState;
use crate::devices::wire_thread::{ArmLine, ArmThread, Wire, WireThread, ticker};
use crate::realtime::monotonic_now;
use crate::spidar_uart::Counters;

/// A report that is not there by then is none.
const ANSWER_WITHIN: Duration = Duration::from_millis(3);
/// Reports that are read in one period.
const MAX_READ: usize = 16;
/// After the counters were set, reports from before may still come.
const SETTLE: Duration = Duration::from_millis(50);
/// Without a believed report for this long the board is opened anew.
const GIVEN_UP: Duration = Duration::from_millis(300);

/// Opens the board at `path`, or the first on USB, and sets its counters: the arm is taken to be at its home. `priority` asks for real time, 0 does not.
///
/// # Errors
/// There is no such board, or no thread.
pub(crate) fn start(
    path: Option<PathBuf>,
    model: WoodenModel,
    priority: u8,
) -> Result<ArmThread, InputError> {
    let mut line = open(path.as_deref()).map_err(InputError::Wooden)?;
    line.write(&HostReport::SetCounters(model.home).bytes())
        .map_err(InputError::Wooden)?;
    tracing::info!("calibrated: the arm was taken to be at its home");
    let talker = Talker {
        path,
        opened: Some(line),
        model,
        judge: Counters::new(model.metres_per_count()),
        encoders: model.home,
        before: None,
    };
    Ok(WireThread::start(
        "taut-wooden",
        "the WoodenHaptics board",
        priority,
        talker,
    )?)
}

struct Talker {
    path: Option<PathBuf>,
    /// For the first session.
    opened: Option<Box<dyn ReportLine>>,
    model: WoodenModel,
    judge: Counters,
    /// The newest that were believed.
    encoders: [i16; 6],
    before: Option<([f64; 3], Duration)>,
}

impl Wire for Talker {
    type State = ArmState;
    type Command = [f64; 3];
    type Lost = String;

    fn name(&self) -> String {
        "the WoodenHaptics board".to_owned()
    }

    fn session(&mut self, line: &mut ArmLine) -> Result<(), String> {
        let mut board = match self.opened.take() {
            Some(board) => {
                thread::sleep(SETTLE);
                board
            }
            None => open(self.path.as_deref())?,
        };
        // Of what was on its way from before nothing is believed.
        let ended = drained(board.as_mut()).and_then(|()| self.turn(board.as_mut(), line));
        let _ = board.write(&HostReport::Currents([0; 3]).bytes()); // gone as well, if it is not taken
        ended
    }
}

impl Talker {
    fn turn(&mut self, board: &mut dyn ReportLine, line: &mut ArmLine) -> Result<(), String> {
        let mut believed = monotonic_now();
        let mut ticker = ticker();
        while !line.is_over() {
            ticker.wait();
            let force = line.command_if(monotonic_now(), line.state.is_usable);
            let force = Vector3::from(force.unwrap_or_default());
            let currents = self.model.currents(&self.encoders, &force);
            board.write(&HostReport::Currents(currents).bytes())?;
            if let Some(report) = newest_report(board)? {
                let now = monotonic_now();
                if self.take(now, &report, line) {
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
    fn take(&mut self, now: Duration, report: &BoardReport, line: &mut ArmLine) -> bool {
        let [a, b, c, d, e, f] = report.encoders;
        if self.judge.take(now, &[a, b, c, d, e, f, 0, 0]).is_none() {
            return false;
        }
        self.encoders = report.encoders;
        let position = self.model.position(&self.encoders);
        let orientation = self.model.orientation(&self.encoders);
        line.state = ArmState {
            orientation: orientation.map(|q| [q.w, q.i, q.j, q.k]),
            buttons: u16::from(report.button),
            ..line.state.moved(&mut self.before, now, position.into())
        };
        line.publish();
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
