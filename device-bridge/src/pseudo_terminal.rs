//! A simulated device behind a pseudo-terminal, in place of `/dev/ttyUSB0`.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

use crate::realtime::monotonic_now;

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
    end: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<()>>,
}

impl<T: FarEnd> PseudoTerminal<T> {
    /// Opens a pseudo-terminal; `link` is a name for its path, replaced where there is one.
    ///
    /// # Errors
    /// No pseudo-terminal, no thread, or the link cannot be made.
    pub fn start(device: T, link: Option<&Path>) -> std::io::Result<Self> {
        Self::start_shared(Arc::new(Mutex::new(device)), link)
    }

    /// The same with a device that outlives its cable.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub fn start_shared(device: Arc<Mutex<T>>, link: Option<&Path>) -> std::io::Result<Self> {
        let (mut master, slave) = TTYPort::pair().map_err(std::io::Error::from)?;
        let path = slave.name().unwrap_or_default();
        drop(slave); // it is locked: the driver opens the path itself
        if let Some(link) = link {
            let _ = std::fs::remove_file(link); // most often there is none
            std::os::unix::fs::symlink(&path, link)?;
        }
        master.set_timeout(LOOK).map_err(std::io::Error::from)?;
        let end = Arc::new(AtomicBool::new(false));
        let (ended, answering) = (Arc::clone(&end), Arc::clone(&device));
        let thread = thread::Builder::new()
            .name("far-end".to_owned())
            .spawn(move || answer(master, &answering, &ended))?;
        Ok(Self {
            device,
            path,
            link: link.map(Path::to_owned),
            end,
            thread: Some(thread),
        })
    }

    /// Of the terminal.
    #[must_use]
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The device.
    pub fn device(&self) -> MutexGuard<'_, T> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> Drop for PseudoTerminal<T> {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        if let Some(link) = &self.link {
            let _ = std::fs::remove_file(link);
        }
    }
}

fn answer<T: FarEnd>(mut master: TTYPort, device: &Mutex<T>, end: &AtomicBool) {
    let mut bytes = [0; 512];
    let mut out = Vec::with_capacity(512);
    while !end.load(Ordering::Relaxed) {
        let count = match master.read(&mut bytes) {
            Ok(count) => count,
            Err(error) if error.kind() == std::io::ErrorKind::TimedOut => continue,
            Err(_) => {
                thread::sleep(LOOK); // nobody has opened the other end
                continue;
            }
        };
        out.clear();
        let mut device = device.lock().unwrap_or_else(PoisonError::into_inner);
        device.take(monotonic_now(), &bytes[..count], &mut out);
        drop(device);
        if master.write_all(&out).is_err() {
            thread::sleep(LOOK);
        }
    }
}
