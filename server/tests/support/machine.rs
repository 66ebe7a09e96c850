//! What the machine did to this process's threads while a test ran: the system counts how long each has waited for a core.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const PERIOD: Duration = Duration::from_millis(5);

/// Looks until it is asked.
pub(crate) struct MachineWatch {
    thread: JoinHandle<Duration>,
    over: Arc<AtomicBool>,
}

impl MachineWatch {
    pub(crate) fn start() -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let until = over.clone();
        let thread = std::thread::Builder::new()
            .name("watch".to_owned())
            .spawn(move || longest(&until))
            .expect("a thread");
        Self { thread, over }
    }

    /// The most that a thread of this process waited for a core from one look to the next; that this one woke late counts, too: a machine that stands still
    /// counts no waits.
    pub(crate) fn longest_wait(self) -> Duration {
        self.over.store(true, Ordering::Relaxed);
        self.thread.join().expect("no panic")
    }
}

fn longest(over: &AtomicBool) -> Duration {
    let mut before = waits();
    let mut longest = Duration::ZERO;
    while !over.load(Ordering::Relaxed) {
        let asleep = Instant::now();
        std::thread::sleep(PERIOD);
        let late = asleep.elapsed().saturating_sub(PERIOD);
        let now = waits();
        let since = |(thread, ns): (&String, &u64)| ns - before.get(thread).unwrap_or(&0).min(ns);
        let waited = now.iter().map(since).max().unwrap_or(0);
        longest = longest.max(late).max(Duration::from_nanos(waited));
        before = now;
    }
    longest
}

/// For how long each thread of this process has waited for a core since it began, ns: `/proc/[pid]/task/[tid]/schedstat` (proc(5)). Empty where the system
/// does not count.
fn waits() -> HashMap<String, u64> {
    let Ok(threads) = std::fs::read_dir("/proc/self/task") else {
        return HashMap::new();
    };
    let wait = |thread: std::fs::DirEntry| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        let waited = text.split_whitespace().nth(1)?.parse().ok()?;
        Some((thread.file_name().into_string().ok()?, waited))
    };
    threads.flatten().filter_map(wait).collect()
}
