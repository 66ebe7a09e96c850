//! What the threads of the server ask of the operating system, and what came of it.
//!
//! A request that is refused is written down; with [`RealtimePolicy::Enforce`] the server does not start without it.
//! Requests that other roles need too are in `taut_bridge::realtime`; here are the server's own.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use taut_bridge::realtime::{RealtimeGrant, request_fifo, sharpen_timers};

use crate::shared::lock::lock;

pub use os::{after_parent, die_with_parent, thread_cpu_time};

/// Ahead of all normal work, behind the real-time class.
const AHEAD_NICE: i32 = -10;
/// A little behind normal work: a third of its share where both want a core.
const BEHIND_NICE: i32 = 5;
/// Behind all normal work, before idle.
const BACKGROUND_NICE: i32 = 15;

/// How a refusal by the operating system is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RealtimePolicy {
    /// It stops the start.
    Enforce,
    /// It is reported, and the work goes on without.
    Waive,
}

/// How a thread wants to be scheduled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheduling {
    /// Real-time class, first in first out, with this priority; timers as sharp as they get either way.
    Fifo(u8),
    /// The normal class, ahead of everybody else in it, with sharp timers: for work that may take long. A thread of the real-time
    /// class that used up a core would be throttled, and the loops with it.
    Ahead,
    /// The normal class, a little behind everybody else: for what strangers can cause.
    Behind,
    /// The normal class, behind everybody else.
    Background,
}

/// What was enforced of the operating system, and what was not, and why.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RealtimeReport {
    /// In force.
    pub enforced: Vec<String>,
    /// Not in force, with the reason.
    pub waived: Vec<String>,
}

/// What was asked of the operating system so far, and the answers. Written at the start of each thread, never in a loop.
#[derive(Clone, Debug, Default)]
pub struct RealtimeLedger(Arc<Ledger>);

#[derive(Debug, Default)]
struct Ledger {
    pages: Mutex<Pages>,
    answered: Condvar,
}

#[derive(Debug, Default)]
struct Pages {
    report: RealtimeReport,
    /// Threads that have not asked for everything yet.
    asking: Vec<&'static str>,
}

impl RealtimeLedger {
    /// A thread of this `name` is going to ask: [`RealtimeLedger::answers`] waits for it.
    pub fn expect(&self, name: &'static str) {
        self.pages().asking.push(name);
    }

    /// The thread of this `name` has asked for all that it needs.
    pub fn has_asked(&self, name: &'static str) {
        let mut pages = self.pages();
        let place = pages.asking.iter().position(|asking| *asking == name);
        if let Some(place) = place {
            pages.asking.swap_remove(place);
        }
        self.0.answered.notify_all();
    }

    /// Everything noted, once every expected thread has asked.
    ///
    /// # Errors
    /// The name of one that has not within `limit`.
    pub fn answers(&self, limit: Duration) -> Result<RealtimeReport, &'static str> {
        let waited = (self.0.answered)
            .wait_timeout_while(self.pages(), limit, |pages| !pages.asking.is_empty());
        let (pages, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match pages.asking.first() {
            Some(name) => Err(name),
            None => Ok(sorted(&pages.report)),
        }
    }

    fn pages(&self) -> MutexGuard<'_, Pages> {
        lock(&self.0.pages)
    }

    /// Schedules the calling thread and notes the answer under the thread's `name`; false when it was refused.
    pub fn schedule(&self, name: &str, scheduling: Scheduling) -> bool {
        match scheduling {
            Scheduling::Fifo(priority) => {
                let granted = self.note(name, request_fifo(priority));
                if !granted {
                    // Without the real-time class the sharpness of timers matters; with it, it is given.
                    self.note(name, sharpen_timers());
                }
                granted
            }
            Scheduling::Ahead => {
                self.note(name, sharpen_timers());
                self.note(name, request_nice(AHEAD_NICE))
            }
            Scheduling::Behind => request_nice(BEHIND_NICE).is_granted(),
            Scheduling::Background => request_nice(BACKGROUND_NICE).is_granted(),
        }
    }

    /// Writes an answer down; whether it was granted.
    pub fn note(&self, name: &str, grant: RealtimeGrant) -> bool {
        let report = &mut self.pages().report;
        match grant {
            RealtimeGrant::Granted { what } => {
                note_once(&mut report.enforced, format!("{name}: {what}"));
                true
            }
            RealtimeGrant::Waived { what, why } => {
                note_once(&mut report.waived, format!("{name}: {what}: {why}"));
                false
            }
        }
    }

    /// Everything noted so far, in the order of names.
    pub fn report(&self) -> RealtimeReport {
        sorted(&self.pages().report)
    }
}

fn sorted(report: &RealtimeReport) -> RealtimeReport {
    let mut report = report.clone();
    report.enforced.sort();
    report.waived.sort();
    report
}

/// Asks for this nice value for the calling thread.
fn request_nice(value: i32) -> RealtimeGrant {
    let what = format!("nice {value}");
    if os::set_nice(value) {
        RealtimeGrant::Granted { what }
    } else {
        let why = "this user may not; run as root, or grant it: LimitNICE=-10 in the service unit"
            .to_owned();
        RealtimeGrant::Waived { what, why }
    }
}

/// Threads of one name have one answer.
fn note_once(lines: &mut Vec<String>, line: String) {
    if !lines.contains(&line) {
        lines.push(line);
    }
}

#[cfg(target_os = "linux")]
#[allow(
    unsafe_code,
    reason = "thread clock, nice value and parent-death signal are system calls"
)]
mod os {
    use std::os::unix::process::CommandExt;
    use std::time::Duration;

    /// Behind this process's normal threads, before background work.
    const CHILD_NICE: libc::c_int = 5;

    /// CPU time that the calling thread has used: what its work costs, whoever else is running.
    #[inline]
    pub fn thread_cpu_time() -> Duration {
        let mut time = libc::timespec {
            tv_sec: 0,
            tv_nsec: 0,
        };
        // SAFETY: `time` is a valid timespec for the kernel to fill; the calling thread's clock always exists.
        unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
        Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
    }

    pub(super) fn set_nice(value: i32) -> bool {
        // SAFETY: takes integers only; 0 names the calling thread (on Linux the nice value is the thread's).
        unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, value) == 0 }
    }

    /// Lets a child process work after this process's normal threads where both want a core.
    pub fn after_parent(command: &mut std::process::Command) {
        // SAFETY: between fork and exec only one system call is made, which is safe there; nothing is allocated or locked.
        unsafe {
            command.pre_exec(|| {
                // A refusal costs smoothness only.
                libc::setpriority(libc::PRIO_PROCESS, 0, CHILD_NICE);
                Ok(())
            });
        }
    }

    /// Ties a child process to the calling thread: the system kills it when that ends, however it ends.
    pub fn die_with_parent(command: &mut std::process::Command) {
        let parent = std::process::id();
        // SAFETY: between fork and exec only system calls are made that are safe there; nothing is allocated or locked.
        unsafe {
            command.pre_exec(move || {
                libc::prctl(
                    libc::PR_SET_PDEATHSIG,
                    libc::SIGKILL as libc::c_ulong,
                    0,
                    0,
                    0,
                );
                // The parent may have died before the request.
                if libc::getppid() as u32 == parent {
                    Ok(())
                } else {
                    Err(std::io::Error::from_raw_os_error(libc::ESRCH))
                }
            });
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod os {
    use std::sync::OnceLock;
    use std::time::{Duration, Instant};

    static START: OnceLock<Instant> = OnceLock::new();

    pub fn thread_cpu_time() -> Duration {
        START.get_or_init(Instant::now).elapsed()
    }

    pub(super) fn set_nice(_value: i32) -> bool {
        false
    }

    pub fn die_with_parent(_command: &mut std::process::Command) {}

    pub fn after_parent(_command: &mut std::process::Command) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_takes_thread_time_and_sleep_does_not() {
        let before = thread_cpu_time();
        std::thread::sleep(Duration::from_millis(20));
        let slept = thread_cpu_time() - before;
        assert!(slept < Duration::from_millis(15), "{slept:?}");
        let begun = thread_cpu_time();
        let mut sum = 0u64;
        for _ in 0..1_000_000 {
            sum = std::hint::black_box(sum + 1);
        }
        assert!(thread_cpu_time() > begun, "{sum}");
    }

    #[test]
    fn what_is_refused_is_written_down_with_its_reason() {
        let ledger = RealtimeLedger::default();
        // Above the largest priority: refused to everybody.
        assert!(!ledger.schedule("haptics", Scheduling::Fifo(200)));
        let report = ledger.report();
        assert!(
            report
                .waived
                .iter()
                .any(|line| line.contains("haptics: SCHED_FIFO priority 200"))
        );
    }

    #[test]
    fn the_answers_are_waited_for_however_late_a_thread_asks() {
        let ledger = RealtimeLedger::default();
        for name in ["haptics", "coupling"] {
            ledger.expect(name);
        }
        ledger.has_asked("coupling");
        assert_eq!(ledger.answers(Duration::ZERO), Err("haptics"));
        let late = ledger.clone();
        let thread = std::thread::Builder::new().spawn(move || {
            std::thread::sleep(Duration::from_millis(50));
            late.schedule("haptics", Scheduling::Fifo(200));
            late.has_asked("haptics");
        });
        let report = ledger.answers(Duration::from_secs(60)).expect("it asks");
        assert!(report.waived.iter().any(|line| line.starts_with("haptics")));
        assert!(thread.expect("a thread").join().is_ok());
    }
}
