//! Simulated boards behind a pseudo-terminal, in place of `/dev/ttyUSB0`.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

use super::simulated::SimulatedBoards;
use crate::realtime::monotonic_now;

/// How often a thread that waits looks for the end.
const LOOK: Duration = Duration::from_millis(20);

/// Running boards. Dropping it is pulling the cable.
pub struct BoardsTerminal {
    boards: Arc<Mutex<SimulatedBoards>>,
    path: String,
    link: Option<PathBuf>,
    end: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<()>>,
}

impl BoardsTerminal {
    /// Opens a pseudo-terminal; `link` is a name for its path, replaced where there is one.
    ///
    /// # Errors
    /// No pseudo-terminal, no thread, or the link cannot be made.
    pub fn start(boards: SimulatedBoards, link: Option<&Path>) -> std::io::Result<Self> {
        Self::start_shared(Arc::new(Mutex::new(boards)), link)
    }

    /// The same with boards that outlive their cable.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub fn start_shared(
        boards: Arc<Mutex<SimulatedBoards>>,
        link: Option<&Path>,
    ) -> std::io::Result<Self> {
        let (mut master, slave) = TTYPort::pair().map_err(std::io::Error::from)?;
        let path = slave.name().unwrap_or_default();
        drop(slave); // it is locked: the driver opens the path itself
        if let Some(link) = link {
            let _ = std::fs::remove_file(link); // most often there is none
            std::os::unix::fs::symlink(&path, link)?;
        }
        master.set_timeout(LOOK).map_err(std::io::Error::from)?;
        let end = Arc::new(AtomicBool::new(false));
        let (ended, answering) = (Arc::clone(&end), Arc::clone(&boards));
        let thread = thread::Builder::new()
            .name("spidar-boards".to_owned())
            .spawn(move || answer(master, &answering, &ended))?;
        Ok(Self {
            boards,
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

    /// The boards.
    pub fn boards(&self) -> MutexGuard<'_, SimulatedBoards> {
        self.boards.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for BoardsTerminal {
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

fn answer(mut master: TTYPort, boards: &Mutex<SimulatedBoards>, end: &AtomicBool) {
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
        let mut boards = boards.lock().unwrap_or_else(PoisonError::into_inner);
        boards.take(monotonic_now(), &bytes[..count], &mut out);
        drop(boards);
        if master.write_all(&out).is_err() {
            thread::sleep(LOOK);
        }
    }
}
