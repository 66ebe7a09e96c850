//! A simulated device behind a pseudo-terminal, in place of `/dev/ttyUSB0`.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::ioctl_fionbio;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use crate::own_thread::OwnThread;
use crate::realtime::monotonic_now;
use crate::simulated_place::make_room;

/// How often a thread that waits looks for the end.
const LOOK: Duration = Duration::from_millis(20);

/// What answers at the far end of a serial line.
pub trait FarEnd: Send + 'static {
    /// Takes bytes of the host at `now` (growing); what is answered is appended to `out`.
    fn take(&mut self, now: Duration, bytes: &[u8], out: &mut Vec<u8>);
}

/// A running device. Dropping it is pulling the cable.
pub struct PseudoTerminal<T> {
    device: Arc<Mutex<T>>,
    path: String,
    link: Option<PathBuf>,
    _thread: OwnThread,
}

impl<T: FarEnd> PseudoTerminal<T> {
    /// Opens a pseudo-terminal for a device, which may outlive its cable; `link` is a name for its path; that of a terminal that is gone is replaced.
    ///
    /// # Errors
    /// No pseudo-terminal, no thread, or the link cannot be made.
    pub fn start(device: Arc<Mutex<T>>, link: Option<&Path>) -> std::io::Result<Self> {
        // First: the terminal that is opened may be the one that a dead device's link names.
        link.map_or(Ok(()), make_room)?;
        let (master, path) = open()?;
        if let Some(link) = link {
            std::os::unix::fs::symlink(&path, link)?;
        }
        let answering = Arc::clone(&device);
        let thread = OwnThread::start("far-end", move |end| answer(master, &answering, end))?;
        Ok(Self {
            device,
            path,
            link: link.map(Path::to_owned),
            _thread: thread,
        })
    }

    /// Where people find it: its link, or else the terminal itself.
    #[must_use]
    pub fn place(&self) -> String {
        let link = self.link.as_ref().map(|link| link.display().to_string());
        link.unwrap_or_else(|| self.path.clone())
    }

    /// The device.
    pub fn device(&self) -> MutexGuard<'_, T> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> Drop for PseudoTerminal<T> {
    fn drop(&mut self) {
        if let Some(link) = &self.link {
            let _ = std::fs::remove_file(link);
        }
    }
}

/// The device's end, and the path of the driver's.
///
/// No other process inherits it: one that did would keep the cable in. It never waits: what nobody takes from a serial line is lost.
fn open() -> std::io::Result<(File, String)> {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
    ioctl_fionbio(&master, true)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let path = ptsname(&master, Vec::new())?;
    let path = path.into_string().map_err(std::io::Error::other)?;
    Ok((File::from(master), path))
}

/// Whether there is something to read; waits for [`LOOK`] at most.
fn is_readable(master: &File) -> bool {
    let within = Timespec {
        tv_sec: 0,
        tv_nsec: LOOK.subsec_nanos().into(),
    };
    let mut polled = [PollFd::new(master, PollFlags::IN)];
    let is_ready = poll(&mut polled, Some(&within)).is_ok_and(|count| count > 0);
    if is_ready && !polled[0].revents().contains(PollFlags::IN) {
        thread::sleep(LOOK); // nobody has opened the other end
        return false;
    }
    is_ready
}

fn answer<T: FarEnd>(mut master: File, device: &Mutex<T>, end: &AtomicBool) {
    let mut bytes = [0; 512];
    let mut out = Vec::with_capacity(512);
    while !end.load(Ordering::Relaxed) {
        if !is_readable(&master) {
            continue;
        }
        let Ok(count) = master.read(&mut bytes) else {
            thread::sleep(Duration::from_millis(1)); // the other end was closed, or its bytes were taken back, meanwhile
            continue;
        };
        out.clear();
        let mut device = device.lock().unwrap_or_else(PoisonError::into_inner);
        device.take(monotonic_now(), &bytes[..count], &mut out);
        drop(device);
        let _ = master.write_all(&out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Silent;

    impl FarEnd for Silent {
        fn take(&mut self, _now: Duration, _bytes: &[u8], _out: &mut Vec<u8>) {}
    }

    /// The system gives the number of a closed terminal to the next one.
    #[test]
    fn the_link_of_a_killed_device_is_replaced_though_its_terminal_is_opened_again() {
        let Ok(folder) = tempfile::tempdir() else {
            panic!("no temporary directory");
        };
        let link = folder.path().join("tty");
        let Ok((master, path)) = open() else {
            panic!("no pseudo-terminal");
        };
        drop(master);
        assert!(std::os::unix::fs::symlink(&path, &link).is_ok());
        let played = PseudoTerminal::start(Arc::new(Mutex::new(Silent)), Some(&link));
        let played = played.map(|played| played.place());
        assert!(
            played.is_ok_and(|place| Path::new(&place) == link),
            "{path}"
        );
    }
}
