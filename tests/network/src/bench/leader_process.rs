//! A server that broadcasts and leads frames, as a process of its own, of this program: one that can be killed and stopped.

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use rustix::process::Signal;
use taut_link::{ServerOptions, serve};
use taut_proto::barrier::Swap;

use super::process::Process;
use super::skew::{Leading, settings};
use super::threads::runtime;
use super::{BenchError, request_fifo, small_content};

/// Frames per second that it leads.
pub const RATE: u64 = 60;
/// Real-time priority of all threads, where the system grants it.
pub(super) const PRIORITY: u8 = 60;

/// A server that broadcasts and leads frames, as a process that is killed when dropped.
#[derive(Debug)]
pub struct LeaderProcess {
    process: Process,
    quic: String,
    udp: String,
}

impl LeaderProcess {
    /// Starts it as `this` program's `--lead`, with the cluster key of a file, at the addresses of both planes.
    pub fn start(
        this: &Path,
        key: &Path,
        (quic, udp): (&str, &str),
        node_timeout: Duration,
    ) -> Result<LeaderProcess, BenchError> {
        let mut process = Process::start(
            Command::new(this)
                .args(["--lead", quic, udp])
                .arg(key)
                .arg(node_timeout.as_millis().to_string())
                .stdin(Stdio::piped())
                .stdout(Stdio::piped()),
        )?;
        let line = process.line()?;
        let Some((quic, udp)) = line.trim().split_once(' ') else {
            return Err(BenchError::Missing(format!("no server started: {line}")));
        };
        Ok(LeaderProcess {
            process,
            quic: quic.to_owned(),
            udp: udp.to_owned(),
        })
    }

    /// Address of its control plane.
    pub fn quic(&self) -> &str {
        &self.quic
    }

    /// Address of its pose plane.
    pub fn udp(&self) -> &str {
        &self.udp
    }

    /// Stops it as it stands, or lets it go on.
    pub fn signal(&self, signal: Signal) -> Result<(), BenchError> {
        self.process.signal(signal)
    }
}

/// What the server's process does: says where it serves, broadcasts, and leads frames until its standard input ends.
pub fn lead(quic: &str, udp: &str, key: &Path, node_timeout: Duration) -> Result<(), BenchError> {
    let _ = request_fifo(PRIORITY);
    let address = |text: &str| {
        let parsed = text.parse();
        parsed.map_err(|_| BenchError::Missing(format!("`{text}` is no address")))
    };
    let runtime = runtime(1)?;
    let options = ServerOptions {
        quic: address(quic)?,
        udp: address(udp)?,
        node_timeout,
        idle_timeout: 2 * node_timeout, // as `taut serve`: QUIC gives nobody up before
        frames: Some(settings(Swap::Immediate, RATE)),
        ..ServerOptions::loopback(taut_link::read_key_file(key)?)
    };
    let server = runtime.block_on(serve(options, small_content()))?;
    let leading = Leading::start(&server)?;
    let mut out = std::io::stdout();
    writeln!(out, "{} {}", server.quic_addr(), server.udp_addr())?;
    out.flush()?;
    let mut ignored = Vec::new();
    std::io::stdin().read_to_end(&mut ignored)?;
    leading.end()
}
