//! One node as a process: joins a server, takes states for some time, and says what it got. For networks of namespaces or of real machines.

use std::path::Path;
use std::time::{Duration, Instant};

use taut_link::Transport;
use tokio::runtime::Runtime;

use super::client_process::member;
use super::{BenchError, Quantiles};

/// Time between two looks at what came.
const LOOK: Duration = Duration::from_millis(5);

/// What a node got.
#[derive(Clone, Copy, Debug)]
pub struct Got {
    /// States taken.
    pub states: u64,
    /// Datagrams missing in the sequence.
    pub lost: u64,
    /// Datagrams that were not what the server sealed.
    pub refused: u64,
    /// States out of order: must be 0.
    pub disordered: u64,
    /// From sampling to arrival, by the clock of the session as this node knows it, ms.
    pub latency_ms: Quantiles,
    /// Uncertainty of that clock at the end, ms.
    pub clock_ms: f64,
    /// Time to join, s.
    pub joined_s: f64,
}

/// Joins and takes states for `duration`.
pub fn run(
    server: &str,
    node: &str,
    transport: Transport,
    key: &Path,
    duration: Duration,
) -> Result<Got, BenchError> {
    let runtime = Runtime::new()?;
    let key = taut_link::read_key_file(key)?;
    let start = Instant::now();
    let link = member(&runtime, server, &key, node, transport)?;
    let joined_s = start.elapsed().as_secs_f64();
    let (mut states, mut latencies) = (Vec::new(), Vec::new());
    let (mut count, mut disordered, mut newest) = (0, 0, 0);
    let start = Instant::now();
    while start.elapsed() < duration {
        std::thread::sleep(LOOK);
        if let Some(reason) = link.is_closed() {
            let what = format!("{node} was thrown out: {reason}");
            return Err(BenchError::Missing(what));
        }
        link.drain_states(&mut states);
        for received in states.drain(..) {
            count += 1;
            disordered += u64::from(received.state.tick <= newest);
            newest = received.state.tick;
            if let Some(time) = link.session_at(received.received) {
                let sampled = received.state.sample_time_ns as f64;
                latencies.push((time.ns as f64 - sampled) * 1e-6);
            }
        }
    }
    let counters = link.counters();
    let clock_ms = link
        .session_now()
        .map_or(f64::NAN, |time| time.uncertainty_ns as f64 * 1e-6);
    runtime.block_on(link.close());
    Ok(Got {
        states: count,
        lost: counters.lost,
        refused: counters.garbage + counters.forged + counters.wrong_version,
        disordered,
        latency_ms: Quantiles::of(latencies),
        clock_ms,
        joined_s,
    })
}
