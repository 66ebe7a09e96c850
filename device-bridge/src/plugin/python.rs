//! A device in Python: a file in a process of its own, which `taut_host.py` runs and which answers one request at a time.
//!
//! A process can be interrupted where a library cannot. One that does not answer is sent SIGINT, which raises in whatever the file does; the host then
//! gives the device its zero and closes it, and says where it hung. One that does not stop at that is killed.

use std::io::{ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::claims::{PluginInfo, RawSample};
use super::frame::{self, Ask, HEAD, MAX_CONTENT, Said};
use super::printed::Printed;
use super::{Answer, OpenDevice, Opener, PluginError};
use crate::realtime::monotonic_now;
use crate::signals::interrupt;

const HOST: &str = include_str!("taut_host.py");
/// For the interpreter, the file's imports and its `open`.
const OPEN_WITHIN: Duration = Duration::from_secs(9);
/// For an answer. The port has taken the force away long before.
const ANSWER_WITHIN: Duration = Duration::from_millis(100);
/// From an interruption to the end of the process.
const INTERRUPTED_WITHIN: Duration = Duration::from_millis(200);
/// For zero and close at the end.
const CLOSE_WITHIN: Duration = Duration::from_millis(500);
/// Between two looks whether it is over.
const LOOK: Duration = Duration::from_millis(10);

pub(super) struct PythonFile {
    interpreter: PathBuf,
    path: PathBuf,
    options: Vec<String>,
    priority: u8,
}

impl PythonFile {
    pub(super) fn new(
        interpreter: &Path,
        path: &Path,
        options: &str,
        priority: u8,
    ) -> Result<Self, PluginError> {
        let options = options.split(',').filter(|option| !option.is_empty());
        let options: Vec<String> = options.map(str::to_owned).collect();
        if let Some(wrong) = options.iter().find(|option| !option.contains('=')) {
            return Err(PluginError::Option(wrong.clone()));
        }
        Ok(Self {
            interpreter: interpreter.to_owned(),
            path: path.canonicalize().map_err(|error| {
                PluginError::Missing(path.to_owned(), error.to_string(), "python:/path/device.py")
            })?,
            options,
            priority,
        })
    }

    fn start(&self, end: &Arc<AtomicBool>) -> Result<Process, PluginError> {
        let failed = |error: std::io::Error| {
            PluginError::Interpreter(self.interpreter.clone(), error.to_string())
        };
        let (link, theirs) = UnixStream::pair().map_err(failed)?;
        link.set_read_timeout(Some(LOOK)).map_err(failed)?;
        link.set_write_timeout(Some(ANSWER_WITHIN))
            .map_err(failed)?;
        let (printed, out) = std::io::pipe().map_err(failed)?;
        let mut python = Command::new(&self.interpreter);
        python
            .args(["-u", "-X", "faulthandler", "-c", HOST])
            .arg(&self.path)
            .arg(if self.priority > 0 { "fifo" } else { "normal" })
            .args(&self.options)
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .stdout(out.try_clone().map_err(failed)?)
            .stderr(out)
            // Ctrl-C is for taut, which then closes the device.
            .process_group(0);
        let child = python.spawn().map_err(failed)?;
        let name = self.path.file_name().unwrap_or(self.path.as_os_str());
        Ok(Process {
            child,
            link,
            printed: Printed::read(printed, &name.to_string_lossy()),
            wrong: String::new(),
            end: Arc::clone(end),
            is_over: false,
        })
    }
}

impl Opener for PythonFile {
    fn open(
        &mut self,
        end: &Arc<AtomicBool>,
    ) -> Result<(Box<dyn OpenDevice + '_>, PluginInfo), PluginError> {
        let mut process = self.start(end)?;
        match process.listen(OPEN_WITHIN, true) {
            Some(Said::Info(raw)) => {
                let info = PluginInfo::of(&raw);
                let info = info.map_err(|claim| PluginError::Info(self.path.clone(), claim))?;
                Ok((Box::new(process), info))
            }
            _ => Err(PluginError::Open(self.path.clone(), process.wrong.clone())),
        }
    }
}

/// The process. Dropping it closes the device, or kills it.
struct Process {
    child: Child,
    link: UnixStream,
    printed: Printed,
    wrong: String,
    end: Arc<AtomicBool>,
    /// It has ended, or is about to.
    is_over: bool,
}

impl OpenDevice for Process {
    fn read(&mut self) -> (Answer, RawSample) {
        match self.ask(Ask::Read, &[0.0; 6]) {
            Some(Said::Answer(answer, sample)) => (answer, sample.unwrap_or(RawSample::UNSET)),
            _ => (Answer::Gone, RawSample::UNSET),
        }
    }

    fn write(&mut self, wrench: &[f64; 6]) -> Answer {
        match self.ask(Ask::Write, wrench) {
            Some(Said::Answer(answer, None)) => answer,
            _ => Answer::Gone,
        }
    }

    fn error_text(&mut self, _answer: Answer) -> String {
        if self.wrong.is_empty() {
            "it answers what it was not asked".to_owned()
        } else {
            self.wrong.clone()
        }
    }
}

impl Process {
    /// Asks, and waits for the answer; `None` where there is none, and the reason in `wrong`.
    fn ask(&mut self, ask: Ask, wrench: &[f64; 6]) -> Option<Said> {
        if self.is_over {
            return None;
        }
        if self.link.write_all(&frame::request(ask, wrench)).is_err() {
            // What it said before it went is still there.
            let said = self.listen(LOOK, false);
            debug_assert!(said.is_none(), "an answer without a request");
            return None;
        }
        let within = match ask {
            Ask::Read | Ask::Write => ANSWER_WITHIN,
            Ask::Close => CLOSE_WITHIN,
        };
        self.listen(within, false)
    }

    /// The next answer. One that says what went wrong, and none, end the process.
    fn listen(&mut self, within: Duration, is_opening: bool) -> Option<Said> {
        let said = match self.receive(within, is_opening) {
            Ok(Said::Error(text)) => {
                self.wrong = text;
                self.end_within(INTERRUPTED_WITHIN);
                return None;
            }
            Ok(said) => return Some(said),
            Err(why) => why,
        };
        match said {
            Silence::Ended => {
                self.end_within(INTERRUPTED_WITHIN);
                let how = self
                    .child
                    .try_wait()
                    .ok()
                    .flatten()
                    .map_or_else(String::new, |status| format!(" ({status})"));
                self.wrong = format!(
                    "its process ended without a word{how}{}",
                    self.printed.last_lines()
                );
            }
            Silence::Nonsense => {
                self.wrong = "it answers what no answer is".to_owned();
                self.kill();
            }
            Silence::Hangs => self.interrupt(within),
        }
        None
    }

    fn receive(&mut self, within: Duration, is_opening: bool) -> Result<Said, Silence> {
        let until = monotonic_now() + within;
        let mut head = [0; HEAD];
        self.fill(&mut head, until, is_opening)?;
        let (code, length) = frame::head(head).ok_or(Silence::Nonsense)?;
        // A sample fits; a text comes when nothing is in time any more.
        let mut content = [0; MAX_CONTENT];
        let content = &mut content[..length];
        self.fill(content, until, is_opening)?;
        frame::answer(code, content).ok_or(Silence::Nonsense)
    }

    fn fill(&mut self, bytes: &mut [u8], until: Duration, is_opening: bool) -> Result<(), Silence> {
        let mut got = 0;
        while got < bytes.len() {
            match self.link.read(&mut bytes[got..]) {
                Ok(0) => return Err(Silence::Ended),
                Ok(count) => got += count,
                Err(error) if is_wait(error.kind()) => {
                    let is_over = is_opening && self.end.load(Ordering::Relaxed);
                    if monotonic_now() > until || is_over {
                        return Err(Silence::Hangs);
                    }
                    // One of its children may hold the other end.
                    if matches!(self.child.try_wait(), Ok(Some(_))) {
                        return Err(Silence::Ended);
                    }
                }
                Err(_) => return Err(Silence::Ended),
            }
        }
        Ok(())
    }

    /// Interrupts what the file does, and kills it where that does not help.
    fn interrupt(&mut self, after: Duration) {
        self.is_over = true;
        let hung = format!("it did not answer within {} ms", after.as_millis());
        interrupt(&self.child);
        self.wrong = match self.receive(INTERRUPTED_WITHIN, false) {
            Ok(Said::Error(text)) => {
                self.end_within(INTERRUPTED_WITHIN);
                format!("{hung}; interrupted, it was here:\n{text}")
            }
            // It went on: its answer comes too late, and it is closed as always.
            Ok(_) => {
                self.is_over = false;
                hung
            }
            Err(_) => {
                self.kill();
                format!(
                    "{hung}, nor {} ms after it was interrupted, and was killed: nobody could tell its hardware to let go",
                    INTERRUPTED_WITHIN.as_millis()
                )
            }
        };
    }

    /// Waits for the end of a process that is about to end, and kills it where that takes too long.
    fn end_within(&mut self, within: Duration) {
        self.is_over = true;
        let until = monotonic_now() + within;
        while matches!(self.child.try_wait(), Ok(None)) {
            if monotonic_now() > until {
                self.kill();
                return;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn kill(&mut self) {
        self.is_over = true;
        // Neither fails for a child that was not waited for, and both say no more of one that was.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if self.is_over {
            return;
        }
        match self.ask(Ask::Close, &[0.0; 6]) {
            Some(_) => self.end_within(INTERRUPTED_WITHIN),
            None => tracing::error!(
                "a device in Python could not be closed, make sure that it pushes no more: {}",
                self.wrong
            ),
        }
        if !self.is_over {
            self.kill();
        }
    }
}

enum Silence {
    Hangs,
    Ended,
    Nonsense,
}

fn is_wait(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
    )
}
