//! The one thread that writes to standard error.

use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::os::fd::AsFd;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use tracing_appender::non_blocking::{ErrorCounter, NonBlocking, NonBlockingBuilder, WorkerGuard};

/// Lines that wait for a terminal or a journal that is slow; further ones are lost.
pub const MAX_WAITING: usize = 4096;

/// Whoever has not taken a line for so long takes none.
const STANDS_FROM: Duration = Duration::from_millis(500);

/// Return to the first column and clear the line.
const CLEAR_LINE: &[u8] = b"\r\x1b[2K";
/// The piece that asks for nothing but the status line.
const REFRESH: &[u8] = b"\r";

/// The process's writer, once it was asked for.
static TERMINAL: OnceLock<Writer> = OnceLock::new();

/// Lines that go to `to` by a thread of their own.
#[derive(Debug)]
pub(crate) struct Writer {
    lines: NonBlocking,
    lost: ErrorCounter,
    guard: Mutex<Option<WorkerGuard>>,
    /// The write that the thread is within.
    busy: Arc<Mutex<Option<Busy>>>,
    status: Arc<Mutex<Status>>,
}

/// A write that has begun.
#[derive(Clone, Copy, Debug)]
struct Busy {
    since: Instant,
    /// Lines that were lost before it.
    lost: u64,
}

/// One line that is written again below every other.
#[derive(Debug, Default)]
struct Status {
    text: String,
    /// A refresh waits for the thread: no further one is needed.
    asked: bool,
}

impl Writer {
    /// To `to`, with at most `waiting` lines between.
    pub(crate) fn new(to: impl Write + Send + 'static, waiting: usize) -> Self {
        let lost = Arc::<OnceLock<ErrorCounter>>::default();
        let busy = Arc::<Mutex<Option<Busy>>>::default();
        let status = Arc::<Mutex<Status>>::default();
        let telling = Telling {
            to,
            busy: busy.clone(),
            lost: lost.clone(),
            status: status.clone(),
            reported: 0,
        };
        let (lines, guard) = NonBlockingBuilder::default()
            .lossy(true)
            .buffered_lines_limit(waiting)
            .thread_name("lines")
            .finish(telling);
        let counter = lines.error_counter();
        // Set here alone.
        let _ = lost.set(counter.clone());
        Self {
            lines,
            lost: counter,
            guard: Mutex::new(Some(guard)),
            busy,
            status,
        }
    }

    /// Replaces the status line.
    pub(crate) fn status(&self, text: String) {
        let mut status = lock(&self.status);
        status.text = text;
        if !std::mem::replace(&mut status.asked, true) {
            let _ = self.lines().write(REFRESH);
        }
    }

    /// Leaves the last status line standing.
    pub(crate) fn end_status(&self) {
        let mut status = lock(&self.status);
        if !std::mem::take(&mut status.text).is_empty() {
            let _ = self.lines().write(b"\n");
        }
    }

    /// Lines that were lost.
    pub(crate) fn lost(&self) -> u64 {
        self.lost.dropped_lines() as u64
    }

    /// A handle for writing: each `write` is one piece, taken whole or lost.
    pub(crate) fn lines(&self) -> NonBlocking {
        self.lines.clone()
    }

    /// Waits for what was handed over, at most about a second; nothing is written afterwards.
    pub(crate) fn flush(&self) {
        let guard = lock(&self.guard).take();
        let busy = *lock(&self.busy);
        let stands = |busy: Busy| self.lost() > busy.lost || busy.since.elapsed() >= STANDS_FROM;
        if busy.is_some_and(stands) {
            // Nobody reads, for long or while the queue filled up: there is nothing to wait for, and a guard that cannot say goodbye prints so.
            std::mem::forget(guard);
        }
    }
}

/// Writes, and says before the next line how many were lost since it last did.
struct Telling<W> {
    to: W,
    busy: Arc<Mutex<Option<Busy>>>,
    lost: Arc<OnceLock<ErrorCounter>>,
    status: Arc<Mutex<Status>>,
    reported: usize,
}

impl<W: Write> Telling<W> {
    /// A line above the status line, if there is one.
    fn with_status(&mut self, line: &[u8]) -> io::Result<()> {
        let status = {
            let mut status = lock(&self.status);
            if line == REFRESH {
                status.asked = false;
            }
            status.text.clone()
        };
        if status.is_empty() {
            return match line {
                REFRESH => Ok(()),
                line => self.to.write_all(line),
            };
        }
        self.to.write_all(CLEAR_LINE)?;
        if line != REFRESH {
            self.to.write_all(line)?;
        }
        self.to.write_all(status.as_bytes())
    }
}

impl<W: Write> Write for Telling<W> {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let lost = self.lost.get().map_or(0, ErrorCounter::dropped_lines);
        *lock(&self.busy) = Some(Busy {
            since: Instant::now(),
            lost: lost as u64,
        });
        if lost > self.reported {
            let since = lost - self.reported;
            let reported = writeln!(
                self.to,
                "taut: {since} lines were lost here: the terminal or the journal did not take them"
            );
            if reported.is_ok() {
                self.reported = lost;
            }
        }
        // A terminal that is gone has nobody to be told.
        let written = self.with_status(line);
        *lock(&self.busy) = None;
        written.map(|()| line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Standard error of the process: never waits, loses what it cannot take.
pub fn terminal() -> NonBlocking {
    process_writer().lines()
}

/// Writes a line to standard error by [`terminal`].
pub fn say(line: &str) {
    // Writing to a queue does not fail: what finds no room is counted.
    let _ = terminal().write(format!("{line}\n").as_bytes());
}

/// Replaces the status line: one line that stays below all others. For a terminal alone; where standard error is none, nothing happens.
pub fn status(text: String) {
    if io::stderr().is_terminal() {
        process_writer().status(text);
    }
}

/// Leaves the last status line standing.
pub fn end_status() {
    if let Some(writer) = TERMINAL.get() {
        writer.end_status();
    }
}

/// Lines of this process that were lost.
pub fn lost_lines() -> u64 {
    TERMINAL.get().map_or(0, Writer::lost)
}

/// At the end of the process: waits for what was handed over, at most about a second; for a backtrace that is being read, another one.
pub fn flush() {
    crate::panics::flush();
    if let Some(writer) = TERMINAL.get() {
        writer.flush();
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn process_writer() -> &'static Writer {
    TERMINAL.get_or_init(|| {
        // A descriptor of its own: who holds the lock of `std::io::stderr` while the terminal stands would stop everybody else's.
        match io::stderr().as_fd().try_clone_to_owned() {
            Ok(descriptor) => Writer::new(File::from(descriptor), MAX_WAITING),
            Err(_) => Writer::new(io::stderr(), MAX_WAITING),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::BufRead;

    /// A pipe that nobody reads takes 64 KiB, then makes writers wait: a stopped terminal does the same.
    #[test]
    fn a_reader_that_stands_still_costs_lines_and_no_time_and_is_told_how_many() {
        let (reader, pipe) = io::pipe().expect("a pipe");
        let writer = Writer::new(pipe, 64);
        let mut lines = writer.lines();
        let line = format!("{}\n", "x".repeat(1023));
        let begun = Instant::now();
        for _ in 0..10_000 {
            lines.write_all(line.as_bytes()).expect("never fails");
        }
        // Ten megabytes of lines went into nowhere: a writer that waited would still be here.
        let took = begun.elapsed();
        let lost = writer.lost();
        assert!((9_000..10_000).contains(&lost), "{lost} lost in {took:?}");

        // Somebody reads again: what waited comes, and how much did not.
        let came = Arc::<Mutex<Vec<String>>>::default();
        let heard = Arc::clone(&came);
        let reading = std::thread::Builder::new()
            .spawn(move || {
                for line in io::BufReader::new(reader).lines() {
                    lock(&heard).push(line.expect("text"));
                }
            })
            .expect("a thread");
        loop {
            let before = writer.lost();
            lines.write_all(b"after\n").expect("never fails");
            if writer.lost() == before {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        while lock(&came).last().is_none_or(|line| line != "after") {
            std::thread::sleep(Duration::from_millis(1));
        }
        writer.flush();
        drop(lines);
        drop(writer);
        reading.join().expect("no panic");
        let came = lock(&came);
        let reported = |line: &String| line.contains("lines were lost here");
        assert!(came.iter().any(reported), "it was told");
        let shown = came.iter().filter(|line| line.starts_with('x')).count() as u64;
        assert_eq!(shown + lost, 10_000, "each line came or was counted");
    }

    /// Takes a piece whenever it is let.
    struct Gate(std::sync::mpsc::Receiver<()>, Arc<Mutex<Vec<u8>>>);

    impl Write for Gate {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            // Opened for good once nobody holds the other end.
            let _ = self.0.recv();
            lock(&self.1).extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn lines_that_were_lost_long_ago_do_not_cut_off_the_end() {
        let (open, gate) = std::sync::mpsc::channel();
        let shown = Arc::default();
        let writer = Writer::new(Gate(gate, Arc::clone(&shown)), 4);
        let mut lines = writer.lines();
        while writer.lost() == 0 {
            lines.write_all(b"x\n").expect("never fails");
        }
        // Somebody reads again, and takes what waited.
        let taken = || lock(&shown).iter().filter(|byte| **byte == b'x').count();
        while taken() < 4 {
            // One piece at a time: what is let through beforehand would let the last line through, too.
            let before = lock(&shown).len();
            open.send(()).expect("it writes");
            while lock(&shown).len() == before {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        lines.write_all(b"the end\n").expect("never fails");
        // Now a write has just begun that nothing was lost in.
        while lock(&writer.busy).is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        drop(open);
        writer.flush();
        let shown = lock(&shown);
        assert!(shown.ends_with(b"the end\n"), "{shown:?}");
    }

    #[test]
    fn the_end_does_not_wait_for_a_reader_that_stands_still() {
        let (_reader, pipe) = io::pipe().expect("a pipe");
        let writer = Writer::new(pipe, 16);
        for _ in 0..1000 {
            let _ = writer.lines().write(&[b'x'; 1024]);
        }
        let begun = Instant::now();
        writer.flush();
        assert!(begun.elapsed() < Duration::from_secs(30), "it ends at all");
    }
}
