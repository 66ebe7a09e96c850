//! What clients know the server by: SHA-256 of its public key, as in its certificate (SubjectPublicKeyInfo, RFC 7469).

use crate::text::{hex, parse_hex};
use ring::digest::{SHA256, digest};
use std::fmt;

/// SubjectPublicKeyInfo of an Ed25519 key up to the 32 bytes of the key itself. Source: RFC 8410, section 4.
const ED25519_SPKI: [u8; 12] = [
    0x30, 0x2a, 0x30, 0x05, 0x06, 0x03, 0x2b, 0x65, 0x70, 0x03, 0x21, 0x00,
];
/// PKCS #8 of an Ed25519 key up to the 32 bytes of its seed. Source: RFC 8410, section 7.
const ED25519_PKCS8: [u8; 16] = [
    0x30, 0x2e, 0x02, 0x01, 0x00, 0x30, 0x05, 0x06, 0x03, 0x2b, 0x65, 0x70, 0x04, 0x22, 0x04, 0x20,
];

/// Fingerprint of a server's public key. It is no secret.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ServerPin([u8; 32]);

impl ServerPin {
    /// Of the public key in a certificate, DER.
    pub fn of_spki(spki: &[u8]) -> ServerPin {
        let mut bytes = [0; 32];
        bytes.copy_from_slice(digest(&SHA256, spki).as_ref());
        ServerPin(bytes)
    }

    /// Of the 32 bytes of an Ed25519 public key.
    pub fn of_ed25519(public_key: &[u8]) -> ServerPin {
        ServerPin::of_spki(&[&ED25519_SPKI, public_key].concat())
    }

    /// Reads 64 hexadecimal digits; the error is how many usable ones there are.
    pub fn parse(text: &str) -> Result<ServerPin, usize> {
        parse_hex(text).map(ServerPin)
    }

    /// All 64 digits.
    pub fn to_hex(&self) -> String {
        hex(&self.0)
    }
}

/// The first 16 digits in groups of four: enough for people to tell two servers apart. Programs compare all of it.
impl fmt::Display for ServerPin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&grouped(&self.0))
    }
}

impl fmt::Debug for ServerPin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ServerPin({self})")
    }
}

/// The first eight bytes, `0123:4567:89ab:cdef`.
pub(crate) fn grouped(bytes: &[u8; 32]) -> String {
    let digits = hex(&bytes[..8]);
    [&digits[..4], &digits[4..8], &digits[8..12], &digits[12..16]].join(":")
}

/// An Ed25519 private key of this seed as PKCS #8, DER.
pub fn ed25519_pkcs8(seed: &[u8; 32]) -> Vec<u8> {
    [&ED25519_PKCS8[..], seed].concat()
}
