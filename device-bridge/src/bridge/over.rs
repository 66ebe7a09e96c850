//! When a bridge is to end: asked for by a signal or its caller, or because its time is over.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::WATCH_PERIOD;
use crate::realtime::monotonic_now;

/// When the bridge is to end.
pub(super) struct Over {
    pub(super) stop: Arc<AtomicBool>,
    /// On the monotonic clock.
    pub(super) deadline: Option<Duration>,
}

impl Over {
    pub(super) fn is_asked(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    pub(super) fn is_now(&self) -> bool {
        self.is_asked()
            || self
                .deadline
                .is_some_and(|deadline| monotonic_now() >= deadline)
    }

    /// The outcome of `work`; `None` if the end comes first.
    pub(super) async fn or<T>(&self, work: impl Future<Output = T>) -> Option<T> {
        let ended = async {
            while !self.is_now() {
                tokio::time::sleep(WATCH_PERIOD).await;
            }
        };
        tokio::select! {
            outcome = work => Some(outcome),
            () = ended => None,
        }
    }
}

pub(super) async fn stop_on_signal(stop: Arc<AtomicBool>) {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let Ok(mut terminate) = signal(SignalKind::terminate()) else {
            return;
        };
        tokio::select! {
            _ = tokio::signal::ctrl_c() => {}
            _ = terminate.recv() => {}
        }
    }
    #[cfg(not(unix))]
    let _ = tokio::signal::ctrl_c().await;
    stop.store(true, Ordering::Relaxed);
}
