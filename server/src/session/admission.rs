//! Who may join, followed while the workbench runs: `[network] roles` and `revoked` count from the moment at which the file is saved.
//!
//! The file is looked at once a second, by the thread that reports; nothing else of it is taken before the next start.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use taut_scene::Workbench;

use crate::report::terminal::Terminal;
use crate::session::Session;

/// Time between two looks at the file.
const LOOK_PERIOD: Duration = Duration::from_secs(1);

/// When a file was changed last, and how long it is.
type FileVersion = (SystemTime, u64);

/// Watches one workbench file.
#[derive(Debug)]
pub(crate) struct AdmissionWatch {
    path: PathBuf,
    looked: Instant,
    /// As of the last look.
    seen: Option<FileVersion>,
    /// As of the last reading.
    read: Option<FileVersion>,
}

impl AdmissionWatch {
    /// Watches a file that has been read just now.
    #[must_use]
    pub(crate) fn new(path: &Path) -> Self {
        let version = file_version(path);
        Self {
            path: path.to_path_buf(),
            looked: Instant::now(),
            seen: version,
            read: version,
        }
    }

    /// Looks at the file when it is time, and takes over what changed. A file that cannot be read changes nothing, and is reported once.
    pub(crate) fn follow(&mut self, session: &Session, terminal: &Terminal) {
        if self.looked.elapsed() < LOOK_PERIOD || !self.has_changed() {
            return;
        }
        let line = match Workbench::load(&self.path) {
            Ok(workbench) => match session.set_admission(workbench.network.admission) {
                0 => "who may join is read again; nobody who is in is shut out".to_owned(),
                ended => format!("who may join is read again; shut out: {ended}"),
            },
            Err(error) => format!("the changed workbench file is not taken: {error}"),
        };
        terminal.say(&line);
        tracing::info!("{line}");
    }

    /// Whether the file is another than that which was read, and is not being written: it is the same at two looks.
    fn has_changed(&mut self) -> bool {
        self.looked = Instant::now();
        let now = file_version(&self.path);
        let settled = now == self.seen;
        self.seen = now;
        // Editors put a new file in the place of the old one: for a moment there is none.
        let changed = now.is_some() && settled && now != self.read;
        if changed {
            self.read = now;
        }
        changed
    }
}

fn file_version(path: &Path) -> Option<FileVersion> {
    let about = std::fs::metadata(path).ok()?;
    Some((about.modified().ok()?, about.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_counts_once_when_it_has_settled_and_not_while_it_is_gone() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("workbench.toml");
        std::fs::write(&path, "a").expect("written");
        let mut watch = AdmissionWatch::new(&path);
        assert!(!watch.has_changed());
        std::fs::write(&path, "ab").expect("written");
        assert!(!watch.has_changed(), "it may be half written");
        assert!(watch.has_changed());
        assert!(!watch.has_changed(), "once");
        std::fs::remove_file(&path).expect("removed");
        assert!(!watch.has_changed() && !watch.has_changed());
        std::fs::write(&path, "abc").expect("written");
        assert!(!watch.has_changed());
        assert!(watch.has_changed());
    }
}
