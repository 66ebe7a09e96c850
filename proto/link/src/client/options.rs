//! What a client is given, and what it receives.

use super::MeshCache;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use taut_proto::{HotState, JoinKey, Role, Transport, VersionRange, WrenchCommand};

/// Longer than any server's own: QUIC takes the shorter one of both ends.
const LONGEST_IDLE: Duration = Duration::from_secs(120);

/// How to connect.
#[derive(Clone, Debug)]
pub struct ClientOptions {
    /// `host:port`, name or number, IPv4 or IPv6 (in brackets); without port, the default one.
    pub server: String,
    /// The cluster key, or a credential for this role and name.
    pub key: JoinKey,
    /// Versions of the protocol that it speaks.
    pub versions: VersionRange,
    /// What this client is.
    pub role: Role,
    /// Its name, unique in the workbench.
    pub node: String,
    /// How states reach it.
    pub transport: Transport,
    /// Most states per second; 0 for all.
    pub rate_hz: u32,
    /// How long to try.
    pub connect_timeout: Duration,
    /// Silence on the control plane after which the server counts as gone, if the server has named no shorter one.
    pub idle_timeout: Duration,
    /// Where meshes are kept on disk; `None`: nowhere.
    pub mesh_cache: Option<Arc<MeshCache>>,
    /// Real-time priority, 1 to 99, of the thread that receives, of the one that leads frames, and of the one that draws while it waits for its frame.
    /// Where the system does not grant it, and with `None`, they have the class of the thread that made them.
    pub priority: Option<u8>,
}

impl ClientOptions {
    /// UDP, every state, 3 s to connect, silences as the server has them, no meshes on disk, no real-time class.
    pub fn new(
        server: impl Into<String>,
        key: impl Into<JoinKey>,
        role: Role,
        node: impl Into<String>,
    ) -> ClientOptions {
        ClientOptions {
            server: server.into(),
            key: key.into(),
            versions: VersionRange::SUPPORTED,
            role,
            node: node.into(),
            transport: Transport::Udp,
            rate_hz: 0,
            connect_timeout: Duration::from_secs(3),
            idle_timeout: LONGEST_IDLE,
            mesh_cache: None,
            priority: None,
        }
    }
}

/// A state with its history.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceivedState {
    /// The state.
    pub state: HotState,
    /// Sequence number of its datagram.
    pub sequence: u64,
    /// When it arrived, this machine's clock.
    pub received: Instant,
    /// Fingerprint of the state as received: report it in `ClientStats::drawn`.
    pub state_hash: u64,
}

/// A command to the device with its history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceivedWrench {
    /// The command.
    pub command: WrenchCommand,
    /// Sequence number of its datagram.
    pub sequence: u64,
    /// When it arrived, this machine's clock: the watchdog's measure.
    pub received: Instant,
}
