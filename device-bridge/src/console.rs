//! The end report of a process on standard output. Lines while it runs go by [`taut_log`], whose thread loses them rather than time.

use std::io::Write;
use std::sync::mpsc::sync_channel;
use std::time::Duration;

/// How long a report may take to be written: a terminal that is stopped shall not keep a process that is told to end.
const REPORT_TIME: Duration = Duration::from_secs(5);

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
