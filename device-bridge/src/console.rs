//! What a process prints on standard output. Lines while it runs go by [`taut_log`], whose thread loses them rather than time.

use std::io::{self, Write};
use std::sync::mpsc::sync_channel;
use std::time::Duration;

/// How long a report may take to be written: a terminal that is stopped shall not keep a process that is told to end. A pipe takes a report at once, and
/// whoever takes nothing for a second is not reading.
const REPORT_TIME: Duration = Duration::from_secs(1);

/// Prints the result of a command that only prints, and a line's end; waits for whoever reads. A reader that has gone away (`| head`) has what it
/// wanted and is no fault.
///
/// # Errors
/// Standard output cannot be written: a full disk.
pub fn print(text: impl Into<String>) -> io::Result<()> {
    forgive_closed(write_line(io::stdout().lock(), text.into()))
}

fn forgive_closed(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

fn write_line(mut out: impl Write, mut text: String) -> io::Result<()> {
    if !text.ends_with('\n') {
        text.push('\n');
    }
    out.write_all(text.as_bytes()).and_then(|()| out.flush())
}

/// Writes a report to standard output, and waits for that at most a second: for the end of a process, when there is no force any more. False where it
/// cannot be written (a full disk), which is said. A reader that has gone away, or that takes nothing, is no fault.
#[must_use]
pub fn report(text: impl Into<String>) -> bool {
    match forgive_closed(written_in_time(io::stdout(), text.into())) {
        Err(error) if error.kind() != io::ErrorKind::TimedOut => {
            taut_log::say(&format!(
                "taut: standard output cannot be written ({error}); check the free space"
            ));
            false
        }
        _ => true,
    }
}

fn written_in_time(out: impl Write + Send + 'static, text: String) -> io::Result<()> {
    let (progress, answer) = sync_channel(2);
    let thread = std::thread::Builder::new().name("report".to_owned());
    thread.spawn(move || {
        let _ = progress.send(Ok(())); // it begins
        let _ = progress.send(write_line(out, text)); // or who waited has given up
    })?;
    // A busy machine may be slow to start the thread: that is no terminal's fault and does not count.
    let _ = answer.recv();
    answer
        .recv_timeout(REPORT_TIME)
        .unwrap_or(Err(io::ErrorKind::TimedOut.into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, pipe};
    use std::time::Instant;

    #[test]
    fn a_report_is_written_whole_and_ends_a_line() {
        let (mut reader, writer) = pipe().expect("a pipe");
        assert!(written_in_time(writer, "all went well".to_owned()).is_ok());
        let mut text = String::new();
        reader.read_to_string(&mut text).expect("text");
        assert_eq!(text, "all went well\n");
    }

    #[test]
    fn a_reader_that_went_away_is_no_fault_and_a_full_disk_is() {
        let (reader, writer) = pipe().expect("a pipe");
        drop(reader);
        assert!(forgive_closed(write_line(&writer, "x".to_owned())).is_ok());
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
        if let Ok(full) = full {
            assert!(forgive_closed(write_line(full, "x".to_owned())).is_err());
        }
    }

    #[test]
    fn a_terminal_that_takes_nothing_keeps_no_process_for_longer_than_a_second() {
        let (_reader, writer) = pipe().expect("a pipe");
        let begun = Instant::now();
        // More than a pipe holds.
        let written = written_in_time(writer, "x".repeat(1 << 20));
        assert!(written.is_err_and(|error| error.kind() == io::ErrorKind::TimedOut));
        let took = begun.elapsed();
        assert!(took >= REPORT_TIME, "{took:?}");
        // With what a busy machine adds.
        assert!(took < 4 * REPORT_TIME, "{took:?}");
    }
}
