//! What a person at the terminal sees: lines of text, and below them one live status line.
//!
//! Everything goes to standard error; standard output is for reports. Where standard error is no terminal there is no
//! status line.

use std::io::{IsTerminal, Write};
use std::sync::{Arc, Mutex, PoisonError};

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
            write(&format!("{CLEAR_LINE}{line}\n{}", lines.status));
        } else {
            write(&format!("{line}\n"));
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
            write(&format!("{CLEAR_LINE}{status}"));
            lines.status = status;
        }
    }

    /// Leaves the last status line standing.
    pub fn end_status(&self) {
        let mut lines = self.lines();
        if !lines.status.is_empty() {
            write("\n");
            lines.status.clear();
        }
    }

    fn lines(&self) -> std::sync::MutexGuard<'_, Lines> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A terminal that is gone has nobody to be told.
fn write(text: &str) {
    let mut stderr = std::io::stderr().lock();
    let _ = stderr.write_all(text.as_bytes());
    let _ = stderr.flush();
}
