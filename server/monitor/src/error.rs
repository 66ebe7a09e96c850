//! What can go wrong at the start, at the end, and when reading a recording back.

use std::net::SocketAddr;
use std::path::PathBuf;

/// Why monitoring could not start or end well. Nothing is left running after an error.
#[derive(Debug, thiserror::Error)]
pub enum MonitorError {
    /// Another program listens on the port already, or the address is not this machine's.
    #[error(
        "monitoring cannot listen on {address} ({source}); set {key} to a free port, or 0 to take any"
    )]
    Listen {
        /// Address and port asked for.
        address: SocketAddr,
        /// The configuration key that holds the port.
        key: &'static str,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The recording cannot be written.
    #[error("the recording {} cannot be written ({reason}); check monitoring.record", path.display())]
    Record {
        /// The file asked for.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
    /// A mesh is broken.
    #[error("body \"{body}\" cannot be shown: {reason}")]
    Mesh {
        /// The body's name.
        body: String,
        /// What is wrong with it.
        reason: String,
    },
    /// rerun refused what it was given.
    #[error("rerun refused {what}: {reason}")]
    Rerun {
        /// What was given to it.
        what: &'static str,
        /// What it said.
        reason: String,
    },
    /// The operating system gave no thread.
    #[error(
        "no thread for monitoring could be started ({0}); check the limit on processes (ulimit -u)"
    )]
    Thread(std::io::Error),
    /// The monitoring thread ended early by a panic.
    #[error("the monitoring thread ended early; see the panic message above")]
    ThreadLost,
}

/// Why a recording or a stream could not be read.
#[derive(Debug, thiserror::Error)]
pub enum InspectError {
    /// The file cannot be opened.
    #[error("the recording {} cannot be opened: {source}", path.display())]
    Open {
        /// The file asked for.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The file is not a recording, or is damaged.
    #[error("{} is not a readable rerun recording: {reason}", path.display())]
    Decode {
        /// The file asked for.
        path: PathBuf,
        /// What rerun's reader said.
        reason: String,
    },
    /// The stream cannot be reached.
    #[error(
        "the stream at {address} cannot be read ({reason}); is the server running, and is this its address?"
    )]
    Connect {
        /// The address asked for.
        address: String,
        /// What went wrong.
        reason: String,
    },
}
