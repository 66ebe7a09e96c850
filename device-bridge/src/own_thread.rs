//! A thread that ends with its owner.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// A thread that the system does not start: what for, and what the system says.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cannot start a thread for {0}: {1}; end other programs or raise the limit")]
pub struct ThreadError(pub(crate) &'static str, pub(crate) String);

/// A thread that works for its owner. Dropping this tells it to end, and waits until it has.
#[derive(Debug)]
pub struct OwnThread {
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl OwnThread {
    /// Runs `body` in a thread of this name. It ends soon after the flag that it gets is set.
    ///
    /// # Errors
    /// No thread can be had.
    pub fn start(
        name: &str,
        body: impl FnOnce(&Arc<AtomicBool>) + Send + 'static,
    ) -> std::io::Result<Self> {
        let end = Arc::<AtomicBool>::default();
        let ended = Arc::clone(&end);
        let thread = thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || body(&ended))?;
        Ok(Self {
            end,
            thread: Some(thread),
        })
    }
}

impl Drop for OwnThread {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // If it broke down, it has said so, and there is nothing left to end.
            let _ = thread.join();
        }
    }
}
