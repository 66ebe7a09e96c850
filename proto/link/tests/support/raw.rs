//! Ends that speak QUIC, and say what a test likes.

use super::*;
use rustls::pki_types::{CertificateDer, PrivatePkcs8KeyDer};
use std::{
    net::{IpAddr, Ipv4Addr},
    sync::Arc,
};
use taut_link::{ServerPin, binding, pinning::PinnedServer, transport};
use taut_proto::{
    VersionRange,
    control::{ControlMessage, Hello, Offers},
    proof::Claim,
};

/// Any port of this machine.
pub const ANY: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0);

/// How a client connects that trusts the server of `pin`.
pub fn raw_config(pin: ServerPin) -> quinn::ClientConfig {
    let pinned = Arc::new(PinnedServer::new(pin));
    must(transport::client_config(pinned, Duration::from_secs(5)))
}

pub fn raw_endpoint(config: quinn::ClientConfig) -> quinn::Endpoint {
    let mut endpoint = must(quinn::Endpoint::client(ANY));
    endpoint.set_default_client_config(config);
    endpoint
}

pub async fn raw_connection(server: SocketAddr, config: quinn::ClientConfig) -> quinn::Connection {
    must(must(raw_endpoint(config).connect(server, "taut")).await)
}

/// A server of this identity.
pub fn raw_server(
    certificate: CertificateDer<'static>,
    private: PrivatePkcs8KeyDer<'static>,
) -> quinn::Endpoint {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let builder = rustls::ServerConfig::builder_with_provider(provider);
    let mut tls = must(
        must(builder.with_protocol_versions(&[&rustls::version::TLS13]))
            .with_no_client_auth()
            .with_single_cert(vec![certificate], private.into()),
    );
    tls.alpn_protocols = vec![b"taut".to_vec()];
    let crypto = must(quinn::crypto::rustls::QuicServerConfig::try_from(tls));
    let config = quinn::ServerConfig::with_crypto(Arc::new(crypto));
    must(quinn::Endpoint::server(config, ANY))
}

pub fn hello(claim: Claim<'_>, proof: [u8; 32]) -> Hello {
    Hello {
        versions: VersionRange::SUPPORTED,
        node: claim.node.into(),
        role: claim.role,
        transport: Transport::Udp,
        rate_hz: 0,
        proof,
        grant: claim.grant,
        offers: Offers::NONE,
    }
}

/// The Hello of one who holds the key.
pub fn proved_hello(connection: &quinn::Connection, claim: Claim<'_>) -> Hello {
    let bound = must(binding::proof_binding(connection));
    let secret = key('a').join_secret(claim.role, claim.node, claim.grant);
    hello(claim, secret.client_proof(&bound, claim))
}

/// Says `frame` first; the stream on which the server answers.
pub async fn say(
    connection: &quinn::Connection,
    frame: &[u8],
) -> (quinn::SendStream, quinn::RecvStream) {
    let (mut send, recv) = must(connection.open_bi().await);
    must(send.write_all(frame).await);
    (send, recv)
}

pub fn frame(message: &ControlMessage) -> Vec<u8> {
    must(message.to_frame())
}
