//! A server's stream of small states, one per millisecond, on a thread of its own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use taut_link::ServerLink;

use super::threads::joined;
use super::{BenchError, Ticker, state};

/// The stream while it is not ended; it goes on where this is dropped.
pub(super) struct StateStream {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl StateStream {
    pub(super) fn start(server: &ServerLink) -> Result<StateStream, BenchError> {
        let stop = Arc::new(AtomicBool::new(false));
        let (over, mut broadcaster, clock) = (stop.clone(), server.broadcaster(), server.clock());
        let run = move || {
            let (mut tick, mut ticker) = (0, Ticker::new(Duration::from_millis(1)));
            while !over.load(Ordering::Relaxed) {
                ticker.wait();
                tick += 1;
                let _ = broadcaster.send(&state(tick, clock.now_ns(), false));
            }
        };
        let thread = std::thread::Builder::new()
            .name("states".to_owned())
            .spawn(run)?;
        Ok(StateStream { stop, thread })
    }

    /// Ends it; an error where its thread panicked.
    pub(super) fn end(self) -> Result<(), BenchError> {
        self.stop.store(true, Ordering::Relaxed);
        joined(self.thread)
    }
}
