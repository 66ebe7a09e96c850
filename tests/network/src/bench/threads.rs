//! Where a measurement runs: a thread of its own, whose class is not its caller's, and the runtime of its links.

use std::thread::JoinHandle;

use tokio::runtime::Runtime;

use super::BenchError;

/// Runs a measurement on a thread of its own. Threads inherit the class of the one that makes them: what asks for the real-time class there gets it
/// for all that it starts, and nobody else does.
pub(super) fn on_own_thread<T: Send>(
    name: &str,
    measurement: impl FnOnce() -> Result<T, BenchError> + Send,
) -> Result<T, BenchError> {
    std::thread::scope(|scope| {
        let run = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn_scoped(scope, measurement)?;
        run.join()
            .unwrap_or_else(|_| Err(BenchError::Missing(format!("the thread `{name}` panicked"))))
    })
}

/// What a thread ended with.
pub(super) fn joined<T>(thread: JoinHandle<T>) -> Result<T, BenchError> {
    let name = thread.thread().name().unwrap_or_default().to_owned();
    let panicked = |_| BenchError::Missing(format!("the thread `{name}` panicked"));
    thread.join().map_err(panicked)
}

/// A runtime for links with so many threads.
pub(crate) fn runtime(threads: usize) -> Result<Runtime, BenchError> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(threads)
        .enable_all()
        .build()?;
    Ok(runtime)
}
