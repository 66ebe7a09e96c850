//! Lines of text for the observer: what happened, when.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};

/// How serious a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogLevel {
    /// Something happened.
    Info,
    /// Something that should not happen often.
    Warn,
    /// Something is broken.
    Error,
}

/// What other threads tell the monitoring thread outside the sample queue.
pub(crate) enum Command {
    /// Show this line at the newest session time.
    Line(LogLevel, String),
    /// Show what is queued, finish the recording, end.
    Stop,
}

/// Most lines that wait to be shown; beyond it they are dropped and counted.
pub(crate) const LINE_QUEUE_CAPACITY: usize = 1024;

/// Logs from any thread but the loops; never waits. Clone it freely.
#[derive(Clone, Debug)]
pub struct MonitorLog {
    pub(crate) commands: SyncSender<Command>,
    pub(crate) dropped: Arc<AtomicU64>,
}

impl MonitorLog {
    /// Shows a line at the newest session time; drops and counts it when too many wait.
    pub fn log(&self, level: LogLevel, text: impl Into<String>) {
        match self.commands.try_send(Command::Line(level, text.into())) {
            // Disconnected: the monitor was stopped, nobody looks any more.
            Ok(()) | Err(TrySendError::Disconnected(_)) => {}
            Err(TrySendError::Full(_)) => {
                self.dropped.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}
