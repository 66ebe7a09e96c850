//! The folder of the archives: all of them are written, or none.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::commands::keys::create_private;
use crate::shared::failure::Failure;

pub(super) struct Archive {
    pub(super) name: String,
    pub(super) content: Vec<u8>,
    /// For people.
    pub(super) holds: String,
}

/// Writes the archives into `folder`, and says whether anything is new. What is there already stays if it is the same, and is refused if it is not, unless
/// `force` says that it may be replaced.
pub(super) fn write(folder: &Path, archives: &[Archive], force: bool) -> Result<bool, Failure> {
    let mut wanted = Vec::new();
    for archive in archives {
        let path = folder.join(&archive.name);
        match fs::read(&path) {
            Ok(there) if there == archive.content => continue,
            Ok(_) if !force => {
                return Err(Failure::BadInput(format!(
                    "{} is there already and is another; give --force to replace it, or another --out",
                    path.display()
                )));
            }
            Ok(_) => {}
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => {
                return Err(Failure::BadInput(format!(
                    "{}: {error}; choose another --out",
                    path.display()
                )));
            }
        }
        wanted.push((path, archive));
    }
    if wanted.is_empty() {
        return Ok(false);
    }
    let is_new = !folder.exists();
    create_private(folder)?;
    let written = write_all(folder, &wanted);
    if written.is_err() && is_new {
        // It is empty then; if it is not, it stays.
        let _ = fs::remove_dir(folder);
    }
    written.map(|()| true)
}

/// Archives in the folder that none of these machines has: of one that was renamed or is gone.
pub(super) fn strays(folder: &Path, archives: &[Archive]) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Vec::new();
    };
    let is_stray = |name: &str| {
        name.starts_with("taut-")
            && name.ends_with(".tar.gz")
            && archives.iter().all(|archive| archive.name != name)
    };
    let mut strays: Vec<PathBuf> = entries
        .flatten()
        .filter(|entry| entry.file_name().to_str().is_some_and(is_stray))
        .map(|entry| entry.path())
        .collect();
    strays.sort();
    strays
}

/// All under other names first, which vanish by themselves if one fails; readable by this account alone, as secrets are in them.
fn write_all(folder: &Path, wanted: &[(PathBuf, &Archive)]) -> Result<(), Failure> {
    let fail = |error: std::io::Error| {
        Failure::Failed(format!(
            "{}: {error}; check its permissions and the free space",
            folder.display()
        ))
    };
    let mut written = Vec::new();
    for (path, archive) in wanted {
        let mut file = NamedTempFile::new_in(folder).map_err(fail)?;
        file.write_all(&archive.content).map_err(fail)?;
        file.as_file().sync_all().map_err(fail)?;
        written.push((file, path));
    }
    for (file, path) in written {
        file.persist(path).map_err(|error| fail(error.error))?;
    }
    Ok(())
}
