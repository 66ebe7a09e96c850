//! Sessions of taut over the network: both halves, on tokio, quinn and one plain UDP socket.
//!
//! | plane   | over                                | carries                                           |
//! |---------|-------------------------------------|---------------------------------------------------|
//! | control | QUIC streams, TLS 1.3               | join, scene, meshes by hash, reports, log         |
//! | hot     | sealed UDP, or QUIC datagrams       | state at up to 1 kHz, device input, wrench, time  |
//!
//! The server half is [`serve`]; the client half is [`connect`]. The client knows the server by its public key; both prove a secret to each
//! other over the exporter of their TLS connection (that of the cluster key, or of a credential for one role), and take the keys of the hot
//! plane from it: one pair per session, so that only the device bridge's session can give device input. What a client may do is decided by
//! its role alone (`taut_proto::role`), in one place of the server. [`SupervisedLink`] and [`Rejoiner`] come back to a server that was gone. Nothing here makes a loop of the server wait: [`Broadcaster::send`] belongs in a thread of its own.
//!
//! Layout of the wire: crate `taut-proto`.

pub mod binding;
pub mod client;
pub mod clock;
pub mod counters;
mod distribution;
pub mod error;
mod framing;
pub mod key_file;
mod lock;
pub mod multicast;
pub mod pinning;
mod readiness;
mod realtime;
pub mod server;
pub mod transport;

pub use client::{
    ClientLink, ClientOptions, FrameGate, FrameStatus, FrameTurn, LinkHealth, LinkWatch, MeshCache,
    PictureAsk, Provenance, ReceivedState, ReceivedWrench, RejoinPolicy, Rejoiner, ReleasedState,
    Renewal, Roster, ServerState, SessionEnd, Shown, ShownPicture, SupervisedLink, connect,
};
pub use clock::SessionClock;
pub use counters::{ClientCounters, Counters, MeshCounters};
pub use distribution::Distribution;
pub use error::LinkError;
pub use key_file::{
    check_secret_file, create_key_file, keep_memory_private, read_join_key, read_key_file,
    write_credential_file,
};
pub use multicast::MulticastOptions;
pub use server::{
    AlsoKey, Broadcaster, ClientStatus, Content, DeviceInput, DeviceReceiver, FloodLimits,
    ForceInput, ForceOutput, FrameMaster, FrameReport, HEAD_READERS, HeadInput, HeadOutput,
    LinkEvent, MAX_ASKED_BYTES, NodePicture, PICTURE_PATIENCE, PictureAnswer, PictureAsker,
    Reading, ServerLink, ServerOptions, serve,
};
pub use taut_proto as proto;
pub use taut_proto::{
    Act, ClientStats, ClusterKey, Credential, Holder, JoinKey, JoinPolicy, Printable, Role,
    ServerPin, Transport, Untrusted,
};

/// Default port of the control plane.
pub const DEFAULT_QUIC_PORT: u16 = 4857;
/// Default port of the hot plane.
pub const DEFAULT_UDP_PORT: u16 = 4858;

/// The reason that [`ClientLink::is_closed`] gives when the server ended the session in good order.
pub const STOP_REASON: &str = "server is stopping";
/// The same where it ended the session to begin another one.
pub(crate) const CHANGE_REASON: &str = "the server begins another session";
