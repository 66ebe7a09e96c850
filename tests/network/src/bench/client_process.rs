//! A client as a process of its own, of this program: one that can be killed and stopped.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use taut_link::{ClientLink, ClientOptions, ClusterKey, Role, Transport, connect};
use tokio::runtime::Runtime;

use super::BenchError;
use super::process::Process;

/// Longest wait for the server.
const PATIENCE: Duration = Duration::from_secs(60);

/// `quic`, or else UDP.
pub fn transport_of(word: &str) -> Transport {
    match word {
        "quic" => Transport::QuicDatagram,
        _ => Transport::Udp,
    }
}

/// Joins as a render node.
pub(super) fn member(
    runtime: &Runtime,
    server: &str,
    key: &ClusterKey,
    node: &str,
    transport: Transport,
) -> Result<ClientLink, BenchError> {
    let options = ClientOptions {
        transport,
        connect_timeout: PATIENCE,
        ..ClientOptions::new(server, key.clone(), Role::Render, node)
    };
    Ok(runtime.block_on(connect(options))?)
}

/// Starts a client as a process of its own, and waits until it has joined. `this` is this program; `transport` is `quic` or `udp`.
pub(super) fn start_client(
    this: &Path,
    server: &str,
    key: &Path,
    node: &str,
    transport: &str,
) -> Result<Process, BenchError> {
    start_client_by(Command::new(this), server, key, node, transport)
}

/// The same by another command that runs this program with what follows.
pub(super) fn start_client_by(
    mut this: Command,
    server: &str,
    key: &Path,
    node: &str,
    transport: &str,
) -> Result<Process, BenchError> {
    let mut process = Process::start(
        this.args(["--client", server, node, transport])
            .arg(key)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped()),
    )?;
    let line = process.line()?;
    if line.trim() == "joined" {
        return Ok(process);
    }
    Err(BenchError::Missing(format!(
        "a client did not join: {line}"
    )))
}

/// States that a client process got so far, and that were lost on the way.
pub(super) fn states_and_lost(client: &mut Process) -> Result<[u64; 2], BenchError> {
    let line = client.ask()?;
    let mut numbers = line.split_whitespace().map(str::parse);
    match (numbers.next(), numbers.next()) {
        (Some(Ok(states)), Some(Ok(lost))) => Ok([states, lost]),
        _ => Err(BenchError::Missing(format!(
            "a client does not say what it got: {line:?}"
        ))),
    }
}

/// What such a process does: joins, says so, takes states until its standard input ends, and answers each line there with what it got.
pub fn client(server: &str, node: &str, transport: &str, key: &Path) -> Result<(), BenchError> {
    let runtime = Runtime::new()?;
    let key = taut_link::read_key_file(key)?;
    let link = member(&runtime, server, &key, node, transport_of(transport))?;
    println!("joined");
    for line in std::io::stdin().lines() {
        line?;
        let counters = link.counters();
        println!("{} {}", counters.states, counters.lost);
    }
    drop(link);
    Ok(())
}
