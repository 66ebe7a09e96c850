//! What a person at the terminal sees: lines of text, and below them one live status line.
//!
//! Everything goes to standard error; standard output is for reports. Where standard error is no terminal there is no
//! status line. Nobody waits for it: the texts go by [`taut_bridge::console`], and a terminal that is stopped loses them.

use std::io::IsTerminal;
use std::sync::{Arc, Mutex, PoisonError};

use taut_bridge::console;

/// Return to the first column and clear the line.
const CLEAR_LINE: &str = "\r\x1b[2K";

/// Standard error, shared by the threads that write lines. Not for loops.
#[derive(Clone, Debug)]
pub struct Terminal(Arc<Mutex<Lines>>);

#[derive(Debug)]
struct Lines {
    live: bool,
    status: String,
    said_once: Vec<String>,
}

impl Terminal {
    /// Standard error as it is.
    pub fn standard_error() -> Self {
        Self(Arc::new(Mutex::new(Lines {
            live: std::io::stderr().is_terminal(),
            status: String::new(),
            said_once: Vec::new(),
        })))
    }

    /// Writes a line above the status line.
    pub fn say(&self, line: &str) {
        let lines = self.lines();
        if lines.live && !lines.status.is_empty() {
            console::put(format!("{CLEAR_LINE}{line}\n{}", lines.status));
        } else {
            console::put(format!("{line}\n"));
        }
    }

    /// Writes a line unless the same one was written by this before: several processes have the same to say.
    pub fn say_once(&self, line: &str) {
        {
            let mut lines = self.lines();
            if lines.said_once.iter().any(|said| said == line) {
                return;
            }
            lines.said_once.push(line.to_owned());
        }
        self.say(line);
    }

    /// Replaces the status line.
    pub fn status(&self, status: String) {
        let mut lines = self.lines();
        if lines.live {
            console::put(format!("{CLEAR_LINE}{status}"));
            lines.status = status;
        }
    }

    /// Leaves the last status line standing.
    pub fn end_status(&self) {
        let mut lines = self.lines();
        if !lines.status.is_empty() {
            console::put("\n");
            lines.status.clear();
        }
    }

    fn lines(&self) -> std::sync::MutexGuard<'_, Lines> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
