//! Lines of text for the observer: what happened, when.

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
