//! The cluster key's file: 64 hexadecimal digits, readable by its owner only.

use crate::LinkError;
use std::{fs, io::Write, path::Path};
use taut_proto::ClusterKey;

/// Most bytes of a key file: the digits and some blanks.
const MAX_KEY_FILE_BYTES: u64 = 4096;

/// Reads a key file.
pub fn read_key_file(path: &Path) -> Result<ClusterKey, LinkError> {
    let refuse = |reason: String| LinkError::KeyFile {
        path: path.to_owned(),
        reason,
    };
    let length = fs::metadata(path)
        .map_err(|error| refuse(format!("{error}; copy it from the server")))?
        .len();
    if length > MAX_KEY_FILE_BYTES {
        return Err(refuse(format!(
            "it has {length} bytes where a key has 64 digits; copy it from the server"
        )));
    }
    let text = fs::read_to_string(path)
        .map_err(|error| refuse(format!("{error}; copy it from the server")))?;
    ClusterKey::parse(&text).map_err(|error| refuse(error.to_string()))
}

/// Makes a fresh key and its file, mode 0600. An existing file is an error: a key in use is never overwritten.
pub fn create_key_file(path: &Path) -> Result<ClusterKey, LinkError> {
    let refuse = |reason: String| LinkError::KeyFile {
        path: path.to_owned(),
        reason,
    };
    let key = ClusterKey::generate().map_err(|error| refuse(error.to_string()))?;
    let mut options = fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        options.mode(0o600);
    }
    let mut file = options
        .open(path)
        .map_err(|error| refuse(format!("{error}; choose another path")))?;
    writeln!(file, "{}", key.to_hex())
        .map_err(|error| refuse(format!("{error}; free some space")))?;
    Ok(key)
}
