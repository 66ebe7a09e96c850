//! Who may join, followed while the workbench runs: `[network] roles` and `revoked` count from the moment at which the file is saved.
//!
//! The file is looked at once a second, by the thread that reports; nothing else of it is taken before the next session. A session begins with what the
//! file says then.

use std::path::{Path, PathBuf};

use taut_link::JoinPolicy;
use taut_scene::Workbench;

use crate::session::Session;
use crate::session::file_watch::FileWatch;

/// Watches one workbench file, through all sessions.
#[derive(Debug)]
pub(crate) struct AdmissionWatch {
    path: PathBuf,
    file: FileWatch,
    /// As it was read here last.
    newest: Option<JoinPolicy>,
}

impl AdmissionWatch {
    /// Watches a file that is read after this.
    #[must_use]
    pub(crate) fn new(path: &Path) -> Self {
        Self {
            path: path.to_path_buf(),
            file: FileWatch::new(vec![path.to_path_buf()]),
            newest: None,
        }
    }

    /// Makes `policy`, of a session that begins, what the file says now; where it cannot be read now, what was read here last. Since the session's setup
    /// was read its meshes were loaded, and somebody may have been shut out meanwhile.
    pub(crate) fn begin(&mut self, policy: &mut JoinPolicy) {
        // No news for the watch: what is being written now is read again when it has settled.
        if let Ok(workbench) = Workbench::load(&self.path) {
            self.newest = Some(workbench.network.admission);
        }
        if let Some(newest) = &self.newest {
            policy.clone_from(newest);
        }
    }

    /// Looks at the file when it is time, and takes over what changed. A file that cannot be read changes nothing, and is reported once.
    pub(crate) fn follow(&mut self, session: &Session) {
        if !self.file.is_due() {
            return;
        }
        let line = match Workbench::load(&self.path) {
            Ok(workbench) => {
                let policy = workbench.network.admission;
                self.newest = Some(policy.clone());
                match session.set_admission(policy) {
                    0 => "who may join is read again; nobody who is in is shut out".to_owned(),
                    ended => format!("who may join is read again; shut out: {ended}"),
                }
            }
            Err(error) => format!("the changed workbench file is not taken: {error}"),
        };
        taut_log::say(&line);
        tracing::info!("{line}");
    }
}

#[cfg(test)]
mod tests {
    use taut_scene::SHIPPED_WORKBENCH;

    use super::*;

    #[test]
    fn who_is_revoked_while_a_session_is_built_is_so_in_it() {
        let place = tempfile::tempdir().expect("a directory");
        let path = place.path().join("workbench.toml");
        let save = |text: &str| std::fs::write(&path, text).expect("written");
        let revoked = SHIPPED_WORKBENCH.replacen(
            "max_clients = 16",
            "max_clients = 16\nrevoked = [\"lost-laptop\"]",
            1,
        );
        assert_ne!(revoked, SHIPPED_WORKBENCH);
        save(SHIPPED_WORKBENCH);
        let mut watch = AdmissionWatch::new(&path);

        // As the file was when the session's setup was read.
        let mut policy = JoinPolicy::default();
        save(&revoked);
        watch.begin(&mut policy);
        assert_eq!(policy.revoked.len(), 1);
        // A file with a fault in it changes nothing: who was shut out stays so.
        save("[network");
        let mut policy = JoinPolicy::default();
        watch.begin(&mut policy);
        assert_eq!(policy.revoked.len(), 1);
        save(SHIPPED_WORKBENCH);
        watch.begin(&mut policy);
        assert!(policy.revoked.is_empty());
    }
}
