//! The user's wish to end: Ctrl-C, or the system's SIGTERM.

/// Listens from its creation on: a signal before [`EndSignal::given`] is awaited is not lost.
#[derive(Debug)]
pub struct EndSignal {
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
}

impl EndSignal {
    /// Starts to listen; needs a tokio runtime around it.
    pub fn listen() -> std::io::Result<Self> {
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
    pub async fn given(&mut self) {
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

/// The same for commands that run without tokio: a request to end that a signal makes.
pub fn watch() -> std::io::Result<crate::shutdown::Shutdown> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let mut signal = {
        let _inside = runtime.enter();
        EndSignal::listen()?
    };
    let shutdown = crate::shutdown::Shutdown::default();
    let asked = shutdown.clone();
    // The thread ends with the process.
    std::thread::Builder::new().name("signals".into()).spawn(move || {
        runtime.block_on(signal.given());
        asked.ask();
    })?;
    Ok(shutdown)
}
