//! Key files: the cluster key (64 hexadecimal digits) and credentials. What they hold is a secret on disk and in memory: nobody else may read the
//! file or put another in its place, the text is wiped when it has been read, and no core dump of the program is written.

use crate::LinkError;
use std::{
    fs,
    io::{Error, ErrorKind, Read, Write},
    path::{Path, PathBuf},
};
use taut_proto::{ClusterKey, Credential, JoinKey, credential::MAX_KEY_TEXT_BYTES};
use zeroize::Zeroizing;

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
/// Refused, as ssh does, unless it is a secret: see [`check_secret_file`].
pub fn read_join_key(path: &Path) -> Result<JoinKey, LinkError> {
    let refuse = |reason: String| key_file(path, reason);
    let unreadable = |error: Error| refuse(format!("{error}; {}", remedy_to_read(error.kind())));
    let file = fs::File::open(path).map_err(unreadable)?;
    let metadata = file.metadata().map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(refuse("it is a directory; name a file in it".to_owned()));
    }
    let length = metadata.len();
    if length > MAX_KEY_TEXT_BYTES as u64 {
        return Err(refuse(format!(
            "it has {length} bytes, no key has so many; name a file that `taut keys` made"
        )));
    }
    check_secret(path, &metadata).map_err(refuse)?;
    // Of its full size at once: what grows leaves copies behind.
    let mut text = Zeroizing::new(String::with_capacity(MAX_KEY_TEXT_BYTES));
    file.take(MAX_KEY_TEXT_BYTES as u64)
        .read_to_string(&mut text)
        .map_err(unreadable)?;
    JoinKey::parse(&text).map_err(|error| refuse(error.to_string()))
}

/// Refuses a file of a secret that somebody else could read or replace: others have rights on it, it belongs to neither this account nor root,
/// or others may write in its directory. The error says what to do.
pub fn check_secret_file(path: &Path) -> Result<(), String> {
    let metadata = fs::metadata(path).map_err(|error| error.to_string())?;
    check_secret(path, &metadata)
}

#[cfg(unix)]
fn check_secret(path: &Path, metadata: &fs::Metadata) -> Result<(), String> {
    use std::os::unix::fs::MetadataExt;
    /// Set on a directory such as /tmp: only the owner of a file may replace it.
    const STICKY: u32 = 0o1000;
    const OTHERS_WRITE: u32 = 0o002;
    let mode = metadata.mode() & 0o777;
    if mode & TOO_OPEN != 0 {
        return Err(format!(
            "its permissions {mode:04o} let others use it; chmod 600 {}",
            path.display()
        ));
    }
    #[allow(unsafe_code, reason = "the account is asked by a system call")]
    // SAFETY: takes nothing and never fails.
    let me = unsafe { libc::geteuid() };
    let is_trusted = |owner: u32| owner == me || owner == 0;
    if !is_trusted(metadata.uid()) {
        return Err(format!(
            "it belongs to user {}, who can change it: it must belong to this account (user {me}) or root; chown {me} {}",
            metadata.uid(),
            path.display()
        ));
    }
    // Where the file itself is, if the path leads there by a link.
    let real = path.canonicalize().map_err(|error| error.to_string())?;
    let directory = real.parent().unwrap_or(Path::new("/"));
    let about = fs::metadata(directory).map_err(|error| error.to_string())?;
    let others_replace = about.mode() & OTHERS_WRITE != 0 && about.mode() & STICKY == 0;
    if others_replace || !is_trusted(about.uid()) {
        return Err(format!(
            "others can put another file in its place, because its directory {} is theirs or open to them (user {}, mode {:04o}); move it to a directory of this account with mode 0755 or less",
            directory.display(),
            about.uid(),
            about.mode() & 0o7777
        ));
    }
    Ok(())
}

#[cfg(not(unix))]
fn check_secret(_path: &Path, _metadata: &fs::Metadata) -> Result<(), String> {
    Ok(())
}

/// Keeps the memory of this process, in which keys are, out of core dumps and from other programs of this account (`ptrace`, `/proc/PID/mem`).
/// For the start of a program; `false` where the system has no such thing.
pub fn keep_memory_private() -> bool {
    #[cfg(target_os = "linux")]
    {
        let none = libc::rlimit {
            rlim_cur: 0,
            rlim_max: 0,
        };
        #[allow(unsafe_code, reason = "limits of the process are system calls")]
        // SAFETY: `none` is valid for the call; the other takes numbers only.
        unsafe {
            let limited = libc::setrlimit(libc::RLIMIT_CORE, &raw const none) == 0;
            limited && libc::prctl(libc::PR_SET_DUMPABLE, 0 as libc::c_ulong, 0, 0, 0) == 0
        }
    }
    #[cfg(not(target_os = "linux"))]
    false
}

/// Makes a fresh key and its file, mode 0600. An existing file is an error: a key in use is never overwritten.
pub fn create_key_file(path: &Path) -> Result<ClusterKey, LinkError> {
    let key = ClusterKey::generate().map_err(|error| key_file(path, error.to_string()))?;
    let text = Zeroizing::new(key.to_hex() + "\n");
    write_secret(path, &text)?;
    Ok(key)
}

/// Writes a credential into a new file, mode 0600.
pub fn write_credential_file(path: &Path, credential: &Credential) -> Result<(), LinkError> {
    write_secret(path, &Zeroizing::new(credential.to_text()))
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

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::{PermissionsExt, chown};

    fn reason(path: &Path) -> String {
        match read_join_key(path) {
            Err(LinkError::KeyFile { reason, .. }) => reason,
            other => panic!("{other:?}"),
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_memory_of_a_program_that_asks_is_its_own() {
        assert!(keep_memory_private());
        #[allow(unsafe_code, reason = "the process is asked by a system call")]
        // SAFETY: takes numbers only.
        let dumpable = unsafe { libc::prctl(libc::PR_GET_DUMPABLE, 0 as libc::c_ulong, 0, 0, 0) };
        assert_eq!(dumpable, 0);
        let limits = fs::read_to_string("/proc/self/limits").expect("Linux");
        let core = limits
            .lines()
            .find(|line| line.starts_with("Max core file size"));
        let words: Vec<&str> = core.unwrap_or_default().split_whitespace().collect();
        assert_eq!(words[4..6], ["0", "0"], "{core:?}");
    }

    #[test]
    fn a_key_that_somebody_else_could_replace_is_refused_with_what_to_do() {
        let folder = tempfile::tempdir().expect("a directory");
        let path = folder.path().join("cluster.key");
        create_key_file(&path).expect("made");
        assert!(read_join_key(&path).is_ok());
        let set = |path: &Path, mode| {
            fs::set_permissions(path, fs::Permissions::from_mode(mode)).expect("set");
        };

        set(&path, 0o604);
        assert!(reason(&path).contains("chmod 600"));
        set(&path, 0o600);

        set(folder.path(), 0o777);
        let text = reason(&path);
        assert!(
            text.contains("another file in its place") && text.contains("0777"),
            "{text}"
        );
        set(folder.path(), 0o1777);
        assert!(read_join_key(&path).is_ok(), "as in /tmp");
        set(folder.path(), 0o755);

        // Only root can give a file away.
        if chown(&path, Some(4711), None).is_ok() {
            let text = reason(&path);
            assert!(
                text.contains("user 4711") && text.contains("chown"),
                "{text}"
            );
        }
    }
}
