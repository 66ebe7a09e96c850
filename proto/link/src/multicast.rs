//! Sockets for multicast of IPv4: the server's that sends, a client's that listens.
//!
//! Time to live 1: the group ends at the router. The interface is named, never left to the routing table of a machine with several.

use socket2::{Domain, Protocol, Socket, Type};
use std::{
    io,
    net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket},
};

/// Where states for all go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MulticastOptions {
    /// Group and port; a group of 239.255.0.0/16 stays within the site (RFC 2365).
    pub group: SocketAddrV4,
    /// Group and port that clients are told, where a relay stands between; `None`: the same.
    pub announced: Option<SocketAddrV4>,
    /// Address of the interface to send from.
    pub interface: Ipv4Addr,
}

/// A non-blocking socket that sends to groups from `interface`; members on this machine hear it too.
pub(crate) fn sender(interface: Ipv4Addr) -> io::Result<Socket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.bind(&SocketAddr::from((interface, 0)).into())?;
    socket.set_multicast_if_v4(&interface)?;
    socket.set_multicast_ttl_v4(1)?;
    socket.set_multicast_loop_v4(true)?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}

/// A socket that hears `group` at `interface`. Several on one machine may listen to one group.
pub(crate) fn listener(group: SocketAddrV4, interface: Ipv4Addr) -> io::Result<Socket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_reuse_address(true)?;
    // Bound to the group, Unix delivers nothing else to it; elsewhere that is no address of this machine.
    let at = if cfg!(unix) {
        *group.ip()
    } else {
        Ipv4Addr::UNSPECIFIED
    };
    socket.bind(&SocketAddr::from((at, group.port())).into())?;
    socket.join_multicast_v4(group.ip(), &interface)?;
    Ok(socket)
}

/// Leaves and joins again: a switch that forgot the membership learns it anew.
pub(crate) fn join_again(
    socket: &Socket,
    group: SocketAddrV4,
    interface: Ipv4Addr,
) -> io::Result<()> {
    // A membership that the system lost already cannot be left; it can be joined.
    let _ = socket.leave_multicast_v4(group.ip(), &interface);
    socket.join_multicast_v4(group.ip(), &interface)
}

/// The address of this machine from which `peer` is reached, without sending anything.
pub(crate) fn interface_to(peer: SocketAddr) -> io::Result<Ipv4Addr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    socket.connect(peer)?;
    match socket.local_addr()? {
        SocketAddr::V4(address) => Ok(*address.ip()),
        SocketAddr::V6(_) => Err(io::ErrorKind::Unsupported.into()),
    }
}
