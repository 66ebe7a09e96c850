//! What can be wrong with a recording.

use std::path::PathBuf;

/// Why a recording cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The directory has something in it.
    #[error("{}: is there already and is not empty; name a new directory for the recording", .0.display())]
    NotEmpty(PathBuf),
    /// A file cannot be written.
    #[error("{}: cannot be written ({error}); check the path, its permissions and the free space", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// A file cannot be read.
    #[error("{}: cannot be read ({error}); name the directory of a recording", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// Written by a program of another version of the format.
    #[error("{}: has format {found}, and this program reads format {}; use the program that wrote it: {program}", path.display(), crate::FORMAT)]
    Format {
        /// The file.
        path: PathBuf,
        /// Its format.
        found: u32,
        /// The program that wrote it.
        program: String,
    },
    /// An export cannot be written.
    #[cfg(feature = "export")]
    #[error(
        "the export cannot be written ({0}); check the path, its permissions and the free space"
    )]
    Export(#[from] mcap::McapError),
    /// An export was asked to end.
    #[cfg(feature = "export")]
    #[error("the export was interrupted; nothing was written")]
    Interrupted,
    /// A file that is not in the form it should have.
    #[error("{}, line {line}: {text}; the file was changed or cut off: use a copy that was not", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// What is wrong there.
        text: String,
    },
}
