//! What is logged, and in which form.

use std::io::IsTerminal;
use std::sync::OnceLock;

use tracing_subscriber::filter::EnvFilter;
use tracing_subscriber::fmt::time::{FormatTime, SystemTime};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::reload;
use tracing_subscriber::util::SubscriberInitExt;

/// Target of the audit trail.
pub const AUDIT_TARGET: &str = "taut::audit";
/// Variable that says what is logged, in the form of tracing's `EnvFilter`; before it, `RUST_LOG` does. It overrides every other choice.
pub const VARIABLE: &str = "TAUT_LOG";

/// Changes the filter of the running program; unset where a variable decides.
type Change = Box<dyn Fn(&str) + Send + Sync>;
static CHANGE: OnceLock<Change> = OnceLock::new();

/// Sets up the log of this process: to standard error by [`crate::terminal`], what `directives` or a variable says. Once per process; a
/// second time nothing happens.
pub fn start(directives: &str) {
    let asked = [VARIABLE, EnvFilter::DEFAULT_ENV]
        .iter()
        .find_map(|variable| EnvFilter::try_from_env(variable).ok());
    let decided = asked.is_some();
    let (filter, handle) = reload::Layer::new(asked.unwrap_or_else(|| EnvFilter::new(directives)));
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(crate::terminal())
        .with_ansi(std::io::stderr().is_terminal())
        .with_timer(Stamp::here());
    let begun = tracing_subscriber::registry()
        .with(filter)
        .with(lines)
        .try_init();
    if begun.is_err() {
        return;
    }
    crate::panics::say_without_waiting();
    if !decided {
        // Fails only where the subscriber is gone.
        let change = move |directives: &str| drop(handle.reload(EnvFilter::new(directives)));
        let _ = CHANGE.set(Box::new(change));
    }
}

/// Logs what these directives say from now on, unless a variable says otherwise.
pub fn use_directives(directives: &str) {
    if let Some(change) = CHANGE.get() {
        change(directives);
    }
}

/// The time of a line: the journal has its own.
enum Stamp {
    Journal,
    Utc(SystemTime),
}

impl Stamp {
    /// `JOURNAL_STREAM` is what systemd sets where standard error goes to the journal.
    fn here() -> Self {
        match std::env::var_os("JOURNAL_STREAM") {
            Some(_) => Self::Journal,
            None => Self::Utc(SystemTime),
        }
    }
}

impl FormatTime for Stamp {
    fn format_time(&self, w: &mut tracing_subscriber::fmt::format::Writer<'_>) -> std::fmt::Result {
        match self {
            Self::Journal => Ok(()),
            Self::Utc(clock) => clock.format_time(w),
        }
    }
}
