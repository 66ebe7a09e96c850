//! The user's wish to end, for a task that waits for it: Ctrl-C, a terminal that is gone, or the system's SIGTERM. What holds a force looks at a
//! flag instead, [`taut_bridge::signals`].

/// Listens from its creation on: a signal before [`EndSignal::given`] is awaited is not lost.
#[derive(Debug)]
pub(super) struct EndSignal {
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
    /// None where it was ignored at the start, as by `nohup`.
    #[cfg(unix)]
    hangup: Option<tokio::signal::unix::Signal>,
}

impl EndSignal {
    /// Starts to listen; needs a tokio runtime around it.
    pub(super) fn listen() -> std::io::Result<Self> {
        #[cfg(unix)]
        {
            use tokio::signal::unix::{SignalKind, signal};
            let hangup = SignalKind::hangup();
            let is_ignored = taut_bridge::signals::is_ignored(hangup.as_raw_value());
            Ok(Self {
                terminate: signal(SignalKind::terminate())?,
                interrupt: signal(SignalKind::interrupt())?,
                hangup: (!is_ignored).then(|| signal(hangup)).transpose()?,
            })
        }
        #[cfg(not(unix))]
        Ok(Self {})
    }

    /// Returns when the end is asked for.
    pub(super) async fn given(&mut self) {
        #[cfg(unix)]
        {
            let Self {
                terminate,
                interrupt,
                hangup,
            } = self;
            let hangup = async {
                match hangup {
                    Some(signal) => signal.recv().await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                _ = terminate.recv() => {}
                _ = interrupt.recv() => {}
                _ = hangup => {}
            }
        }
        #[cfg(not(unix))]
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
    }
}
