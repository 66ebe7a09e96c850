//! The thread that has a session with Zenoh's routers.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use zenoh::{Config, Session, Wait};

use crate::publisher::ZenohError;

/// Time between two attempts to reach a router.
const RETRY_PERIOD: Duration = Duration::from_secs(1);

/// A thread with a session of its own. Dropped, it ends.
#[derive(Debug)]
pub(crate) struct Routers {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Routers {
    /// Has `work` done once a router is reached, on a thread of this name; its flag says when to end.
    pub(crate) fn reach(
        name: &str,
        config: Config,
        work: impl FnOnce(&Session, &AtomicBool) + Send + 'static,
    ) -> Result<Self, ZenohError> {
        let stop = Arc::<AtomicBool>::default();
        let stopping = stop.clone();
        let thread = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                if let Some(session) = open(&config, &stopping) {
                    work(&session, &stopping);
                    // It ends with this thread; a router that does not hear of it notices.
                    let _ = session.close().wait();
                }
            })?;
        Ok(Self {
            stop,
            thread: Some(thread),
        })
    }
}

impl Drop for Routers {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic of it is no fault of the loops; it has been printed.
            let _ = thread.join();
        }
    }
}

/// Zenoh's configuration: the file's, as a client of routers that listens nowhere and looks for nobody by itself.
pub(crate) fn client_config(connect: &[String], file: Option<&Path>) -> Result<Config, ZenohError> {
    let read = || {
        let mut config = match file {
            Some(path) => Config::from_file(path)?,
            None => Config::default(),
        };
        config.insert_json5("mode", "\"client\"")?;
        config.insert_json5("scouting/multicast/enabled", "false")?;
        if !connect.is_empty() {
            let routers: Vec<String> = connect.iter().map(|r| format!("{r:?}")).collect();
            config.insert_json5("connect/endpoints", &format!("[{}]", routers.join(",")))?;
        }
        zenoh::Result::Ok(config)
    };
    read().map_err(|error| ZenohError::Config(error.to_string()))
}

/// The session with a router; `None` where the end came before one was reached.
fn open(config: &Config, stop: &AtomicBool) -> Option<Session> {
    let mut warned = false;
    while !stop.load(Ordering::Relaxed) {
        match zenoh::open(config.clone()).wait() {
            Ok(session) => return Some(session),
            Err(error) if !warned => {
                tracing::warn!("[zenoh] reaches no router and goes on trying: {error}");
                warned = true;
            }
            Err(_) => {}
        }
        sleep_until(Instant::now() + RETRY_PERIOD, stop);
    }
    None
}

/// Sleeps in pieces that keep the end from waiting.
pub(crate) fn sleep_until(end: Instant, stop: &AtomicBool) {
    const PIECE: Duration = Duration::from_millis(100);
    while !stop.load(Ordering::Relaxed) {
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return;
        }
        std::thread::sleep(left.min(PIECE));
    }
}
