//! The system's wish that this process ends: flags that signals set, and nothing else.
//!
//! | signal | comes from |
//! |--------|------------|
//! | SIGINT, SIGQUIT | Ctrl-C, Ctrl-\ |
//! | SIGTERM | the service manager, `kill` |
//! | SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM, SIGPROF, SIGIO, SIGXCPU, SIGSYS | anybody; each would end the process at once |
//! | SIGHUP | a terminal or a remote shell that is gone; not where it was ignored at the start (`nohup`) |
//!
//! A flag is set in the signal's handler itself: no thread, queue or terminal is on the way from the system to the loop that holds a force, which
//! looks at the flag in every tick. SIGPIPE is ignored by Rust's runtime: a reader that is gone is an error of a write; and SIGXFSZ here: a file that
//! may not grow is one, too. What ends a process without
//! a word (SIGKILL, a crash, the power) is left to the watchdog of the device: `docs/safety.md`.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::flag;

/// Sends SIGINT to a child that was not waited for yet.
#[cfg(unix)]
#[allow(unsafe_code, reason = "a system call")]
pub fn interrupt(child: &std::process::Child) {
    let Ok(process) = libc::pid_t::try_from(child.id()) else {
        return; // no process has such a number
    };
    // SAFETY: takes two integers. The number is the child's for as long as nobody waited for it, which takes its only handle.
    unsafe { libc::kill(process, libc::SIGINT) };
}

/// Set once the end is asked for. Clones look at the same flags.
#[derive(Clone, Debug, Default)]
pub struct EndFlag {
    asked: Arc<AtomicBool>,
    /// There is no force any more: another signal may end the process at once.
    may_be_killed: Arc<AtomicBool>,
}

impl EndFlag {
    /// Without a signal: `asked` belongs to the caller.
    #[must_use]
    pub fn of(asked: Arc<AtomicBool>) -> Self {
        Self {
            asked,
            ..Self::default()
        }
    }

    /// Listens from now on.
    ///
    /// # Errors
    /// The system takes no handler.
    pub fn listen() -> io::Result<Self> {
        Self::listen_into(Arc::default())
    }

    /// The same with a flag that the caller has, too.
    ///
    /// # Errors
    /// The system takes no handler.
    pub fn listen_into(asked: Arc<AtomicBool>) -> io::Result<Self> {
        let flag = Self::of(asked);
        // A handler that does nothing, so that the write fails instead.
        #[cfg(unix)]
        flag::register(signal_hook::consts::SIGXFSZ, Arc::default())?;
        for signal in signals() {
            // In this order: the first signal asks, and one that comes when there is no force does what it does by itself.
            flag::register_conditional_default(signal, Arc::clone(&flag.may_be_killed))?;
            flag::register(signal, Arc::clone(&flag.asked))?;
        }
        Ok(flag)
    }

    /// Asks for the end, as a signal does.
    pub fn ask(&self) {
        self.asked.store(true, Ordering::Relaxed);
    }

    /// Whether the end was asked for. Wait-free.
    #[inline]
    #[must_use]
    pub fn is_asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// From now on a signal ends the process at once: for when there is no force any more, and a report may wait for a terminal.
    pub fn let_signals_kill(&self) {
        self.may_be_killed.store(true, Ordering::Relaxed);
    }
}

/// Those that ask for an end here.
fn signals() -> Vec<i32> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let mut signals = vec![SIGINT, SIGTERM];
    #[cfg(unix)]
    {
        use signal_hook::consts::{
            SIGALRM, SIGHUP, SIGIO, SIGPROF, SIGQUIT, SIGSYS, SIGUSR1, SIGUSR2, SIGVTALRM, SIGXCPU,
        };
        signals.extend([SIGQUIT, SIGUSR1, SIGUSR2, SIGALRM]);
        signals.extend([SIGVTALRM, SIGPROF, SIGIO, SIGXCPU, SIGSYS]);
        if !is_ignored(SIGHUP) {
            signals.push(SIGHUP);
        }
    }
    signals
}

/// Whether whoever started this process had the signal ignored. On Linux; elsewhere none is.
#[cfg(unix)]
#[must_use]
pub fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use signal_hook::consts::{SIGPIPE, SIGTERM, SIGXFSZ};

    #[test]
    fn each_signal_that_asks_for_the_end_sets_the_flag() {
        // This process ignores SIGPIPE, as every Rust program.
        assert!(is_ignored(SIGPIPE) && !is_ignored(SIGTERM));
        for signal in signals() {
            let flag = EndFlag::listen().expect("handlers");
            assert!(!flag.is_asked());
            signal_hook::low_level::raise(signal).expect("raised");
            assert!(flag.is_asked(), "signal {signal}");
        }
        let flag = EndFlag::listen().expect("handlers");
        signal_hook::low_level::raise(SIGXFSZ).expect("raised");
        assert!(!flag.is_asked(), "a file that may not grow ends nothing");
    }
}
