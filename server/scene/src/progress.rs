//! Long work on a mesh says on standard error what it does and how far it is.

use std::fmt;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Work that takes longer is spoken of.
const SILENT_TIME: Duration = Duration::from_secs(1);
/// Time between two lines: a log keeps them all, and who waits looks again after a few seconds.
const PAUSE: Duration = Duration::from_secs(5);
/// A share below this one, %, or a time below a second says too little of the time that is left.
const LEAST_SHARE: usize = 5;
/// Work on fewer triangles takes no second, and no thread watches it.
const QUICK_TRIANGLES: usize = 10_000;

/// Work in progress; ends when dropped.
#[derive(Debug)]
pub(crate) struct Progress {
    share: Arc<Share>,
    /// Dropped to end the watcher.
    end: Option<Sender<()>>,
    watcher: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Share {
    done: AtomicUsize,
    total: AtomicUsize,
    /// Which attempt it is, and of how many at most; 0 of work that is done once.
    attempt: AtomicUsize,
    attempts: AtomicUsize,
}

impl Progress {
    /// Begins work of this name on so many triangles.
    pub(crate) fn on_triangles(triangles: usize, what: impl fmt::Display) -> Self {
        if triangles < QUICK_TRIANGLES {
            return Self {
                share: Arc::default(),
                end: None,
                watcher: None,
            };
        }
        Self::of(what)
    }

    /// Begins work of this name that may be long.
    pub(crate) fn of(what: impl fmt::Display) -> Self {
        Self::watched(what.to_string(), SILENT_TIME, |line| {
            // Who does not listen misses nothing that he needs.
            let _ = writeln!(std::io::stderr(), "{line}");
        })
    }

    fn watched(what: String, silent: Duration, say: impl Fn(&str) + Send + 'static) -> Self {
        let share: Arc<Share> = Arc::default();
        let (end, ended) = channel();
        let watched = Arc::clone(&share);
        let begun = Instant::now();
        let watch = move || {
            let mut pause = silent;
            while ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                say(&line(&what, begun.elapsed(), &watched));
                pause = PAUSE;
            }
        };
        // Without a thread the work goes on in silence.
        let watcher = std::thread::Builder::new()
            .name("progress".into())
            .spawn(watch)
            .ok();
        Self {
            share,
            end: Some(end),
            watcher,
        }
    }

    /// The work begins anew, for the `attempt`th time of `attempts` at most: shares are of this attempt, and the time that is left is not known.
    pub(crate) fn attempt(&self, attempt: usize, attempts: usize) {
        self.show(0, 0);
        self.share.attempt.store(attempt, Ordering::Relaxed);
        self.share.attempts.store(attempts, Ordering::Relaxed);
    }

    /// Says how far the work is.
    pub(crate) fn show(&self, done: usize, total: usize) {
        self.share.done.store(done, Ordering::Relaxed);
        self.share.total.store(total, Ordering::Relaxed);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(watcher) = self.watcher.take() {
            let _ = watcher.join(); // it has nothing to tell but lines
        }
    }
}

fn line(what: &str, elapsed: Duration, share: &Share) -> String {
    let seconds = elapsed.as_secs();
    let read = |number: &AtomicUsize| number.load(Ordering::Relaxed);
    let (done, total) = (read(&share.done), read(&share.total));
    let percent = (100 * done).checked_div(total).map(|share| share.min(100));
    let attempt = match (read(&share.attempt), read(&share.attempts)) {
        (_, 0) => String::new(),
        (attempt, attempts) => format!("attempt {attempt} of at most {attempts}, "),
    };
    match percent {
        Some(percent) if !attempt.is_empty() => {
            format!("{what}: {attempt}{percent} % of it, after {seconds} s")
        }
        Some(percent @ LEAST_SHARE..) if seconds > 0 => {
            let left = elapsed.as_secs_f64() * (100 - percent) as f64 / percent as f64;
            format!("{what}: {percent} % after {seconds} s, about {left:.0} s left")
        }
        Some(percent) => format!("{what}: {percent} % after {seconds} s"),
        None => format!("{what}: {attempt}{seconds} s so far"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::Receiver;

    fn watched() -> (Progress, Receiver<String>) {
        let (to, lines) = channel();
        let say = move |line: &str| drop(to.send(line.to_owned()));
        let progress = Progress::watched("a: measuring".into(), Duration::from_millis(1), say);
        (progress, lines)
    }

    fn at(seconds: u64, done: usize, total: usize, attempts: usize) -> String {
        let share = Share::default();
        share.done.store(done, Ordering::Relaxed);
        share.total.store(total, Ordering::Relaxed);
        share.attempt.store(attempts.min(2), Ordering::Relaxed);
        share.attempts.store(attempts, Ordering::Relaxed);
        line("a", Duration::from_secs(seconds), &share)
    }

    #[test]
    fn the_time_left_is_said_where_it_is_known() {
        assert_eq!(at(6, 30, 120, 0), "a: 25 % after 6 s, about 18 s left");
        assert_eq!(at(6, 1, 120, 0), "a: 0 % after 6 s");
        assert_eq!(at(6, 0, 0, 0), "a: 6 s so far");
        assert_eq!(
            at(6, 30, 120, 8),
            "a: attempt 2 of at most 8, 25 % of it, after 6 s"
        );
        assert_eq!(at(6, 0, 0, 8), "a: attempt 2 of at most 8, 6 s so far");
    }

    #[test]
    fn long_work_says_what_it_does() {
        let (_progress, lines) = watched();
        let first = lines.recv().unwrap();
        assert!(
            first.starts_with("a: measuring: ") && first.ends_with(" s so far"),
            "{first}"
        );
    }

    #[test]
    fn nothing_is_said_after_the_end() {
        let (progress, lines) = watched();
        drop(progress);
        // The watcher is gone, so the channel ends after what it had said before.
        assert!(lines.iter().count() < 1000);
    }

    #[test]
    fn quick_work_has_no_watcher() {
        assert!(Progress::on_triangles(12, "a").watcher.is_none());
    }
}
