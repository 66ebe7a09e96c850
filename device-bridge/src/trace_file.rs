//! Device traces from files, by the reader that all of taut uses: [`taut_recording::parse_trace`].

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use taut_recording::{MAX_TRACE_BYTES, TraceFault, TraceSample, parse_trace};

use crate::devices::{MinJerkPath, PathError, Trace, TraceError, ViaPoint};

/// Why a trace file was not read.
#[derive(Debug, thiserror::Error)]
pub enum TraceFileError {
    /// The file cannot be opened or read, or is no text.
    #[error("cannot read the trace {0}: {1}; check the path and that it is a CSV file")]
    Unreadable(PathBuf, io::Error),
    /// Its first fault.
    #[error("the trace {0}{line}: {1}", line = .1.line.map_or_else(String::new, |line| format!(":{line}")))]
    Faulty(PathBuf, TraceFault),
    /// It cannot be followed by a hand.
    #[error("{0}: {1}")]
    Path(PathBuf, PathError),
    /// It cannot be replayed.
    #[error("{0}: {1}")]
    Trace(PathBuf, TraceError),
}

/// Reads the trace at `path`.
///
/// # Errors
/// [`TraceFileError`] names file and line of the first fault.
pub fn read_trace(path: &Path) -> Result<Trace, TraceFileError> {
    let unreadable = |cause| TraceFileError::Unreadable(path.to_owned(), cause);
    let text = read_text(path).map_err(unreadable)?;
    let rows = parse_trace(&text).map_err(|faults| {
        let fault = faults.into_iter().next().unwrap_or_else(|| TraceFault {
            line: None,
            text: "is no trace".to_owned(),
        });
        TraceFileError::Faulty(path.to_owned(), fault)
    })?;
    Ok(rows.samples)
}

fn read_text(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    let read = File::open(path)?
        .take(MAX_TRACE_BYTES + 1)
        .read_to_string(&mut text)?;
    if read as u64 > MAX_TRACE_BYTES {
        return Err(io::Error::new(
            io::ErrorKind::FileTooLarge,
            format!("it is larger than {MAX_TRACE_BYTES} bytes"),
        ));
    }
    Ok(text)
}

/// The trace at `path` as a hand's intention, for ever where it is `looping`.
pub(crate) fn read_path(path: &Path, looping: bool) -> Result<MinJerkPath, TraceFileError> {
    let followed = MinJerkPath::new(via_points(&read_trace(path)?), looping);
    followed.map_err(|cause| TraceFileError::Path(path.to_owned(), cause))
}

/// The rows of a trace as via points of a hand's intention; their times count from the first row.
#[must_use]
pub fn via_points(trace: &[TraceSample]) -> Vec<ViaPoint> {
    let start_s = trace.first().map_or(0.0, |row| row.time);
    trace
        .iter()
        .map(|row| ViaPoint {
            time_s: row.time - start_s,
            pose: row.pose,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_hand_paths_with_their_comments_are_read() {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../server/scenes");
        for name in [
            "peg-in-a-hole",
            "sphere-on-plane",
            "two-bunnies",
            "moving-plate-hand",
        ] {
            let path = scenes.join(name).with_extension("csv");
            let text = std::fs::read_to_string(&path).expect("shipped");
            assert!(text.starts_with('#'), "{name} begins with a comment");
            let trace = read_trace(&path).expect("a valid trace");
            let via = via_points(&trace);
            assert!(via.len() > 1 && via[0].time_s == 0.0, "{name}");
        }
    }

    #[test]
    fn a_fault_is_told_with_file_and_line() {
        let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
        io::Write::write_all(
            &mut file,
            b"# hand\nt,x,y,z,qw,qx,qy,qz\n\n# pressed\n0,0,0,0,0.9,0,0,0\n",
        )
        .expect("written");
        let error = read_trace(file.path()).expect_err("a broken trace");
        let sentence = error.to_string();
        assert!(
            sentence.contains(":5: the quaternion has norm 0.9"),
            "{sentence}"
        );
        let missing = read_trace(Path::new("no/such/trace.csv")).expect_err("a missing file");
        assert!(missing.to_string().contains("no/such/trace.csv"));
    }
}
