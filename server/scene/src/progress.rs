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
/// Longest time between two lines; before, each takes twice as long as the one before.
const LONGEST_PAUSE: Duration = Duration::from_secs(30);
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
                pause = (2 * pause).min(LONGEST_PAUSE);
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
    let (done, total) = (
        share.done.load(Ordering::Relaxed),
        share.total.load(Ordering::Relaxed),
    );
    match (100 * done).checked_div(total) {
        Some(percent) => format!("{what}: {} % after {seconds} s", percent.min(100)),
        None => format!("{what}: {seconds} s so far"),
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

    #[test]
    fn long_work_says_what_it_does_and_how_far_it_is() {
        let (progress, lines) = watched();
        let first = lines.recv().unwrap();
        assert!(
            first.starts_with("a: measuring: ") && first.ends_with(" s so far"),
            "{first}"
        );
        progress.show(30, 120);
        let with_share = lines.iter().find(|line| line.contains('%')).unwrap();
        assert!(
            with_share.starts_with("a: measuring: 25 % after "),
            "{with_share}"
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
