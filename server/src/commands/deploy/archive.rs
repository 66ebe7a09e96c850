//! One machine's archive: a gzipped tar, the same bytes for the same content, so that a second run changes nothing.

use std::io;
use std::path::PathBuf;

use flate2::{Compression, GzBuilder};
use tar::{Builder, EntryType, Header};
use zeroize::Zeroizing;

/// Who may use a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// Its owner alone may read it: a secret.
    Secret,
    /// All may read it.
    Plain,
    /// All may execute it.
    Program,
}

impl Mode {
    pub(super) fn bits(self) -> u32 {
        match self {
            Self::Secret => 0o600,
            Self::Plain => 0o644,
            Self::Program => 0o755,
        }
    }
}

pub(super) struct File {
    /// Relative to the archive's folder; folders are separated by `/`.
    pub(super) path: PathBuf,
    pub(super) mode: Mode,
    /// Wiped when it is dropped.
    pub(super) content: Zeroizing<Vec<u8>>,
}

impl File {
    pub(super) fn new(path: impl Into<PathBuf>, mode: Mode, content: impl Into<Vec<u8>>) -> Self {
        Self {
            path: path.into(),
            mode,
            content: Zeroizing::new(content.into()),
        }
    }
}

/// Packs files below `folder`. Owner and times are nobody's: 0.
pub(super) fn pack(folder: &str, files: &[File]) -> io::Result<Vec<u8>> {
    let gzip = GzBuilder::new()
        .mtime(0)
        .write(Vec::new(), Compression::default());
    let mut archive = Builder::new(gzip);
    // The folder alone may be looked into by its owner: secrets lie in it until they are installed.
    let mut header = header(0, 0o700);
    header.set_entry_type(EntryType::Directory);
    archive.append_data(&mut header, format!("{folder}/"), io::empty())?;
    for file in files {
        let mut header = self::header(file.content.len() as u64, file.mode.bits());
        header.set_entry_type(EntryType::Regular);
        let path = PathBuf::from(folder).join(&file.path);
        archive.append_data(&mut header, path, file.content.as_slice())?;
    }
    archive.into_inner()?.finish()
}

fn header(size: u64, mode: u32) -> Header {
    let mut header = Header::new_gnu();
    header.set_size(size);
    header.set_mode(mode);
    header.set_uid(0);
    header.set_gid(0);
    header.set_mtime(0);
    header
}
