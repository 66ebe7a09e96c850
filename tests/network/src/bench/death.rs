//! A node's process is killed or stopped: how soon the server lets it go, what the others notice, how soon it is back under its name.

use std::path::Path;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use taut_link::{ClusterKey, LinkEvent, Role, ServerOptions, serve};

use super::client_process::start_client;
use super::state_stream::StateStream;
use super::threads::{on_own_thread, runtime};
use super::{BenchError, enter, paths, request_fifo, small_content, wait_until};

/// Real-time priority of server and witness, where the system grants it.
const PRIORITY: u8 = 70;
/// Name of the node that dies.
const VICTIM: &str = "victim";

/// How it dies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Death {
    /// SIGKILL: its ports are closed by the system.
    Killed,
    /// SIGSTOP: its ports stay open, and nobody reads them.
    Stopped,
}

impl Death {
    pub(super) fn signal(self) -> Signal {
        match self {
            Self::Killed => Signal::KILL,
            Self::Stopped => Signal::STOP,
        }
    }
}

/// What came of one death.
#[derive(Clone, Copy, Debug)]
pub struct Aftermath {
    /// From the signal until the server let the node go, s.
    pub let_go_s: f64,
    /// Longest time without a state at another node, from the signal until the victim is back, ms.
    pub longest_gap_ms: f64,
    /// From the start of its new process until it had joined under its name, s.
    pub back_s: f64,
    /// States that the other node missed meanwhile.
    pub missed: u64,
}

/// Kills or stops a node of a session with the server's own timeouts. `this` is this program, for the node's process.
pub fn measure(this: &Path, death: Death) -> Result<Aftermath, BenchError> {
    on_own_thread("death", || measure_here(this, death))
}

fn measure_here(this: &Path, death: Death) -> Result<Aftermath, BenchError> {
    let directory = tempfile::tempdir()?;
    let path = directory.path().join("cluster.key");
    let key: ClusterKey = taut_link::create_key_file(&path)?;
    // The victim is an ordinary process: only what comes now is of the real-time class.
    let _ = request_fifo(PRIORITY);
    let runtime = runtime(2)?;
    let server = runtime.block_on(serve(ServerOptions::loopback(key.clone()), small_content()))?;
    let witness = enter(&runtime, &server, &key, Role::Render, "witness")?;
    let address = server.quic_addr().to_string();
    let victim = start_client(this, &address, &path, VICTIM, "udp")?;
    wait_until("both paths", || paths(&server) == 2)?;
    let stream = StateStream::start(&server)?;
    std::thread::sleep(Duration::from_millis(500));
    while server.try_event().is_some() {}
    let (mut states, before) = (Vec::new(), witness.counters().lost);
    witness.drain_states(&mut states);
    states.clear();

    let died = Instant::now();
    victim.signal(death.signal())?;
    let mut let_go = None;
    wait_until("the server to let the node go", || {
        witness.drain_states(&mut states);
        while let Some(event) = server.try_event() {
            if matches!(&event, LinkEvent::Left { status, .. } if status.node == VICTIM) {
                let_go = Some(died.elapsed());
            }
        }
        let_go.is_some()
    })?;
    let again = Instant::now();
    let back = start_client(this, &address, &path, VICTIM, "udp")?;
    let back_s = again.elapsed().as_secs_f64();
    witness.drain_states(&mut states);
    let gaps = states
        .windows(2)
        .map(|two| two[1].received - two[0].received);
    let longest = gaps.max().unwrap_or(Duration::MAX);
    stream.end()?;
    drop((victim, back));
    Ok(Aftermath {
        let_go_s: let_go.unwrap_or(Duration::MAX).as_secs_f64(),
        longest_gap_ms: longest.as_secs_f64() * 1e3,
        back_s,
        missed: witness.counters().lost - before,
    })
}
