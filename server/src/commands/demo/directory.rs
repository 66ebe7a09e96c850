//! Where a demo keeps its cluster key: a temporary directory that goes with it.
//!
//! A demo that was killed cannot clear up; the next one does it. It recognises them by a lock, which the system
//! takes back when its holder dies. A directory whose lock nobody holds, but which has a key, belongs to nobody any more: the
//! key is written only under the lock.

use std::fs::{File, Metadata};
use std::io;
use std::path::{Path, PathBuf};

use taut_link::{ClusterKey, create_key_file};
use tempfile::TempDir;

use crate::shared::failure::Failure;

/// What the directories of all demos begin with.
const PREFIX: &str = "taut-demo-";
const LOCK_FILE: &str = "lock";
const KEY_FILE: &str = "cluster.key";

/// A demo's own directory, with a fresh cluster key. Dropped, it is removed.
#[derive(Debug)]
pub(super) struct DemoDirectory {
    directory: TempDir,
    /// Held while the demo lives.
    _lock: File,
}

impl DemoDirectory {
    /// Removes the directories of demos that were killed, and makes a new one.
    pub(super) fn create() -> Result<(Self, ClusterKey), Failure> {
        Self::create_in(&std::env::temp_dir())
    }

    fn create_in(parent: &Path) -> Result<(Self, ClusterKey), Failure> {
        let cannot = |error: io::Error| {
            Failure::failed(format!(
                "no temporary directory can be made ({error}); check TMPDIR"
            ))
        };
        let directory = tempfile::Builder::new()
            .prefix(PREFIX)
            .tempdir_in(parent)
            .map_err(cannot)?;
        let lock = File::create(directory.path().join(LOCK_FILE)).map_err(cannot)?;
        lock.try_lock().map_err(|error| cannot(error.into()))?;
        remove_abandoned(parent, directory.path());
        let key = create_key_file(&directory.path().join(KEY_FILE))?;
        let created = Self {
            directory,
            _lock: lock,
        };
        Ok((created, key))
    }

    pub(super) fn path(&self) -> &Path {
        self.directory.path()
    }

    /// The file with the cluster key.
    pub(super) fn key_file(&self) -> PathBuf {
        self.path().join(KEY_FILE)
    }
}

/// What cannot be looked at or removed is left alone: it belongs to somebody else, or another demo was faster.
fn remove_abandoned(parent: &Path, own: &Path) {
    let Ok(own_metadata) = own.symlink_metadata() else {
        return;
    };
    for entry in parent.read_dir().into_iter().flatten().flatten() {
        let ours = entry.file_name().to_string_lossy().starts_with(PREFIX)
            && entry
                .metadata()
                .is_ok_and(|metadata| metadata.is_dir() && same_owner(&metadata, &own_metadata));
        if ours && is_abandoned(&entry.path()) {
            match std::fs::remove_dir_all(entry.path()) {
                Ok(()) => tracing::info!("{}: removed, its demo is dead", entry.path().display()),
                Err(error) => tracing::debug!("{}: {error}", entry.path().display()),
            }
        }
    }
}

fn is_abandoned(directory: &Path) -> bool {
    directory.join(KEY_FILE).is_file()
        && File::open(directory.join(LOCK_FILE)).is_ok_and(|lock| lock.try_lock().is_ok())
}

#[cfg(unix)]
fn same_owner(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    a.uid() == b.uid()
}

#[cfg(not(unix))]
fn same_owner(_: &Metadata, _: &Metadata) -> bool {
    // The temporary directory is the user's own there.
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn create_in(parent: &TempDir) -> DemoDirectory {
        DemoDirectory::create_in(parent.path())
            .unwrap_or_else(|error| panic!("{error}"))
            .0
    }

    #[test]
    fn a_demo_removes_the_directories_of_dead_demos_and_of_nobody_else() {
        let parent = TempDir::new().expect("no temporary directory");
        let living = create_in(&parent);
        let killed = create_in(&parent);
        let dead = killed.path().to_path_buf();
        // What a kill does: the lock goes, the directory stays.
        let DemoDirectory { directory, _lock } = killed;
        drop(_lock);
        let _ = directory.keep();
        let foreign = parent.path().join("taut-demo-notes");
        assert!(std::fs::create_dir(&foreign).is_ok());

        let next = create_in(&parent);
        assert!(!dead.exists(), "the key of a dead demo is still there");
        assert!(living.key_file().is_file() && next.key_file().is_file());
        assert!(
            foreign.is_dir(),
            "a directory without a key is not a demo's"
        );
        let path = next.path().to_path_buf();
        drop(next);
        assert!(!path.exists());
    }
}
