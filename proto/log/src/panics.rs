//! A panic's message, said without waiting, and its backtrace, which takes its time, said by another thread.
//!
//! The standard hook writes to standard error and waits for it, and finds the names of a backtrace before it lets the thread go: a tenth of a second
//! and more. A loop that panics would get to the code that switches the force off that much later, or never while the terminal stands.
//!
//! Taking down the return addresses is quick; reading the program's symbols is not, and the standard library does it when a
//! backtrace is printed. It holds a lock meanwhile that the next panic would wait for: so while one backtrace is read, others are not taken.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::panic::PanicHookInfo;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// Longest that the end of the process waits for a backtrace.
const LONGEST_WAIT: Duration = Duration::from_secs(1);
/// A backtrace, and the wish to be told that it was said.
const WAITING: usize = 2;

static READER: OnceLock<Reader> = OnceLock::new();

/// The thread that reads backtraces, as others see it.
struct Reader {
    jobs: SyncSender<Job>,
    /// A backtrace was taken and is not said yet.
    busy: Arc<AtomicBool>,
}

enum Job {
    /// Of the thread of this name.
    Say(String, Backtrace),
    Tell(SyncSender<()>),
}

/// From now on panics say their message by [`crate::say`], and a backtrace if `RUST_BACKTRACE` asks for one.
pub(crate) fn say_without_waiting() {
    // Started here and not at a panic: it would have the priority of the loop that panics.
    let (jobs, to_do) = sync_channel(WAITING);
    let busy = Arc::<AtomicBool>::default();
    let reader = Reader {
        jobs,
        busy: busy.clone(),
    };
    let started = std::thread::Builder::new()
        .name("backtraces".to_owned())
        .spawn(move || read(&to_do, &busy));
    if started.is_ok() {
        // Set once: the log starts once.
        let _ = READER.set(reader);
    }
    std::panic::set_hook(Box::new(|panic| {
        let thread = std::thread::current();
        let name = thread.name().unwrap_or("without a name");
        crate::say(&sentence(name, panic));
        if let Some(reader) = READER.get() {
            reader.hand_over(name);
        }
    }));
}

/// At the end of the process: waits for a backtrace that is being read.
pub(crate) fn flush() {
    if let Some(reader) = READER.get().filter(|reader| reader.is_busy()) {
        let (when_done, done) = sync_channel(1);
        if reader.jobs.try_send(Job::Tell(when_done)).is_ok() {
            let _ = done.recv_timeout(LONGEST_WAIT);
        }
    }
}

impl Reader {
    fn is_busy(&self) -> bool {
        self.busy.load(Ordering::Acquire)
    }

    /// Takes the calling thread's backtrace, unless another one is being read.
    fn hand_over(&self, name: &str) {
        if self.busy.swap(true, Ordering::AcqRel) {
            return;
        }
        let trace = Backtrace::capture();
        let wanted = trace.status() == BacktraceStatus::Captured;
        let handed = wanted && {
            let job = Job::Say(name.to_owned(), trace);
            self.jobs.try_send(job).is_ok()
        };
        if !handed {
            self.busy.store(false, Ordering::Release);
        }
    }
}

fn read(jobs: &Receiver<Job>, busy: &AtomicBool) {
    for job in jobs {
        match job {
            Job::Say(name, trace) => {
                crate::say(&format!("backtrace of the thread {name}:\n{trace}"));
                busy.store(false, Ordering::Release);
            }
            Job::Tell(when_done) => {
                let _ = when_done.try_send(());
            }
        }
    }
}

fn sentence(name: &str, panic: &PanicHookInfo<'_>) -> String {
    let place = panic
        .location()
        .map_or_else(String::new, |at| format!(" at {at}"));
    let message = panic.payload_as_str().unwrap_or("no message");
    format!("the thread {name} panicked{place}: {message}")
}
