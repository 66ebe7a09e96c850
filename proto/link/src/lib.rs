//! Sessions of taut over the network: both halves, on tokio, quinn and one plain UDP socket.
//!
//! | plane   | over                                | carries                                           |
//! |---------|-------------------------------------|---------------------------------------------------|
//! | control | QUIC streams, TLS 1.3               | join, scene, meshes by hash, reports, log         |
//! | hot     | sealed UDP, or QUIC datagrams       | state at up to 1 kHz, device input, wrench, time  |
//!
//! The server half is [`serve`]; the client half is [`connect`]. Both prove the cluster key to each other over the exporter of their TLS
//! connection, and take the keys of the hot plane from it: one pair per session, so that only the device bridge's session can give
//! device input. [`SupervisedLink`] and [`Rejoiner`] come back to a server that was gone. Nothing here makes a loop of the server wait: [`Broadcaster::send`] belongs in a thread of its own.
//!
//! Layout of the wire: crate `taut-proto`.

pub mod binding;
pub mod client;
pub mod clock;
pub mod counters;
pub mod error;
mod framing;
pub mod key_file;
mod readiness;
pub mod server;
pub mod transport;

pub use client::{
    ClientLink, ClientOptions, GaveUp, LinkHealth, LinkWatch, MESH_CACHE_BYTES, MeshCache,
    ReceivedState, ReceivedWrench, RejoinPolicy, Rejoiner, Renewal, SessionEnd, SupervisedLink,
    connect,
};
pub use clock::SessionClock;
pub use counters::{ClientCounters, Counters, MeshCounters};
pub use error::LinkError;
pub use key_file::{create_key_file, read_key_file};
pub use server::{
    Broadcaster, ClientStatus, Content, DeviceInput, LinkEvent, ServerLink, ServerOptions, serve,
};
pub use taut_proto as proto;
pub use taut_proto::{ClientStats, ClusterKey, Role, Transport};

/// Default port of the control plane.
pub const DEFAULT_QUIC_PORT: u16 = 4857;
/// Default port of the hot plane.
pub const DEFAULT_UDP_PORT: u16 = 4858;

/// The reason that [`ClientLink::is_closed`] gives when the server ended the session in good order.
pub const STOP_REASON: &str = "server is stopping";
