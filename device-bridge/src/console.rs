//! The end report of a process on standard output. Lines while it runs go by [`taut_log`], whose thread loses them rather than time.

use std::io::{self, Write};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Duration;

/// How long a report may take to be written: a terminal that is stopped shall not keep a process that is told to end. A pipe takes a report at once, and
/// whoever takes nothing for a second is not reading.
const REPORT_TIME: Duration = Duration::from_secs(1);

/// Writes a report to standard output, and waits for that at most a second; whether it was written. For the end of a process, when
/// there is no force any more.
pub fn report(text: impl Into<String>) -> bool {
    written_in_time(io::stdout(), text.into())
}

fn written_in_time(out: impl Write + Send + 'static, text: String) -> bool {
    let (told, answer) = sync_channel(2);
    let thread = std::thread::Builder::new().name("report".to_owned());
    let started = thread.spawn(move || write(out, text, &told));
    // A busy machine may be slow to start the thread: that is no terminal's fault and does not count.
    let begun = started.is_ok() && answer.recv().is_ok();
    begun && answer.recv_timeout(REPORT_TIME).unwrap_or(false)
}

/// Tells when it begins, and whether all was taken.
fn write(mut out: impl Write, mut text: String, told: &SyncSender<bool>) {
    if !text.ends_with('\n') {
        text.push('\n');
    }
    let _ = told.send(true);
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    let _ = told.send(written.is_ok()); // who waited has given up
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, pipe};
    use std::time::Instant;

    #[test]
    fn a_report_is_written_whole_and_ends_a_line() {
        let (mut reader, writer) = pipe().expect("a pipe");
        assert!(written_in_time(writer, "all went well".to_owned()));
        let mut text = String::new();
        reader.read_to_string(&mut text).expect("text");
        assert_eq!(text, "all went well\n");
    }

    #[test]
    fn a_terminal_that_takes_nothing_keeps_no_process_for_longer_than_a_second() {
        let (_reader, writer) = pipe().expect("a pipe");
        let begun = Instant::now();
        // More than a pipe holds.
        assert!(!written_in_time(writer, "x".repeat(1 << 20)));
        let took = begun.elapsed();
        assert!(took >= REPORT_TIME, "{took:?}");
        // With what a busy machine adds.
        assert!(took < 4 * REPORT_TIME, "{took:?}");
    }
}
