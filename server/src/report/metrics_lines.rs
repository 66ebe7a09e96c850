//! Measurements as lines of JSON, to a file or standard output.
//!
//! By a thread of their own: who is slow there loses lines, and so does a full disk, which is told once until it can be written again.

use std::io::{self, Write};
use std::path::Path;
use std::sync::mpsc::{SyncSender, sync_channel};

use crate::report::metrics::Metrics;
use crate::shared::failure::Failure;

/// Lines that wait for a file or a reader that is slow; further ones are left out.
const WAITING: usize = 16;

/// Where lines are handed on.
#[derive(Debug)]
pub(crate) struct MetricsLines(SyncSender<String>);

impl MetricsLines {
    /// To `file`, behind what is there, or to standard output where that is `-`.
    ///
    /// # Errors
    /// The file cannot be made, or no thread.
    pub(crate) fn start(file: &Path) -> Result<Self, Failure> {
        let to: Box<dyn Write + Send> = if file == Path::new("-") {
            Box::new(io::stdout())
        } else {
            let opened = std::fs::File::options()
                .create(true)
                .append(true)
                .open(file);
            Box::new(opened.map_err(|error| {
                Failure::bad_input(format!("--metrics-json {} cannot be written ({error}); name a file in a folder that is there", file.display()))
            })?)
        };
        let (lines, waiting) = sync_channel::<String>(WAITING);
        let name = file.display().to_string();
        std::thread::Builder::new()
            .name("metrics".to_owned())
            .spawn(move || write_all(to, waiting.into_iter(), &name))
            .map_err(|error| {
                Failure::failed(format!(
                    "the thread of the metrics cannot be started ({error})"
                ))
            })?;
        Ok(Self(lines))
    }

    /// Hands a line on; never waits.
    pub(crate) fn write(&self, metrics: &Metrics) {
        if let Ok(line) = serde_json::to_string(metrics) {
            let _ = self.0.try_send(line);
        }
    }
}

/// Writes each of `lines`, which may be cut off where the disk is full; the next one that can be written begins a line of its own.
fn write_all(mut to: impl Write, lines: impl Iterator<Item = String>, name: &str) {
    let mut lost = 0_u64;
    for line in lines {
        let end_of_lost = if lost > 0 { "\n" } else { "" };
        let written = writeln!(to, "{end_of_lost}{line}").and_then(|()| to.flush());
        match written {
            Ok(()) if lost > 0 => {
                tracing::info!("--metrics-json {name} is written again; {lost} lines are lost");
                lost = 0;
            }
            Ok(()) => {}
            Err(error) => {
                lost += 1;
                if lost == 1 {
                    tracing::warn!(
                        "--metrics-json {name} cannot be written ({error}): lines are lost until it can; the session goes on"
                    );
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk that is full from some bytes on, until so many writes failed.
    struct Disk {
        written: Vec<u8>,
        room: usize,
        failures: u32,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.failures == 0 {
                self.room = usize::MAX;
            }
            let taken = bytes.len().min(self.room);
            if taken == 0 {
                self.failures -= 1;
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.room -= taken;
            self.written.extend_from_slice(&bytes[..taken]);
            Ok(taken)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_line_that_a_full_disk_cut_off_spoils_no_other() {
        for room in 0..12 {
            let mut disk = Disk {
                written: Vec::new(),
                room,
                failures: 2,
            };
            let lines = (0..5).map(|number| format!("{{\"n\":{number}}}"));
            write_all(&mut disk, lines, "a test");
            let text = String::from_utf8(disk.written).expect("text");
            let is_whole = |line: &&str| serde_json::from_str::<serde_json::Value>(line).is_ok();
            let (whole, cut): (Vec<_>, Vec<_>) = text
                .lines()
                .filter(|line| !line.is_empty())
                .partition(is_whole);
            // Two lines met the full disk; of one of them a part is there.
            assert!(whole.len() >= 3 && cut.len() <= 1, "{room}: {text}");
            assert!(
                whole.ends_with(&["{\"n\":3}", "{\"n\":4}"]),
                "{room}: {text}"
            );
        }
    }
}
