//! What a server is given: addresses, key, limits.

use super::FloodLimits;
use crate::{DEFAULT_QUIC_PORT, DEFAULT_UDP_PORT, MulticastOptions, SessionClock};
use std::{
    net::{Ipv4Addr, SocketAddr},
    time::Duration,
};
use taut_proto::{
    ClusterKey, CouplingOffer, JoinPolicy, barrier::MasterSettings, membership::SilenceLimits,
};

/// How to serve. Port 0 takes any free port.
#[derive(Clone, Debug)]
pub struct ServerOptions {
    /// Address of the control plane.
    pub quic: SocketAddr,
    /// Address of the hot plane.
    pub udp: SocketAddr,
    /// Port of the hot plane that clients are told, where a forwarding router or relay stands before the server; `None`: the one of `udp`.
    pub announced_udp_port: Option<u16>,
    /// Where states for all render nodes go, beside unicast for those who do not hear it; `None` for unicast alone.
    pub multicast: Option<MulticastOptions>,
    /// The cluster key: the server's identity and every credential follow from it.
    pub key: ClusterKey,
    /// Who is let in, of those who can prove something.
    pub policy: JoinPolicy,
    /// Limits against floods.
    pub limits: FloodLimits,
    /// Most clients at a time.
    pub max_clients: usize,
    /// Silence on the control plane after which a client counts as gone and its name is free, and the server for a client that named no
    /// shorter one.
    pub idle_timeout: Duration,
    /// Silence on the hot plane after which a node that others wait for counts as gone: a render node, a device. Clients are told, and
    /// give the server up after the same.
    pub node_timeout: Duration,
    /// The clock that the server's loops stamp with.
    pub clock: SessionClock,
    /// How the frames of render nodes go together; `None`: each node draws on its own.
    pub frames: Option<MasterSettings>,
    /// What a device bridge is told about coupling by itself.
    pub coupling: CouplingOffer,
}

impl ServerOptions {
    /// Default ports on all IPv4 addresses, unicast, 32 clients, 1 s of silence (0.5 s of a node), coupling at the server, frames that nobody locks.
    pub fn new(key: ClusterKey) -> ServerOptions {
        ServerOptions {
            quic: SocketAddr::from((Ipv4Addr::UNSPECIFIED, DEFAULT_QUIC_PORT)),
            udp: SocketAddr::from((Ipv4Addr::UNSPECIFIED, DEFAULT_UDP_PORT)),
            announced_udp_port: None,
            multicast: None,
            key,
            policy: JoinPolicy::default(),
            limits: FloodLimits::default(),
            max_clients: 32,
            idle_timeout: crate::transport::IDLE_TIMEOUT,
            node_timeout: Duration::from_nanos(SilenceLimits::OF_A_NODE.dead_after_ns),
            clock: SessionClock::start_now(),
            frames: None,
            coupling: CouplingOffer::AtServer {
                reason: "it offers nothing else".into(),
            },
        }
    }

    /// The same on free ports of 127.0.0.1: for one machine and for tests.
    pub fn loopback(key: ClusterKey) -> ServerOptions {
        ServerOptions {
            quic: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
            udp: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
            ..ServerOptions::new(key)
        }
    }
}
