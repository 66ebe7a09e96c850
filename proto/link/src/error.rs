//! Why a link does not come about or fails; each text says what, where and what to do.

use std::{io, net::SocketAddr, path::PathBuf, time::Duration};
use taut_proto::{
    ServerPin, Untrusted, VersionRange, control::RefusalCode, credential::NotAllowed,
};

/// Why a link does not come about or fails.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// Another program has the port.
    #[error(
        "cannot listen on {address} ({plane}): the port is in use; stop the other server or choose another port"
    )]
    PortInUse {
        /// Address asked for.
        address: SocketAddr,
        /// "control" or "state".
        plane: &'static str,
    },
    /// The system does not let us listen.
    #[error("cannot listen on {address} ({plane}): {source}; choose an address of this machine")]
    Listen {
        /// Address asked for.
        address: SocketAddr,
        /// "control" or "state".
        plane: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// Not `host:port`.
    #[error(
        "\"{server}\" is no server address: write host:port, such as haptic-pc:4857 or [::1]:4857"
    )]
    BadAddress {
        /// What was given.
        server: String,
    },
    /// The name does not resolve.
    #[error(
        "the server name in \"{server}\" is unknown: {reason}; check the spelling or give a numeric address"
    )]
    UnknownHost {
        /// What was given.
        server: String,
        /// What the resolver says.
        reason: String,
    },
    /// Nobody answers.
    #[error(
        "no server answers at {server} within {seconds:.0} s: check that it runs, the address, and that the firewall lets UDP through"
    )]
    Unreachable {
        /// What was given.
        server: String,
        /// How long we tried, s.
        seconds: f64,
    },
    /// The server is there, but does not listen to this address.
    #[error(
        "the server at {server} has turned this address away for {seconds:.0} s: too many attempts from here or with wrong keys, or too many at once; wait a moment, then look for what keeps trying"
    )]
    TurnedAway {
        /// What was given.
        server: String,
        /// How long we tried, s.
        seconds: f64,
    },
    /// Another server than the one that the key is for, or somebody between.
    #[error(
        "the server at {server} is not the one of this node's key: its fingerprint is {found}, the key's is {wanted}; check the address, or give this node that server's cluster key or a credential made from it (--key)"
    )]
    WrongServer {
        /// What was given.
        server: String,
        /// Whom the key is for.
        wanted: ServerPin,
        /// Who answered.
        found: ServerPin,
    },
    /// The key does not allow what was asked for.
    #[error("the key of this node cannot be used: {0}")]
    NotAllowed(#[from] NotAllowed),
    /// It is the right server, but the secret is not one that it knows.
    #[error(
        "the server at {server} does not know this node's secret: the cluster key or credential (--key) is damaged or forged, make it again with `taut keys`"
    )]
    WrongKey {
        /// What was given.
        server: String,
    },
    /// Either end is of another release.
    #[error(
        "the server at {server} speaks protocol version {theirs}, this program speaks {ours}: install the same release on both"
    )]
    WrongVersion {
        /// What was given.
        server: String,
        /// Newest version of the server.
        theirs: u8,
        /// What this program speaks.
        ours: VersionRange,
    },
    /// The server has a reason of its own.
    #[error("the server at {server} refuses this node: {text}")]
    Refused {
        /// What was given.
        server: String,
        /// Why, for programs.
        code: RefusalCode,
        /// Why, for people.
        text: Untrusted,
    },
    /// What comes is no taut.
    #[error("the server at {server} does not speak taut: {reason}; check the port")]
    Protocol {
        /// What was given.
        server: String,
        /// What is wrong.
        reason: String,
    },
    /// The session ended.
    #[error("the link to {server} is closed: {reason}")]
    Closed {
        /// What was given.
        server: String,
        /// Why.
        reason: String,
    },
    /// The server has no such mesh.
    #[error("the server at {server} has no mesh {hash}: its scene changed, connect again")]
    NoSuchMesh {
        /// What was given.
        server: String,
        /// The hash.
        hash: String,
    },
    /// A mesh arrived damaged.
    #[error("mesh {hash} from {server} is damaged: {reason}; connect again")]
    BadMesh {
        /// What was given.
        server: String,
        /// The hash.
        hash: String,
        /// What is wrong.
        reason: String,
    },
    /// A key file cannot be used.
    #[error("cannot use the key file {path}: {reason}")]
    KeyFile {
        /// The file.
        path: PathBuf,
        /// Why and what to do.
        reason: String,
    },
    /// The silence after which a node is gone is none.
    #[error(
        "the node timeout is {timeout:?}, but must be from 1 ms to 60 s: change node_timeout in [network]"
    )]
    NodeTimeout {
        /// What was asked for.
        timeout: Duration,
    },
    /// The content cannot be sent.
    #[error("the scene cannot be sent to clients: {reason}")]
    Content {
        /// Why and what to do.
        reason: String,
    },
    /// The system fails us.
    #[error("cannot {what}: {reason}")]
    System {
        /// What we wanted.
        what: &'static str,
        /// What the system says.
        reason: String,
    },
}
