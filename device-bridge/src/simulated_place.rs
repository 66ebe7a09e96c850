//! The place in the file system where a simulated device is found: what a dead one left there is taken away, and nothing else.

use std::fs;
use std::io::{Error, ErrorKind, Result};
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::UnixDatagram;
use std::path::Path;

/// Makes room at `path`.
///
/// # Errors
/// Something else is there, or a simulated device that is still played.
pub(crate) fn make_room(path: &Path) -> Result<()> {
    let Ok(about) = fs::symlink_metadata(path) else {
        return Ok(());
    };
    let is_dead = if about.file_type().is_socket() {
        // Another program's socket, of another type or not ours to open, fails in another way.
        let refused = |error: Error| error.kind() == ErrorKind::ConnectionRefused;
        UnixDatagram::unbound()?.connect(path).is_err_and(refused)
    } else if about.is_symlink() && fs::read_link(path)?.starts_with("/dev/pts") {
        !path.exists()
    } else {
        let why =
            "something else than a simulated device is there; give another place, or move it away";
        return Err(Error::new(ErrorKind::AlreadyExists, why));
    };
    if is_dead {
        return fs::remove_file(path);
    }
    let why = "a simulated device seems to be played there; give another place, or end that one, or remove what it left";
    Err(Error::new(ErrorKind::AddrInUse, why))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_a_dead_device_left_is_taken_away() {
        let folder = tempfile::tempdir().expect("no temporary directory");
        let place = folder.path().join("place");
        assert!(make_room(&place).is_ok(), "nothing is there");

        let kind = || make_room(&place).map_err(|error| error.kind());
        assert!(fs::write(&place, "precious").is_ok());
        assert_eq!(kind(), Err(ErrorKind::AlreadyExists));
        assert!(fs::remove_file(&place).is_ok());
        assert!(std::os::unix::fs::symlink("/etc/hostname", &place).is_ok());
        assert_eq!(kind(), Err(ErrorKind::AlreadyExists));
        assert!(fs::remove_file(&place).is_ok());

        let bound = UnixDatagram::bind(&place).expect("no socket");
        assert_eq!(kind(), Err(ErrorKind::AddrInUse));
        drop(bound);
        assert!(place.symlink_metadata().is_ok());
        assert_eq!(kind(), Ok(()));
        assert!(place.symlink_metadata().is_err());

        let stream = std::os::unix::net::UnixListener::bind(&place).expect("no socket");
        assert_eq!(kind(), Err(ErrorKind::AddrInUse), "of another program");
        drop(stream);
        assert!(fs::remove_file(&place).is_ok());

        assert!(std::os::unix::fs::symlink("/dev/pts/999999", &place).is_ok());
        assert_eq!(kind(), Ok(()));
        assert!(place.symlink_metadata().is_err());
    }
}
