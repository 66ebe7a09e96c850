//! Key files: the cluster key (64 hexadecimal digits) and credentials, readable by their owner only.

use crate::LinkError;
use std::{
    fs,
    io::{Error, ErrorKind, Write},
    path::{Path, PathBuf},
};
use taut_proto::{ClusterKey, Credential, JoinKey, credential::MAX_KEY_TEXT_BYTES};

/// Permission bits that no secret may have: everything for others, writing for the group. Reading by the group is left, so that a file of
/// root's can be read by a service through its group.
#[cfg(unix)]
const TOO_OPEN: u32 = 0o037;

/// Reads the file of the cluster key itself, for a server. A credential is refused: a server needs the master.
pub fn read_key_file(path: &Path) -> Result<ClusterKey, LinkError> {
    match read_join_key(path)? {
        JoinKey::Master(key) => Ok(key),
        JoinKey::Credential(credential) => Err(LinkError::KeyFile {
            path: path.to_owned(),
            reason: format!(
                "it is a credential (role: {}), which cannot serve or make others; give the cluster key",
                credential.role().title()
            ),
        }),
    }
}

/// Reads what a client joins with: the file of the cluster key, or of a credential.
///
/// Refused, as ssh does, if others may read it or anybody but its owner may write it.
pub fn read_join_key(path: &Path) -> Result<JoinKey, LinkError> {
    let refuse = |reason: String| key_file(path, reason);
    let unreadable = |error: Error| refuse(format!("{error}; {}", remedy_to_read(error.kind())));
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(refuse("it is a directory; name a file in it".to_owned()));
    }
    let length = metadata.len();
    if length > MAX_KEY_TEXT_BYTES as u64 {
        return Err(refuse(format!(
            "it has {length} bytes, no key has so many; name a file that `taut keys` made"
        )));
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = metadata.permissions().mode() & 0o777;
        if mode & TOO_OPEN != 0 {
            return Err(refuse(format!(
                "its permissions {mode:04o} let others use it; chmod 600 {}",
                path.display()
            )));
        }
    }
    let text = fs::read_to_string(path).map_err(unreadable)?;
    JoinKey::parse(&text).map_err(|error| refuse(error.to_string()))
}

/// Makes a fresh key and its file, mode 0600. An existing file is an error: a key in use is never overwritten.
pub fn create_key_file(path: &Path) -> Result<ClusterKey, LinkError> {
    let key = ClusterKey::generate().map_err(|error| key_file(path, error.to_string()))?;
    write_secret(path, &format!("{}\n", key.to_hex()))?;
    Ok(key)
}

/// Writes a credential into a new file, mode 0600.
pub fn write_credential_file(path: &Path, credential: &Credential) -> Result<(), LinkError> {
    write_secret(path, &credential.to_text())
}

fn write_secret(path: &Path, text: &str) -> Result<(), LinkError> {
    let mut options = fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        options.mode(0o600);
    }
    let mut file = options
        .open(path)
        .map_err(|error| key_file(path, format!("{error}; {}", remedy_to_make(error.kind()))))?;
    file.write_all(text.as_bytes())
        .map_err(|error| key_file(path, format!("{error}; free some space")))
}

/// What to do about a key file that cannot be read.
fn remedy_to_read(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::NotFound => "check the path; `taut keys`, on the haptic PC, makes key files",
        ErrorKind::PermissionDenied => "run as the account that owns it, or change its owner",
        ErrorKind::InvalidData => "name a file that `taut keys` made",
        _ => "check the path and the disk",
    }
}

/// What to do about a key file that cannot be made.
fn remedy_to_make(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::NotFound => "make its directory first, or choose another path",
        ErrorKind::AlreadyExists => {
            "a key in use is never overwritten: choose another path, or move that file away"
        }
        _ => "choose another path",
    }
}

fn key_file(path: &Path, reason: String) -> LinkError {
    LinkError::KeyFile {
        path: PathBuf::from(path),
        reason,
    }
}
