//! Which key a command uses: the file that it is given, or the one that the environment names. A server needs the cluster key itself; whoever
//! joins may have a credential instead.

use std::path::{Path, PathBuf};

use taut_link::{ClusterKey, JoinKey, read_join_key, read_key_file};

use crate::shared::failure::Failure;

/// Name of the variable that names the key file.
pub(super) const KEY_VARIABLE: &str = "TAUT_KEY_FILE";

/// Reads the cluster key from `named`, else from the file that [`KEY_VARIABLE`] names.
pub(super) fn read(named: Option<&Path>) -> Result<ClusterKey, Failure> {
    let file = file(named).ok_or_else(|| {
        Failure::BadInput(format!(
            "no cluster key is named: make one with `taut keys --out FILE`, and give it by --key FILE or {KEY_VARIABLE}"
        ))
    })?;
    Ok(read_key_file(&file)?)
}

/// Reads what to join with, the cluster key or a credential, from `named`, else from the file that [`KEY_VARIABLE`] names.
pub(super) fn read_to_join(named: Option<&Path>) -> Result<JoinKey, Failure> {
    let file = file(named).ok_or_else(|| {
        Failure::BadInput(format!(
            "no credential is named: give the one that `taut keys` made for this on the haptic PC by --key FILE or {KEY_VARIABLE}"
        ))
    })?;
    Ok(read_join_key(&file)?)
}

fn file(named: Option<&Path>) -> Option<PathBuf> {
    let from_environment = || {
        std::env::var_os(KEY_VARIABLE)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    named.map(Path::to_path_buf).or_else(from_environment)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::failure::EXIT_BAD_INPUT;

    #[test]
    fn a_file_that_is_missing_or_no_key_is_bad_input_and_is_named() {
        let directory = tempfile::tempdir().expect("no temporary directory");
        let path = directory.path().join("short.key");
        assert!(std::fs::write(&path, "abc").is_ok());
        for path in [path, directory.path().join("missing.key")] {
            let Err(failure) = read(Some(&path)) else {
                panic!("{} was taken for a key", path.display());
            };
            assert_eq!(failure.exit_code(), EXIT_BAD_INPUT);
            assert!(failure.to_string().contains(".key"), "{failure}");
        }
    }
}
