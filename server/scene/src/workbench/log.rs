//! How much is logged.

use crate::document::Section;

/// How much of something is logged: everything from this weight up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogLevel {
    /// Nothing.
    Off,
    /// What does not work.
    Error,
    /// What works, but not as it should.
    Warn,
    /// What is good to know.
    Info,
    /// What helps to find a fault.
    Debug,
    /// Everything.
    Trace,
}

/// What the server's log holds, where no variable (`TAUT_LOG`) says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Log {
    /// Of the program.
    pub level: LogLevel,
    /// Of the audit trail, whose lines are `info`.
    pub audit: LogLevel,
}

impl Default for Log {
    fn default() -> Self {
        Self {
            level: LogLevel::Warn,
            audit: LogLevel::Info,
        }
    }
}

const NAMES: [(&str, LogLevel); 6] = [
    ("off", LogLevel::Off),
    ("error", LogLevel::Error),
    ("warn", LogLevel::Warn),
    ("info", LogLevel::Info),
    ("debug", LogLevel::Debug),
    ("trace", LogLevel::Trace),
];

pub(super) fn log(section: &Section<'_>) -> Log {
    let mut log = Log::default();
    log.level = section.choice("level", &NAMES).unwrap_or(log.level);
    log.audit = section.choice("audit", &NAMES).unwrap_or(log.audit);
    log
}
