//! The user's wish to end, for a task that waits for it: Ctrl-C, or the system's SIGTERM. What holds a force looks at a flag instead,
//! [`taut_bridge::signals`].

/// Listens from its creation on: a signal before [`EndSignal::given`] is awaited is not lost.
#[derive(Debug)]
pub(super) struct EndSignal {
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
}

impl EndSignal {
    /// Starts to listen; needs a tokio runtime around it.
    pub(super) fn listen() -> std::io::Result<Self> {
        #[cfg(unix)]
        {
            use tokio::signal::unix::{SignalKind, signal};
            Ok(Self {
                terminate: signal(SignalKind::terminate())?,
                interrupt: signal(SignalKind::interrupt())?,
            })
        }
        #[cfg(not(unix))]
        Ok(Self {})
    }

    /// Returns when the end is asked for.
    pub(super) async fn given(&mut self) {
        #[cfg(unix)]
        tokio::select! {
            _ = self.terminate.recv() => {}
            _ = self.interrupt.recv() => {}
        }
        #[cfg(not(unix))]
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
    }
}
