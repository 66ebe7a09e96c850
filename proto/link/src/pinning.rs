//! The server that a client takes for its own: the one whose public key has the pinned fingerprint.
//!
//! No authority signs the server's certificate and no name in it counts: the fingerprint came with the credential, or follows from the
//! cluster key. TLS itself proves that the peer holds the key. Whoever stands between with a certificate of his own is found out before
//! the client has said anything but where it wants to go.

use crate::transport::provider;
use rustls::{
    CertificateError, DigitallySignedStruct, SignatureScheme,
    client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier},
    crypto::{CryptoProvider, verify_tls13_signature},
    pki_types::{CertificateDer, ServerName, UnixTime},
    server::ParsedCertificate,
};
use std::sync::{Arc, Mutex, PoisonError};
use taut_proto::ServerPin;

/// Takes the server of one fingerprint, and remembers whom it met instead.
#[derive(Debug)]
pub struct PinnedServer {
    pin: ServerPin,
    stranger: Mutex<Option<ServerPin>>,
    provider: Arc<CryptoProvider>,
}

impl PinnedServer {
    /// Takes the server of `pin` alone.
    pub fn new(pin: ServerPin) -> PinnedServer {
        PinnedServer {
            pin,
            stranger: Mutex::new(None),
            provider: provider(),
        }
    }

    /// The server that is wanted.
    pub fn pin(&self) -> ServerPin {
        self.pin
    }

    /// Who answered last instead of it, if anybody did.
    pub fn stranger(&self) -> Option<ServerPin> {
        *self.stranger.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ServerCertVerifier for PinnedServer {
    fn verify_server_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        _intermediates: &[CertificateDer<'_>],
        _server_name: &ServerName<'_>,
        _ocsp_response: &[u8],
        _now: UnixTime,
    ) -> Result<ServerCertVerified, rustls::Error> {
        let spki = ParsedCertificate::try_from(end_entity)?.subject_public_key_info();
        let found = ServerPin::of_spki(&spki);
        if found == self.pin {
            return Ok(ServerCertVerified::assertion());
        }
        *self.stranger.lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
        Err(CertificateError::ApplicationVerificationFailure.into())
    }

    /// Never asked for: only TLS 1.3 is spoken.
    fn verify_tls12_signature(
        &self,
        _message: &[u8],
        _cert: &CertificateDer<'_>,
        _signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        Err(rustls::Error::General("TLS 1.2 is not spoken".to_owned()))
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

    /// All, so that a server of another make is told by its fingerprint instead of by a failed handshake.
    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        let algorithms = &self.provider.signature_verification_algorithms;
        algorithms.supported_schemes()
    }
}
