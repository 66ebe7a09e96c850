//! The bounded queue between a loop and the monitoring thread.
//!
//! Writer: one, the thread that holds the [`MonitorSender`]. Reader: one, the monitoring thread, 30 times a second.
//! A full queue means that the reader is stalled; the newest sample is then dropped and counted, and the writer
//! goes on. All memory is allocated at the start.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};

use crate::log::LogLevel;
use crate::sample::MonitorSample;

/// Samples that fit: more than two seconds at 100 a second.
pub(crate) const SAMPLE_CAPACITY: usize = 256;
/// Lines that fit.
pub(crate) const LINE_CAPACITY: usize = 64;
/// Longest line from a real-time thread, bytes.
pub(crate) const LINE_BYTES: usize = 160;

/// A line of text without heap memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShortLine {
    pub(crate) session_time_ns: u64,
    pub(crate) level: LogLevel,
    text: [u8; LINE_BYTES],
    length: usize,
}

impl ShortLine {
    /// Keeps at most [`LINE_BYTES`] bytes of `text`, cut between characters.
    fn new(session_time_ns: u64, level: LogLevel, text: &str) -> ShortLine {
        let length = text.floor_char_boundary(LINE_BYTES);
        let mut bytes = [0; LINE_BYTES];
        bytes[..length].copy_from_slice(&text.as_bytes()[..length]);
        ShortLine {
            session_time_ns,
            level,
            text: bytes,
            length,
        }
    }

    pub(crate) fn text(&self) -> std::borrow::Cow<'_, str> {
        String::from_utf8_lossy(&self.text[..self.length])
    }
}

/// Numbers shared by the queue's two ends and [`crate::Monitor::stats`].
#[derive(Debug, Default)]
pub(crate) struct Counters {
    pub(crate) samples_shown: AtomicU64,
    pub(crate) samples_dropped: AtomicU64,
    pub(crate) samples_not_finite: AtomicU64,
}

/// The loop's end of the queue: wait-free, never allocates.
#[derive(Debug)]
pub struct MonitorSender {
    samples: Producer<MonitorSample>,
    lines: Producer<ShortLine>,
    counters: Arc<Counters>,
    lines_dropped: Arc<AtomicU64>,
}

pub(crate) struct MonitorReceiver {
    pub(crate) samples: Consumer<MonitorSample>,
    pub(crate) lines: Consumer<ShortLine>,
    pub(crate) counters: Arc<Counters>,
}

pub(crate) fn queue(
    counters: Arc<Counters>,
    lines_dropped: Arc<AtomicU64>,
) -> (MonitorSender, MonitorReceiver) {
    let (samples_in, samples_out) = RingBuffer::new(SAMPLE_CAPACITY);
    let (lines_in, lines_out) = RingBuffer::new(LINE_CAPACITY);
    let sender = MonitorSender {
        samples: samples_in,
        lines: lines_in,
        counters: Arc::clone(&counters),
        lines_dropped,
    };
    let receiver = MonitorReceiver {
        samples: samples_out,
        lines: lines_out,
        counters,
    };
    (sender, receiver)
}

impl MonitorSender {
    /// Hands a sample over; `false` if the queue was full and the sample was dropped and counted.
    ///
    /// 30 to 100 a second is plenty: the picture moves 30 times a second, the plots show what lies between samples, too, where it was added to [`MonitorSample::between`].
    pub fn offer(&mut self, sample: MonitorSample) -> bool {
        let taken = self.samples.push(sample).is_ok();
        if !taken {
            self.counters
                .samples_dropped
                .fetch_add(1, Ordering::Relaxed);
        }
        taken
    }

    /// Shows a line; `false` if it was dropped and counted. Beyond 160 bytes the text is cut.
    pub fn log(&mut self, session_time_ns: u64, level: LogLevel, text: &str) -> bool {
        let line = ShortLine::new(session_time_ns, level, text);
        let taken = self.lines.push(line).is_ok();
        if !taken {
            self.lines_dropped.fetch_add(1, Ordering::Relaxed);
        }
        taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn both_ends() -> (MonitorSender, MonitorReceiver, Arc<AtomicU64>) {
        let lines_dropped = Arc::new(AtomicU64::new(0));
        let (sender, receiver) = queue(Arc::default(), Arc::clone(&lines_dropped));
        (sender, receiver, lines_dropped)
    }

    #[test]
    fn a_full_queue_drops_the_newest_counts_it_and_returns() {
        let (mut sender, mut receiver, _) = both_ends();
        let extra = 10;
        let taken = (0..SAMPLE_CAPACITY + extra)
            .filter(|i| sender.offer(MonitorSample::at(*i as u64)))
            .count();
        assert_eq!(taken, SAMPLE_CAPACITY);
        let dropped = receiver.counters.samples_dropped.load(Ordering::Relaxed);
        assert_eq!(dropped, extra as u64);

        // What was taken comes out in order, and then there is room again.
        for i in 0..SAMPLE_CAPACITY {
            assert_eq!(receiver.samples.pop().unwrap().session_time_ns, i as u64);
        }
        assert!(receiver.samples.pop().is_err());
        assert!(sender.offer(MonitorSample::at(0)));
    }

    #[test]
    fn offering_after_the_reader_is_gone_still_returns() {
        let (mut sender, receiver, _) = both_ends();
        drop(receiver);
        for _ in 0..2 * SAMPLE_CAPACITY {
            sender.offer(MonitorSample::at(0));
        }
        assert!(sender.counters.samples_dropped.load(Ordering::Relaxed) > 0);
    }

    #[test]
    fn a_long_line_is_cut_between_characters() {
        let (mut sender, mut receiver, _) = both_ends();
        let text = "é".repeat(LINE_BYTES);
        assert!(sender.log(7, LogLevel::Warn, &text));
        let line = receiver.lines.pop().unwrap();
        assert_eq!(line.text(), "é".repeat(LINE_BYTES / 2));
        assert_eq!(line.session_time_ns, 7);
    }

    #[test]
    fn too_many_lines_are_dropped_and_counted() {
        let (mut sender, _receiver, lines_dropped) = both_ends();
        for _ in 0..LINE_CAPACITY + 3 {
            sender.log(0, LogLevel::Info, "line");
        }
        assert_eq!(lines_dropped.load(Ordering::Relaxed), 3);
    }
}
