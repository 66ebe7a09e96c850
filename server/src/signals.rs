//! The user's wish to end: Ctrl-C, or the system's SIGTERM.

use std::time::Duration;

use crate::shutdown::Shutdown;

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

/// The same for a thread that is not in a tokio runtime.
#[derive(Debug)]
pub struct BlockingEndSignal {
    runtime: tokio::runtime::Runtime,
    signal: EndSignal,
}

impl BlockingEndSignal {
    /// Starts to listen.
    pub fn listen() -> std::io::Result<Self> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()?;
        let signal = {
            let _inside = runtime.enter();
            EndSignal::listen()?
        };
        Ok(Self { runtime, signal })
    }

    /// Waits for the signal, at most `time`; whether it was given.
    pub fn wait(&mut self, time: Duration) -> bool {
        let given = self.signal.given();
        self.runtime
            .block_on(async { tokio::time::timeout(time, given).await.is_ok() })
    }

    /// Turns it into a request that can be looked at without waiting.
    pub fn into_request(mut self) -> std::io::Result<Shutdown> {
        let shutdown = Shutdown::default();
        let asked = shutdown.clone();
        // The thread ends with the process.
        std::thread::Builder::new()
            .name("signals".into())
            .spawn(move || {
                self.runtime.block_on(self.signal.given());
                asked.ask();
            })?;
        Ok(shutdown)
    }
}
