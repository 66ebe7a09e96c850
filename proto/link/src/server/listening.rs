//! The ports of a server: how it takes them, and when they are free again.

use super::ServerOptions;
use crate::{LinkError, transport};
use ring::rand::{SecureRandom, SystemRandom};
use std::{
    io,
    net::{SocketAddr, UdpSocket},
    sync::Arc,
    time::Duration,
};
use tokio::time::sleep;

/// How often a stopped server looks whether its port is free.
const FREE_CHECK: Duration = Duration::from_millis(1);

/// Both planes of a server, before anybody is let in.
pub(super) struct Listening {
    pub(super) endpoint: quinn::Endpoint,
    pub(super) quic_address: SocketAddr,
    pub(super) udp: UdpSocket,
    pub(super) udp_address: SocketAddr,
}

pub(super) fn listen(options: &ServerOptions) -> Result<Listening, LinkError> {
    let quic_socket = bind(options.quic, "control")?;
    let udp = bind(options.udp, "state")?;
    let address_of = |socket: &UdpSocket| {
        socket
            .local_addr()
            .map_err(|error| system("read a socket's address", &error))
    };
    let (quic_address, udp_address) = (address_of(&quic_socket)?, address_of(&udp)?);
    let endpoint = quinn::Endpoint::new(
        quinn::EndpointConfig::default(),
        Some(transport::server_config(
            &options.key,
            options.also.as_ref(),
            options.idle_timeout,
        )?),
        quic_socket,
        Arc::new(quinn::TokioRuntime),
    )
    .map_err(|error| system("start QUIC", &error))?;
    Ok(Listening {
        endpoint,
        quic_address,
        udp,
        udp_address,
    })
}

fn bind(address: SocketAddr, plane: &'static str) -> Result<UdpSocket, LinkError> {
    let socket = UdpSocket::bind(address).map_err(|source| match source.kind() {
        io::ErrorKind::AddrInUse => LinkError::PortInUse { address, plane },
        _ => LinkError::Listen {
            address,
            plane,
            source,
        },
    })?;
    socket
        .set_nonblocking(true)
        .map_err(|error| system("make a socket non-blocking", &error))?;
    Ok(socket)
}

/// Waits until nobody listens at `address`: tasks hold both sockets a moment longer than the endpoint lives.
pub(super) async fn freed(address: SocketAddr) {
    let taken =
        || UdpSocket::bind(address).is_err_and(|error| error.kind() == io::ErrorKind::AddrInUse);
    while taken() {
        sleep(FREE_CHECK).await;
    }
}

/// What nobody can guess.
pub(super) fn random<const N: usize>() -> Result<[u8; N], LinkError> {
    let mut bytes = [0; N];
    let drawn = SystemRandom::new().fill(&mut bytes);
    drawn.map_err(|_| LinkError::System {
        what: "draw a random number",
        reason: "the system gives none".to_owned(),
    })?;
    Ok(bytes)
}

pub(super) fn system(what: &'static str, error: &io::Error) -> LinkError {
    LinkError::System {
        what,
        reason: error.to_string(),
    }
}
