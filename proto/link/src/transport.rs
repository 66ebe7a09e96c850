//! TLS and QUIC settings of both halves.
//!
//! The server's certificate is made at start and says nothing: the client takes any, checks only that the peer holds the certificate's key,
//! and both ends then prove the cluster key over this very connection's exporter (see [`crate::binding`]).

use crate::LinkError;
use quinn::{
    IdleTimeout, TransportConfig, VarInt,
    crypto::rustls::{QuicClientConfig, QuicServerConfig},
};
use rustls::{
    DigitallySignedStruct, SignatureScheme,
    client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier},
    crypto::{CryptoProvider, verify_tls12_signature, verify_tls13_signature},
    pki_types::{CertificateDer, PrivatePkcs8KeyDer, ServerName, UnixTime},
};
use std::{sync::Arc, time::Duration};

/// Silence after which a peer counts as gone.
pub(crate) const IDLE_TIMEOUT: Duration = Duration::from_secs(1);
/// Sign of life on an idle connection: five fit the idle timeout.
const KEEP_ALIVE: Duration = Duration::from_millis(200);
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
/// Name that clients ask for; nothing depends on it.
pub(crate) const SERVER_NAME: &str = "taut";

/// QUIC settings of a server with a certificate of its own.
pub(crate) fn server_config(idle_timeout: Duration) -> Result<quinn::ServerConfig, LinkError> {
    let failed = |reason: String| LinkError::System {
        what: "make a TLS identity",
        reason,
    };
    let identity = rcgen::generate_simple_self_signed([SERVER_NAME.to_owned()])
        .map_err(|error| failed(error.to_string()))?;
    let key = PrivatePkcs8KeyDer::from(identity.signing_key.serialize_der());
    let mut tls = rustls::ServerConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|error| failed(error.to_string()))?
        .with_no_client_auth()
        .with_single_cert(vec![identity.cert.der().clone()], key.into())
        .map_err(|error| failed(error.to_string()))?;
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

/// QUIC settings of a client. Speaks to any server: who trusts it must check the binding.
pub fn client_config(idle_timeout: Duration) -> Result<quinn::ClientConfig, LinkError> {
    let failed = |reason: String| LinkError::System {
        what: "set up TLS",
        reason,
    };
    let provider = provider();
    let mut tls = rustls::ClientConfig::builder_with_provider(provider.clone())
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|error| failed(error.to_string()))?
        .dangerous()
        .with_custom_certificate_verifier(Arc::new(AnyCertificate { provider }))
        .with_no_client_auth();
    tls.alpn_protocols = vec![ALPN.to_vec()];
    let crypto = QuicClientConfig::try_from(tls).map_err(|error| failed(error.to_string()))?;
    let mut transport = transport(idle_timeout);
    transport.initial_rtt(INITIAL_ROUND_TRIP);
    let mut config = quinn::ClientConfig::new(Arc::new(crypto));
    config.transport_config(Arc::new(transport));
    Ok(config)
}

fn provider() -> Arc<CryptoProvider> {
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

/// Takes any certificate whose key the peer holds; trust comes from the cluster key, over the exporter.
#[derive(Debug)]
struct AnyCertificate {
    provider: Arc<CryptoProvider>,
}

impl ServerCertVerifier for AnyCertificate {
    fn verify_server_cert(
        &self,
        _end_entity: &CertificateDer<'_>,
        _intermediates: &[CertificateDer<'_>],
        _server_name: &ServerName<'_>,
        _ocsp_response: &[u8],
        _now: UnixTime,
    ) -> Result<ServerCertVerified, rustls::Error> {
        Ok(ServerCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        cert: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        let algorithms = &self.provider.signature_verification_algorithms;
        verify_tls12_signature(message, cert, signature, algorithms)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        cert: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        let algorithms = &self.provider.signature_verification_algorithms;
        verify_tls13_signature(message, cert, signature, algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.provider
            .signature_verification_algorithms
            .supported_schemes()
    }
}
