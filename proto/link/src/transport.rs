//! TLS and QUIC settings of both halves.
//!
//! The server's identity is an Ed25519 key derived from the cluster key. Its self-signed certificate says nothing but that key: the client
//! compares the key's fingerprint with the one that it was given (see [`crate::pinning`]) and takes no other. Then both ends prove their
//! secret over this very connection's exporter (see [`crate::binding`]).

use crate::{LinkError, pinning::PinnedServer, server::AlsoKey};
use quinn::{
    IdleTimeout, TransportConfig, VarInt,
    crypto::rustls::{QuicClientConfig, QuicServerConfig},
};
use rustls::{
    crypto::{CryptoProvider, ring::sign::any_eddsa_type},
    pki_types::PrivatePkcs8KeyDer,
    server::{ClientHello, ResolvesServerCert},
    sign::CertifiedKey,
};
use std::{sync::Arc, time::Duration};
use taut_proto::{ClusterKey, ServerPin, pin::ed25519_pkcs8};
use zeroize::Zeroizing;

/// Silence after which a peer counts as gone.
pub(crate) const IDLE_TIMEOUT: Duration = Duration::from_secs(1);
/// Sign of life on an idle connection: ten fit the idle timeout.
const KEEP_ALIVE: Duration = Duration::from_millis(100);
/// Room for hot datagrams that QUIC has not sent yet: about four; the oldest are dropped, newest wins.
const DATAGRAM_SEND_BYTES: usize = 4800;
/// Room for hot datagrams that have arrived and wait for the reader: a quarter of a second at 1 kHz.
const DATAGRAM_RECEIVE_BYTES: usize = 256 << 10;
/// Bytes in flight before congestion control knows the path: the default of 12 kB holds back a 1 kHz stream at join.
const INITIAL_WINDOW_BYTES: u64 = 256 << 10;
/// Bytes of one stream that a client may send ahead of the server's reading: some dozen reports.
const SERVER_STREAM_BYTES: u32 = 128 << 10;
/// The same of all streams of a client together.
const SERVER_CONNECTION_BYTES: u32 = 512 << 10;
/// Round trip that a client assumes before it knows: its first packet is sent again after three of these, so that a server that has just
/// started is reached soon. On a longer way a packet is sent twice for nothing.
const INITIAL_ROUND_TRIP: Duration = Duration::from_millis(100);
/// Streams that a client may have open at once: control and meshes.
const MAX_STREAMS: u32 = 32;
/// Protocol name in TLS; the version is not in it, so that versions can refuse each other with a sentence.
const ALPN: &[u8] = b"taut";
/// Name in the certificate; nothing depends on it.
const SERVER_NAME: &str = "taut";
/// Digits of a fingerprint in the name that a client asks for: 128 bits.
const NAMED_DIGITS: usize = 32;

/// Name that a client asks for: which identity it trusts, where the server has two. It is sent clear, and a fingerprint is no secret.
pub(crate) fn server_name(pin: ServerPin) -> String {
    format!("{}.{SERVER_NAME}", &pin.to_hex()[..NAMED_DIGITS])
}

/// The server's own identity, and for a while that of a second cluster key.
#[derive(Debug)]
struct Identities {
    own: Arc<CertifiedKey>,
    also: Option<(String, Arc<CertifiedKey>, AlsoKey)>,
}

impl ResolvesServerCert for Identities {
    fn resolve(&self, hello: ClientHello<'_>) -> Option<Arc<CertifiedKey>> {
        let asked = hello.server_name();
        let identity = match &self.also {
            Some((name, identity, also)) if asked == Some(name.as_str()) && also.counts() => {
                identity
            }
            _ => &self.own,
        };
        Some(identity.clone())
    }
}

/// A self-signed certificate that says nothing but the public key of `key`.
fn identity(key: &ClusterKey) -> Result<Arc<CertifiedKey>, LinkError> {
    let failed = |reason: String| LinkError::System {
        what: "make a TLS identity",
        reason,
    };
    let pkcs8 = Zeroizing::new(ed25519_pkcs8(&key.identity_seed()));
    let private = PrivatePkcs8KeyDer::from(pkcs8.as_slice());
    let signing = rcgen::KeyPair::from_pkcs8_der_and_sign_algo(&private, &rcgen::PKCS_ED25519)
        .map_err(|error| failed(error.to_string()))?;
    let certificate = rcgen::CertificateParams::new([SERVER_NAME.to_owned()])
        .and_then(|parameters| parameters.self_signed(&signing))
        .map_err(|error| failed(error.to_string()))?;
    let signing = any_eddsa_type(&private).map_err(|error| failed(error.to_string()))?;
    let chain = vec![certificate.der().clone()];
    Ok(Arc::new(CertifiedKey::new(chain, signing)))
}

/// QUIC settings of the server of `key`'s workbench.
pub(crate) fn server_config(
    key: &ClusterKey,
    also: Option<&AlsoKey>,
    idle_timeout: Duration,
) -> Result<quinn::ServerConfig, LinkError> {
    let failed = |reason: String| LinkError::System {
        what: "make a TLS identity",
        reason,
    };
    let also = match also {
        Some(also) => {
            let name = server_name(also.key.server_pin());
            Some((name, identity(&also.key)?, also.clone()))
        }
        None => None,
    };
    let identities = Identities {
        own: identity(key)?,
        also,
    };
    let mut tls = rustls::ServerConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|error| failed(error.to_string()))?
        .with_no_client_auth()
        .with_cert_resolver(Arc::new(identities));
    // Every session's keys come from a handshake of its own: nothing is resumed, nothing is sent before it is over.
    tls.send_tls13_tickets = 0;
    tls.alpn_protocols = vec![ALPN.to_vec()];
    let crypto = QuicServerConfig::try_from(tls).map_err(|error| failed(error.to_string()))?;
    let mut transport = transport(idle_timeout);
    transport
        .stream_receive_window(VarInt::from_u32(SERVER_STREAM_BYTES))
        .receive_window(VarInt::from_u32(SERVER_CONNECTION_BYTES));
    let mut config = quinn::ServerConfig::with_crypto(Arc::new(crypto));
    config.transport_config(Arc::new(transport));
    Ok(config)
}

/// QUIC settings of a client that speaks to `server` alone.
pub fn client_config(
    server: Arc<PinnedServer>,
    idle_timeout: Duration,
) -> Result<quinn::ClientConfig, LinkError> {
    let failed = |reason: String| LinkError::System {
        what: "set up TLS",
        reason,
    };
    let mut tls = rustls::ClientConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|error| failed(error.to_string()))?
        .dangerous()
        .with_custom_certificate_verifier(server)
        .with_no_client_auth();
    tls.resumption = rustls::client::Resumption::disabled();
    tls.alpn_protocols = vec![ALPN.to_vec()];
    let crypto = QuicClientConfig::try_from(tls).map_err(|error| failed(error.to_string()))?;
    let mut transport = transport(idle_timeout);
    transport.initial_rtt(INITIAL_ROUND_TRIP);
    let mut config = quinn::ClientConfig::new(Arc::new(crypto));
    config.transport_config(Arc::new(transport));
    Ok(config)
}

pub(crate) fn provider() -> Arc<CryptoProvider> {
    Arc::new(rustls::crypto::ring::default_provider())
}

fn transport(idle_timeout: Duration) -> TransportConfig {
    let mut congestion = quinn::congestion::CubicConfig::default();
    congestion.initial_window(INITIAL_WINDOW_BYTES);
    let idle = u32::try_from(idle_timeout.as_millis()).unwrap_or(u32::MAX);
    let mut transport = TransportConfig::default();
    transport
        .max_idle_timeout(Some(IdleTimeout::from(VarInt::from_u32(idle))))
        .keep_alive_interval(Some(KEEP_ALIVE.min(idle_timeout / 4)))
        .datagram_send_buffer_size(DATAGRAM_SEND_BYTES)
        .datagram_receive_buffer_size(Some(DATAGRAM_RECEIVE_BYTES))
        .max_concurrent_bidi_streams(VarInt::from_u32(MAX_STREAMS))
        .max_concurrent_uni_streams(VarInt::from_u32(0))
        .congestion_controller_factory(Arc::new(congestion));
    transport
}
