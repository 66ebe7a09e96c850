//! The served end of the stream: rerun's own server behind a bounded queue.
//!
//! rerun's server waits for its slowest observer, and with it everything that feeds it, a recording too. Here a
//! thread of its own feeds it from a bounded queue; when an observer stalls (a laptop put to sleep), the queue fills,
//! further messages are dropped and counted, and the rest goes on.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};

use crate::error::MonitorError;

/// Messages that wait for a slow observer: some seconds, on top of the seconds that rerun keeps itself.
const MESSAGE_CAPACITY: usize = 1024;
/// How long the end waits for what is still queued; a stalled observer must not hold up the server's exit.
const DRAIN_TIMEOUT: Duration = Duration::from_secs(2);

/// Feeds rerun's server without ever waiting for it.
pub(crate) struct ServedSink {
    messages: Option<SyncSender<LogMsg>>,
    drained: Mutex<Receiver<()>>, // a sink must be `Sync`; only `drop` takes it
    dropped: Arc<AtomicU64>,
}

impl ServedSink {
    /// Starts the feeding thread; `dropped` counts the messages that no observer gets.
    pub(crate) fn new(
        server: impl LogSink,
        dropped: Arc<AtomicU64>,
    ) -> Result<ServedSink, MonitorError> {
        let (messages, queued) = sync_channel::<LogMsg>(MESSAGE_CAPACITY);
        let (on_drained, drained) = sync_channel(1);
        std::thread::Builder::new()
            .name("taut-monitor-feed".to_owned())
            .spawn(move || {
                for message in queued {
                    server.send(message);
                }
                // Closes the port, then says so; nobody may be waiting any more.
                drop(server);
                let _ = on_drained.send(());
            })
            .map_err(MonitorError::Thread)?;
        Ok(ServedSink {
            messages: Some(messages),
            drained: Mutex::new(drained),
            dropped,
        })
    }
}

impl LogSink for ServedSink {
    fn send(&self, message: LogMsg) {
        let taken = self
            .messages
            .as_ref()
            .is_some_and(|messages| messages.try_send(message).is_ok());
        if !taken {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        Ok(()) // Observers get what they get: nothing here may wait for them.
    }
}

impl Drop for ServedSink {
    fn drop(&mut self) {
        self.messages = None;
        // On a timeout the thread is left to end with the observer or the process.
        if let Ok(drained) = self.drained.get_mut() {
            let _ = drained.recv_timeout(DRAIN_TIMEOUT);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A server whose only observer never reads.
    struct Stalled;

    impl LogSink for Stalled {
        fn send(&self, _message: LogMsg) {
            loop {
                std::thread::park();
            }
        }

        fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
            Ok(())
        }
    }

    #[test]
    fn a_stalled_observer_costs_messages_but_no_time() {
        let (stream, stored) = rerun::RecordingStreamBuilder::new("test").memory().unwrap();
        stream.log("text", &rerun::TextLog::new("text")).unwrap();
        let message = stored.take().pop().unwrap();

        let dropped = Arc::new(AtomicU64::new(0));
        let sink = ServedSink::new(Stalled, Arc::clone(&dropped)).unwrap();
        for _ in 0..2 * MESSAGE_CAPACITY {
            sink.send(message.clone());
        }
        drop(sink); // Ends although the observer still does not read.
        // One message is stuck in the server, the queue is full of others.
        let stuck = dropped.load(Ordering::Relaxed) as usize + MESSAGE_CAPACITY;
        assert!(
            (2 * MESSAGE_CAPACITY - 1..=2 * MESSAGE_CAPACITY).contains(&stuck),
            "{stuck}"
        );
    }
}
