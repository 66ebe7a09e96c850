//! Who may join, followed while the workbench runs: `[network] roles` and `revoked` count from the moment at which the file is saved.
//!
//! The file is looked at once a second, by the thread that reports; nothing else of it is taken before the next session.

use std::path::{Path, PathBuf};

use taut_scene::Workbench;

use crate::report::terminal::Terminal;
use crate::session::Session;
use crate::session::file_watch::FileWatch;

/// Watches one workbench file.
#[derive(Debug)]
pub(crate) struct AdmissionWatch {
    path: PathBuf,
    file: FileWatch,
}

impl AdmissionWatch {
    /// Watches a file that has been read just now.
    #[must_use]
    pub(crate) fn new(path: &Path) -> Self {
        Self {
            path: path.to_path_buf(),
            file: FileWatch::new(vec![path.to_path_buf()]),
        }
    }

    /// Looks at the file when it is time, and takes over what changed. A file that cannot be read changes nothing, and is reported once.
    pub(crate) fn follow(&mut self, session: &Session, terminal: &Terminal) {
        if !self.file.is_due() {
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
}
