//! Lines for people, written by a thread of their own: a terminal that takes nothing costs lines, never time.
//!
//! Output that is stopped (Ctrl-S), a remote shell that hangs or a journal that is full makes a write to standard error wait, for as long as
//! it lasts. No thread with another duty may do that: it hands its text over here. What finds no place in the queue is lost and counted, and the
//! count is told as soon as the terminal takes lines again.
//!
//! [`take_panics`] lets the words of a panic go the same way: the system's own hook would wait before anything is unwound.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::io::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// Texts that may wait: more than a start or an end says.
const QUEUE: usize = 256;
/// Longest text, bytes; a longer one is cut.
const MAX_TEXT: usize = 16 * 1024;
/// How long a report may take to be written: a terminal that is stopped shall not keep a process that is told to end.
const REPORT_TIME: Duration = Duration::from_secs(5);
/// The same for the last lines on standard error.
const LAST_LINES: Duration = Duration::from_millis(500);

/// Hands texts to a thread that writes them. Clones share the queue.
#[derive(Clone, Debug)]
pub struct LineWriter {
    queue: SyncSender<Item>,
    lost: Arc<AtomicU64>,
}

#[derive(Debug)]
enum Item {
    Text(String),
    /// Finding the names in it takes a while.
    Trace(Box<Backtrace>),
    /// Answered once everything before it is written.
    Reached(SyncSender<()>),
}

impl LineWriter {
    /// Writes to `out` from a new thread, which ends once every handle is gone.
    ///
    /// # Errors
    /// The system starts no thread.
    pub fn new(out: impl Write + Send + 'static) -> std::io::Result<Self> {
        let (queue, items) = sync_channel(QUEUE);
        let lost = Arc::<AtomicU64>::default();
        let of_thread = Arc::clone(&lost);
        std::thread::Builder::new()
            .name("lines".to_owned())
            .spawn(move || write_all(&items, out, &of_thread))?;
        Ok(Self { queue, lost })
    }

    /// Writes a line. Never waits; allocates.
    pub fn say(&self, line: impl Into<String>) {
        let mut text = line.into();
        cut(&mut text);
        text.push('\n');
        self.put(text);
    }

    /// Writes text as it is. Never waits; allocates.
    pub fn put(&self, text: impl Into<String>) {
        let mut text = text.into();
        cut(&mut text);
        self.hand_over(Item::Text(text));
    }

    fn hand_over(&self, item: Item) {
        match self.queue.try_send(item) {
            Ok(()) => {}
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.lost.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    /// Texts that were lost and not yet told of.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Waits until everything that was handed over is written, at most `time`; whether it is.
    pub fn flush(&self, time: Duration) -> bool {
        let (reached, answer) = sync_channel(1);
        // A queue that is full is that of a terminal which takes nothing.
        self.queue.try_send(Item::Reached(reached)).is_ok() && answer.recv_timeout(time).is_ok()
    }
}

fn cut(text: &mut String) {
    if text.len() > MAX_TEXT {
        let end = (0..=MAX_TEXT).rev().find(|at| text.is_char_boundary(*at));
        text.truncate(end.unwrap_or(0));
    }
}

/// The thread's work. A terminal that is gone has nobody to be told.
fn write_all(items: &Receiver<Item>, mut out: impl Write, lost: &AtomicU64) {
    for item in items {
        match item {
            Item::Trace(trace) => {
                let _ = writeln!(out, "{trace}");
            }
            Item::Text(text) => {
                let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
                let lost = lost.swap(0, Ordering::Relaxed);
                if lost > 0 {
                    let _ = writeln!(out, "({lost} lines were lost: nothing took them)");
                }
            }
            Item::Reached(answer) => {
                let _ = answer.send(()); // nobody waits any more: fine
            }
        }
    }
}

/// Standard error of this process. `None` where no thread could be started for it: then there are no lines.
fn standard_error() -> Option<&'static LineWriter> {
    static WRITER: OnceLock<Option<LineWriter>> = OnceLock::new();
    WRITER
        .get_or_init(|| LineWriter::new(std::io::stderr()).ok())
        .as_ref()
}

/// Writes a line to standard error. Never waits.
pub fn say(line: impl Into<String>) {
    if let Some(writer) = standard_error() {
        writer.say(line);
    }
}

/// Writes text to standard error as it is: for a status line. Never waits.
pub fn put(text: impl Into<String>) {
    if let Some(writer) = standard_error() {
        writer.put(text);
    }
}

/// Standard error as a writer for logs: [`put`] takes what is written. Never waits, never fails.
#[derive(Clone, Copy, Debug)]
pub struct Lines;

impl Write for Lines {
    fn write(&mut self, text: &[u8]) -> std::io::Result<usize> {
        put(String::from_utf8_lossy(text));
        Ok(text.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Gives the last lines on standard error a moment: before the process returns from `main`.
pub fn finish() {
    if let Some(writer) = standard_error() {
        writer.flush(LAST_LINES);
    }
}

/// Writes a report to standard output, and waits for that at most a few seconds; whether it was written. For the end of a process, when
/// there is no force any more.
pub fn report(text: impl Into<String>) -> bool {
    let mut text = text.into();
    let (done, answer) = sync_channel(1);
    let thread = std::thread::Builder::new().name("report".to_owned());
    let started = thread.spawn(move || {
        if !text.ends_with('\n') {
            text.push('\n');
        }
        let mut out = std::io::stdout().lock();
        let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
        let _ = done.send(written.is_ok()); // who waited has given up
    });
    started.is_ok() && answer.recv_timeout(REPORT_TIME).unwrap_or(false)
}

/// Lets what a panic says go to standard error by [`say`]: a loop that breaks down must not wait for a terminal before it takes the force
/// away. For `main`.
pub fn take_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let thread = std::thread::current();
        let name = thread.name().unwrap_or("without a name");
        say(format!("thread '{name}' broke down: {panic}"));
        let trace = Backtrace::capture();
        if trace.status() == BacktraceStatus::Captured
            && let Some(writer) = standard_error()
        {
            writer.hand_over(Item::Trace(Box::new(trace)));
        }
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;
    use std::sync::mpsc::channel;

    /// A terminal that takes nothing until it is told to.
    #[derive(Clone)]
    struct Stopped {
        go: Arc<Mutex<std::sync::mpsc::Receiver<()>>>,
        written: Arc<Mutex<Vec<u8>>>,
    }

    impl Write for Stopped {
        fn write(&mut self, text: &[u8]) -> std::io::Result<usize> {
            let go = self.go.lock().expect("no test panics here");
            // Fails once the test lets go: then everything is taken.
            let _ = go.recv();
            let mut written = self.written.lock().expect("no test panics here");
            written.extend_from_slice(text);
            Ok(text.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_terminal_that_is_stopped_costs_lines_and_they_are_counted() {
        let (go, waits) = channel();
        let out = Stopped {
            go: Arc::new(Mutex::new(waits)),
            written: Arc::default(),
        };
        let written = Arc::clone(&out.written);
        let writer = LineWriter::new(out).expect("a thread");
        for line in 0..QUEUE + 100 {
            writer.say(format!("line {line}"));
        }
        assert!(!writer.flush(Duration::ZERO));
        // One line may be at the terminal, the queue holds the first ones.
        let lost = writer.lost();
        assert!((99..=100).contains(&lost), "{lost}");
        drop(go);
        // A queue that has just been full may be so for a moment still.
        while !writer.flush(Duration::from_secs(60)) {
            std::thread::yield_now();
        }
        assert_eq!(writer.lost(), 0);
        let written = String::from_utf8(written.lock().expect("whole").clone());
        let written = written.expect("text");
        assert!(written.starts_with("line 0\n"), "{written}");
        assert!(written.contains(&format!("({lost} lines were lost")));
    }

    #[test]
    fn a_text_is_cut_at_a_letter() {
        let mut text = "ä".repeat(MAX_TEXT);
        text.insert(0, 'x');
        cut(&mut text);
        assert_eq!(text.len(), MAX_TEXT - 1);
    }
}
