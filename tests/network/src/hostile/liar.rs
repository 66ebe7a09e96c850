//! A member that lies: lawfully inside, with a program of its own that says what it likes under the keys that it was given.

use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

use taut_link::proto::control::{
    ControlMessage, Hello, LENGTH_BYTES, MAX_FRAME_BYTES, Offers, Welcome,
};
use taut_link::proto::group::{GroupSealer, SERVER_SENDER};
use taut_link::proto::header::MAX_DATAGRAM_BYTES;
use taut_link::proto::proof::Claim;
use taut_link::proto::seal::{KEY_MATERIAL_BYTES, Sealer};
use taut_link::proto::{Group, JoinKey, Payload, VersionRange};
use taut_link::{Role, ServerLink, Transport, binding, pinning::PinnedServer, transport};

use crate::bench::BenchError;

const IDLE: Duration = Duration::from_secs(10);
/// Numbers that the lying member leaves to the server: it speaks after a second or two, at a thousand a second.
const NUMBERS_AHEAD: usize = 20_000;
/// Label of the keys of the hot plane, as `taut_link::binding` has it.
const HOT_LABEL: &[u8] = b"EXPORTER-taut-hot-1";

/// A client that holds all that it was told, and the keys.
pub(super) struct Liar {
    _connection: quinn::Connection,
    _send: quinn::SendStream,
    recv: quinn::RecvStream,
    welcome: Welcome,
    own: Sealer,
    socket: UdpSocket,
    udp: SocketAddr,
}

fn failed(error: impl std::fmt::Display) -> BenchError {
    BenchError::Missing(format!("the lying member: {error}"))
}

impl Liar {
    /// Joins as `role` under `node`.
    pub(super) async fn join(
        server: &ServerLink,
        key: &JoinKey,
        role: Role,
        node: &str,
    ) -> Result<Liar, BenchError> {
        let pinned = Arc::new(PinnedServer::new(server.pin()));
        let config = transport::client_config(pinned, IDLE)?;
        let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let endpoint = quinn::Endpoint::client(any)?;
        let connecting = endpoint.connect_with(config, server.quic_addr(), "taut");
        let connection = connecting.map_err(failed)?.await.map_err(failed)?;
        let (mut send, mut recv) = connection.open_bi().await.map_err(failed)?;
        let bound = binding::proof_binding(&connection)?;
        let (grant, secret) = key.secret_for(role, node).map_err(failed)?;
        let claim = Claim { role, node, grant };
        let hello = ControlMessage::Hello(Hello {
            versions: VersionRange::SUPPORTED,
            node: node.into(),
            role,
            transport: Transport::Udp,
            rate_hz: 0,
            proof: secret.client_proof(&bound, claim),
            grant,
            offers: Offers::NONE,
        });
        let frame = hello.to_frame().map_err(failed)?;
        send.write_all(&frame).await.map_err(failed)?;
        let welcome = match read(&mut recv).await? {
            ControlMessage::Welcome(welcome) => welcome,
            other => return Err(failed(format!("{} instead of a welcome", other.name()))),
        };
        let mut both = [[0; KEY_MATERIAL_BYTES]; 2];
        connection
            .export_keying_material(both.as_flattened_mut(), HOT_LABEL, &[])
            .map_err(|_| failed("no keys"))?;
        let own = Sealer::new(&both[1], welcome.epoch, welcome.session);
        let udp = server.udp_addr();
        Ok(Liar {
            _connection: connection,
            _send: send,
            recv,
            welcome,
            own,
            socket: UdpSocket::bind(any)?,
            udp,
        })
    }

    /// Says `payload` to the server under its own keys.
    pub(super) fn say(&self, payload: &Payload) -> Result<(), BenchError> {
        let mut buffer = [0; MAX_DATAGRAM_BYTES];
        let datagram = self.own.seal(payload, &mut buffer).map_err(failed)?;
        self.socket.send_to(datagram, self.udp)?;
        Ok(())
    }

    /// The group as this member was told of it last, once `node` is in it.
    pub(super) async fn group_with(&mut self, node: &str) -> Result<Group, BenchError> {
        loop {
            if let ControlMessage::Group(group) = read(&mut self.recv).await?
                && group.members.iter().any(|member| member.node == node)
            {
                return Ok(group);
            }
        }
    }

    /// Seals for the group in the server's name: what the group's secret allows. Numbers are above those of the server.
    pub(super) fn as_server(&self, group: &Group) -> GroupSealer {
        let mut sealer = GroupSealer::new(self.welcome.epoch, SERVER_SENDER);
        sealer.learn(group, 0);
        let mut buffer = [0; MAX_DATAGRAM_BYTES];
        for _ in 0..NUMBERS_AHEAD {
            let _ = sealer.seal(&Payload::Heartbeat, 0, &mut buffer);
        }
        sealer
    }
}

/// A socket that speaks to groups on loopback.
pub(super) fn to_groups() -> Result<socket2::Socket, BenchError> {
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None)?;
    socket.set_multicast_if_v4(&Ipv4Addr::LOCALHOST)?;
    Ok(socket)
}

/// Whether this system brings a datagram for a group on loopback back.
pub(super) fn multicast_works(group: SocketAddrV4) -> bool {
    let attempt = || -> std::io::Result<bool> {
        let listener = UdpSocket::bind(group)?;
        listener.join_multicast_v4(group.ip(), &Ipv4Addr::LOCALHOST)?;
        listener.set_read_timeout(Some(Duration::from_secs(1)))?;
        let sender = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None)?;
        sender.set_multicast_if_v4(&Ipv4Addr::LOCALHOST)?;
        sender.send_to(b"echo", &group.into())?;
        Ok(listener.recv(&mut [0; 8])? == 4)
    };
    attempt().unwrap_or(false)
}

async fn read(recv: &mut quinn::RecvStream) -> Result<ControlMessage, BenchError> {
    let mut length = [0; LENGTH_BYTES];
    recv.read_exact(&mut length).await.map_err(failed)?;
    let length = ControlMessage::frame_length(length, MAX_FRAME_BYTES).map_err(failed)?;
    let mut body = vec![0; length];
    recv.read_exact(&mut body).await.map_err(failed)?;
    ControlMessage::from_frame_body(&body).map_err(failed)
}
