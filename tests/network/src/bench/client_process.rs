//! A client as a process of its own, of this program: one that can be killed and stopped.

use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use taut_link::{ClientLink, ClientOptions, ClusterKey, Role, Transport, connect};
use tokio::runtime::Runtime;

use super::BenchError;
use super::process::Process;

/// Longest wait for the server.
const PATIENCE: Duration = Duration::from_secs(60);

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
    let mut process = Process::start(
        Command::new(this)
            .args(["--client", server, node, transport])
            .arg(key)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped()),
    )?;
    let line = process.first_line()?;
    if line.trim() == "joined" {
        return Ok(process);
    }
    Err(BenchError::Missing(format!(
        "a client did not join: {line}"
    )))
}

/// What such a process does: joins, says so, and takes states until its standard input ends.
///
/// # Errors
/// It does not get in.
pub fn client(server: &str, node: &str, transport: &str, key: &Path) -> Result<(), BenchError> {
    let runtime = Runtime::new()?;
    let key = taut_link::read_key_file(key)?;
    let transport = match transport {
        "quic" => Transport::QuicDatagram,
        _ => Transport::Udp,
    };
    let link = member(&runtime, server, &key, node, transport)?;
    println!("joined");
    let mut ignored = Vec::new();
    std::io::stdin().read_to_end(&mut ignored)?;
    drop(link);
    Ok(())
}
