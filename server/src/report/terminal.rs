//! What a person at the terminal sees: lines of text, and below them one live status line.
//!
//! Everything goes to standard error, through the one writer that never waits (`taut_log`); standard output is for reports. Where
//! standard error is no terminal there is no status line.

use std::sync::{Arc, Mutex, PoisonError};

/// Standard error, shared by the threads that write lines. Not for loops.
#[derive(Clone, Debug, Default)]
pub struct Terminal {
    said_once: Arc<Mutex<Vec<String>>>,
}

impl Terminal {
    /// Standard error as it is.
    pub fn standard_error() -> Self {
        Self::default()
    }

    /// Writes a line above the status line.
    pub fn say(&self, line: &str) {
        taut_log::say(line);
    }

    /// Writes a line unless the same one was written by this before: several processes have the same to say.
    pub fn say_once(&self, line: &str) {
        let mut said = self
            .said_once
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if !said.iter().any(|said| said == line) {
            said.push(line.to_owned());
            self.say(line);
        }
    }

    /// Replaces the status line.
    pub fn status(&self, status: String) {
        taut_log::status(status);
    }

    /// Leaves the last status line standing.
    pub fn end_status(&self) {
        taut_log::end_status();
    }
}
