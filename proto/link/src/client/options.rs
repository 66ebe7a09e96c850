//! What a client is given, and what it receives.

use super::MeshCache;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use taut_proto::{
    HotState, JoinKey, Role, Transport, VersionRange, WrenchCommand, state::RunState,
};

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
    /// Whether it gives pictures of what it shows when it is asked for them: [`super::ClientLink::take_picture_ask`].
    pub pictures: bool,
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
            pictures: false,
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
    /// Who vouches for it.
    pub provenance: Provenance,
}

/// Under whose keys a state came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Provenance {
    /// Those of this session: the server sent it.
    Session,
    /// The group's: a member sent it, and what it says is the server's is so until it is found out, for
    /// [`taut_proto::confirmation::PATIENCE_NS`] at most. To draw from, and for nothing else.
    Group,
}

/// A state that the server sent, for who decides by it: what asks for force, or for none, takes no other.
#[derive(Clone, Copy, Debug)]
pub struct ServerState<'a>(&'a HotState);

impl ReceivedState {
    /// The state, if it came under the keys of this session.
    pub fn of_server(&self) -> Option<ServerState<'_>> {
        match self.provenance {
            Provenance::Session => Some(ServerState(&self.state)),
            Provenance::Group => None,
        }
    }
}

impl ServerState<'_> {
    /// Whether forces are given.
    pub fn run(&self) -> RunState {
        self.0.run
    }
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
