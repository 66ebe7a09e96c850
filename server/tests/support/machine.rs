//! What the machine did to this process's threads while a test ran: the system counts how long each has waited for a core.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Waits of different threads delay a datagram together if they fall within this time of each other.
const WINDOW: Duration = Duration::from_millis(120);

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

    /// The most that threads of this process waited for a core, all together, within a tenth of a second; that a sleeping one woke late counts,
    /// too: a machine that stands still counts no waits.
    pub(crate) fn longest_wait(self) -> Duration {
        self.over.store(true, Ordering::Relaxed);
        self.thread.join().expect("no panic")
    }
}

fn longest(over: &AtomicBool) -> Duration {
    let mut of_threads = waits();
    let mut recent: VecDeque<(Instant, Duration)> = VecDeque::new();
    let mut longest = Duration::ZERO;
    while !over.load(Ordering::Relaxed) {
        let before = Instant::now();
        std::thread::sleep(Duration::from_millis(5));
        let late = before.elapsed().saturating_sub(Duration::from_millis(5));
        let now = waits();
        let waited: u64 = now
            .iter()
            .map(|(thread, ns)| ns - of_threads.get(thread).unwrap_or(&0).min(ns))
            .sum();
        of_threads = now;
        recent.push_back((Instant::now(), late.max(Duration::from_nanos(waited))));
        while recent.front().is_some_and(|(at, _)| at.elapsed() > WINDOW) {
            recent.pop_front();
        }
        longest = longest.max(recent.iter().map(|(_, waited)| *waited).sum());
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
