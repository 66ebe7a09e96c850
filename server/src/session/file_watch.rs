//! Files that people edit while a session runs.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Time between two looks at the files.
const LOOK_PERIOD: Duration = Duration::from_secs(1);

/// When a file was changed last, and how long it is; `None` while it is not there.
type FileVersion = Option<(SystemTime, u64)>;

/// Watches some files. A change counts once, when it has settled.
#[derive(Debug)]
pub(crate) struct FileWatch {
    paths: Vec<PathBuf>,
    /// So many of them, the first, are gone for a moment at most.
    lasting: usize,
    looked: Instant,
    /// As of the last look.
    seen: Vec<FileVersion>,
    /// As of the last reading.
    read: Vec<FileVersion>,
}

impl FileWatch {
    /// Watches files that have been read just now.
    #[must_use]
    pub(crate) fn new(paths: Vec<PathBuf>) -> Self {
        let versions = versions(&paths);
        Self {
            lasting: paths.len(),
            paths,
            looked: Instant::now(),
            seen: versions.clone(),
            read: versions,
        }
    }

    /// These, too: that one of them goes or comes is a change as any.
    #[must_use]
    pub(crate) fn and_while_there(mut self, paths: Vec<PathBuf>) -> Self {
        let versions = versions(&paths);
        self.paths.extend(paths);
        self.seen.extend_from_slice(&versions);
        self.read.extend(versions);
        self
    }

    /// Whether it is time for a look, and the look shows other files than those that were read.
    pub(crate) fn is_due(&mut self) -> bool {
        self.looked.elapsed() >= LOOK_PERIOD && self.has_changed()
    }

    /// Whether the files are others than those that were read, and none is being written: they are the same at two looks.
    fn has_changed(&mut self) -> bool {
        self.looked = Instant::now();
        let now = versions(&self.paths);
        let settled = now == self.seen;
        self.seen = now.clone();
        // Editors put a new file in the place of the old one: for a moment there is none.
        let are_there = now.iter().take(self.lasting).all(Option::is_some);
        let changed = are_there && settled && now != self.read;
        if changed {
            self.read = now;
        }
        changed
    }
}

fn versions(paths: &[PathBuf]) -> Vec<FileVersion> {
    paths.iter().map(|path| version(path)).collect()
}

fn version(path: &Path) -> FileVersion {
    let about = std::fs::metadata(path).ok()?;
    Some((about.modified().ok()?, about.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_counts_once_when_it_has_settled_and_not_while_a_file_is_gone() {
        let directory = tempfile::tempdir().expect("a directory");
        let [path, other] =
            ["workbench.toml", "scene.toml"].map(|name| directory.path().join(name));
        std::fs::write(&path, "a").expect("written");
        std::fs::write(&other, "a").expect("written");
        let mut watch = FileWatch::new(vec![path.clone(), other.clone()]);
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
        std::fs::write(&other, "ab").expect("written");
        assert!(!watch.has_changed());
        assert!(watch.has_changed());
    }

    #[test]
    fn what_a_mesh_can_do_without_holds_up_no_other_change() {
        let directory = tempfile::tempdir().expect("a directory");
        let [path, library] = ["scene.toml", "a.mtl"].map(|name| directory.path().join(name));
        std::fs::write(&path, "a").expect("written");
        std::fs::write(&library, "a").expect("written");
        let mut watch = FileWatch::new(vec![path.clone()]).and_while_there(vec![library.clone()]);
        assert!(!watch.has_changed());
        std::fs::remove_file(&library).expect("removed");
        assert!(!watch.has_changed());
        assert!(watch.has_changed(), "it is gone");
        assert!(!watch.has_changed(), "once");
        std::fs::write(&path, "ab").expect("written");
        assert!(!watch.has_changed());
        assert!(watch.has_changed(), "the scene is followed all the same");
        std::fs::write(&library, "a").expect("written");
        assert!(!watch.has_changed());
        assert!(watch.has_changed(), "it is back");
    }
}
