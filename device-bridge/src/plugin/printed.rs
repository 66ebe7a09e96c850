//! What a process of a device prints: lines for the log, bounded in length and rate. A pipe that nobody reads would stop the device.

use std::collections::VecDeque;
use std::io::{PipeReader, Read};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use crate::realtime::{leave_fifo, monotonic_now};

/// Longest line that is told, bytes; the rest of it is left out.
const MAX_LINE: usize = 400;
/// Most lines a second.
const MAX_LINES: usize = 20;
/// Lines that are kept for an error.
const LAST: usize = 8;
/// For what a process that has ended has printed: what it started itself may print on.
const READ_WITHIN: Duration = Duration::from_millis(500);

/// The newest lines, and the thread that reads them until nobody can print any more.
pub(super) struct Printed {
    last: Arc<Mutex<VecDeque<String>>>,
    /// Closed when all is read.
    all_read: Receiver<()>,
}

impl Printed {
    /// Reads `from`, which `name` prints to.
    pub(super) fn read(from: PipeReader, name: &str) -> Self {
        let last = Arc::default();
        let (reading, all_read) = channel();
        let mut lines = Lines {
            name: name.to_owned(),
            line: Vec::with_capacity(MAX_LINE),
            last: Arc::clone(&last),
            second: Duration::ZERO,
            lines: 0,
            left_out: 0,
        };
        // Without the thread the process is stopped by its own lines, and that is told as a device that hangs.
        let _ = thread::Builder::new()
            .name("taut-printed".to_owned())
            .spawn(move || {
                leave_fifo(); // of the thread that starts it
                lines.run(from);
                drop(reading);
            });
        Self { last, all_read }
    }

    /// The newest lines of a process that has ended, as the end of a sentence; nothing where none was printed.
    pub(super) fn last_lines(&self) -> String {
        let _ = self.all_read.recv_timeout(READ_WITHIN); // nothing is sent
        let lines = self.last.lock().map(|lines| lines.clone());
        let lines: Vec<String> = lines.unwrap_or_default().into();
        match lines.is_empty() {
            true => String::new(),
            false => format!("; its last lines:\n{}", lines.join("\n")),
        }
    }
}

struct Lines {
    name: String,
    line: Vec<u8>,
    last: Arc<Mutex<VecDeque<String>>>,
    second: Duration,
    lines: usize,
    left_out: u64,
}

impl Lines {
    fn run(&mut self, mut from: PipeReader) {
        let mut bytes = [0; 4096];
        // An error is the end, too.
        while let Ok(count @ 1..) = from.read(&mut bytes) {
            for byte in &bytes[..count] {
                match byte {
                    b'\n' => self.end_line(),
                    _ if self.line.len() < MAX_LINE => self.line.push(*byte),
                    _ => {}
                }
            }
        }
        self.end_line();
    }

    fn end_line(&mut self) {
        let text = String::from_utf8_lossy(&self.line);
        let text: String = text.chars().filter(|letter| !letter.is_control()).collect();
        self.line.clear();
        if text.trim().is_empty() {
            return;
        }
        if let Ok(mut last) = self.last.lock() {
            last.truncate(LAST);
            if last.len() == LAST {
                last.pop_front();
            }
            last.push_back(text.clone());
        }
        let now = monotonic_now();
        if now.saturating_sub(self.second) >= Duration::from_secs(1) {
            if self.left_out > 0 {
                tracing::info!("{}: {} lines more", self.name, self.left_out);
            }
            (self.second, self.lines, self.left_out) = (now, 0, 0);
        }
        if self.lines < MAX_LINES {
            self.lines += 1;
            tracing::info!("{}: {text}", self.name);
        } else {
            self.left_out += 1;
        }
    }
}
