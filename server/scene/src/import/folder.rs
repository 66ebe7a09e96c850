//! A folder that appears under its name only when everything in it is written.

use std::fs;
use std::path::{Path, PathBuf};

use crate::finished_file::free_name;
use crate::problem::Problem;

/// Written beside its place under a name of its own. Dropped before it is finished, it leaves nothing.
#[derive(Debug)]
pub(super) struct NewFolder {
    path: PathBuf,
    partial: PathBuf,
}

impl NewFolder {
    /// Begins the folder; there must be nothing of its name.
    pub(super) fn create(path: &Path) -> Result<Self, Problem> {
        let fail = |text: String| Problem::of_file(path.display(), text);
        let Some(name) = path.file_name() else {
            return Err(fail("is no name of a new folder; write one".into()));
        };
        if fs::symlink_metadata(path).is_ok() {
            return Err(fail(
                "exists already and is left as it is; name a new folder, or remove this one first"
                    .into(),
            ));
        }
        let mut partial_name = std::ffi::OsString::from(".");
        partial_name.push(name);
        partial_name.push(format!(".{}.partial", std::process::id()));
        // A process of this number may have left its own there.
        let partial = free_name(&path.with_file_name(partial_name));
        fs::create_dir(&partial).map_err(|error| {
            fail(format!(
                "cannot be made ({error}); check that the folder it goes into exists and may be written"
            ))
        })?;
        Ok(Self {
            path: path.to_path_buf(),
            partial,
        })
    }

    /// Where its files are until it is finished.
    pub(super) fn partial(&self) -> &Path {
        &self.partial
    }

    /// Writes one file.
    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Problem> {
        fs::write(self.partial.join(name), bytes).map_err(|error| {
            let text = format!("cannot be written ({error}); check the free space");
            Problem::of_file(self.path.join(name).display(), text)
        })
    }

    /// Gives the folder its name.
    pub(super) fn finish(self) -> Result<(), Problem> {
        // A folder that came meanwhile is not replaced, unless it is empty.
        fs::rename(&self.partial, &self.path).map_err(|error| {
            let text = format!("cannot take its name ({error}); name a new folder");
            Problem::of_file(self.path.display(), text)
        })
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        // Finished, there is nothing to remove; otherwise a failure to remove has nobody left to be told to.
        let _ = fs::remove_dir_all(&self.partial);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_process_of_this_number_left_is_in_nobodys_way() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("part");
        let left = format!(".part.{}.partial", std::process::id());
        let left = directory.path().join(left);
        fs::create_dir(&left).unwrap();
        let folder = NewFolder::create(&path).unwrap();
        folder.write("part.ply", b"whole").unwrap();
        folder.finish().unwrap();
        assert!(path.join("part.ply").is_file() && left.is_dir());
    }
}
