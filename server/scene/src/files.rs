//! Reading whole files, with a limit on their size, and finding data files.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::problem::Problem;

/// Largest scene or workbench file, bytes. They are written by hand; a megabyte is a mistake.
pub const MAX_TOML_BYTES: u64 = 1 << 20;
/// Largest mesh file, bytes: some ten million triangles, more than the memory of a workbench is for.
pub const MAX_MESH_BYTES: u64 = 1 << 29;

/// Name of the variable that names the data directory.
pub const DATA_VARIABLE: &str = "TAUT_DATA";

/// The whole file, or a sentence that says why not.
pub(crate) fn read_bytes(path: &Path, limit: u64) -> Result<Vec<u8>, Problem> {
    let fail = |reason: String| Problem::of_file(path.display(), reason);
    let file =
        File::open(path).map_err(|e| fail(format!("cannot be opened ({e}); check the path")))?;
    if file.metadata().is_ok_and(|m| m.is_dir()) {
        return Err(fail(
            "is a directory, but a file is needed; name the file".into(),
        ));
    }
    let mut bytes = Vec::new();
    file.take(limit + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| fail(format!("cannot be read ({e}); check its permissions")))?;
    if bytes.len() as u64 > limit {
        return Err(fail(format!(
            "is larger than the limit of {limit} bytes; is it the right file?"
        )));
    }
    Ok(bytes)
}

/// The whole file as text, or a sentence that says why not.
pub(crate) fn read_text(path: &Path, limit: u64) -> Result<String, Problem> {
    String::from_utf8(read_bytes(path, limit)?).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()]
            .iter()
            .filter(|b| **b == b'\n')
            .count();
        Problem::at_line(path.display(), line, "is not UTF-8 text; save it as UTF-8")
    })
}

/// The directories where meshes and traces are looked for that are not beside their scene, those that exist, in this
/// order: `$TAUT_DATA` (then no other), `data` in the project, `data` in the working directory, `shared/data` beside the
/// project, `../shared/data` seen from the working directory.
pub fn data_dirs() -> Vec<PathBuf> {
    if let Some(named) = std::env::var_os(DATA_VARIABLE).filter(|v| !v.is_empty()) {
        return vec![PathBuf::from(named)];
    }
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let candidates = [
        project.join("data"),
        PathBuf::from("data"),
        project.join("../shared/data"),
        PathBuf::from("../shared/data"),
    ];
    let mut found: Vec<PathBuf> = Vec::new();
    for directory in candidates {
        // Tidy paths in messages, and the same directory only once.
        let Ok(directory) = directory.canonicalize() else {
            continue;
        };
        if directory.is_dir() && !found.contains(&directory) {
            found.push(directory);
        }
    }
    found
}

/// The first of [`data_dirs`], if there is any.
pub fn data_dir() -> Option<PathBuf> {
    data_dirs().into_iter().next()
}

/// The first data directory's file of this relative name that exists.
pub fn data_file(name: impl AsRef<Path>) -> Option<PathBuf> {
    data_dirs()
        .into_iter()
        .map(|directory| directory.join(name.as_ref()))
        .find(|path| path.is_file())
}
