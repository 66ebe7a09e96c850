//! The cluster key: one secret per workbench, and the proofs that a peer holds it.
//!
//! A proof is HMAC-SHA-256(key, label ‖ exporter ‖ role ‖ node), where the exporter is 32 bytes of keying material of the TLS connection
//! (RFC 9266, channel binding): it cannot be used on any other connection, so a man in the middle gains nothing by passing it on.

use crate::Role;
use ring::{hmac, rand::SecureRandom};
use std::fmt;

/// Bytes of keying material that a proof is bound to.
pub const EXPORTER_BYTES: usize = 32;

const KEY_BYTES: usize = 32;
const CLIENT_LABEL: &[u8] = b"taut client proof 1";
const SERVER_LABEL: &[u8] = b"taut server proof 1";

/// Why a text is no key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// Not 64 hexadecimal digits.
    #[error(
        "a cluster key is 64 hexadecimal digits, this has {found} usable ones: copy the server's key file again"
    )]
    Malformed {
        /// Hexadecimal digits before the first other character.
        found: usize,
    },
    /// The system gives no random numbers.
    #[error("the system gives no random numbers for a cluster key: try again")]
    NoRandomness,
}

/// The secret that all members of a workbench share.
#[derive(Clone, PartialEq, Eq)]
pub struct ClusterKey {
    bytes: [u8; KEY_BYTES],
}

impl fmt::Debug for ClusterKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ClusterKey(secret)")
    }
}

impl ClusterKey {
    /// A fresh key from the system's random numbers.
    pub fn generate() -> Result<ClusterKey, KeyError> {
        let mut bytes = [0; KEY_BYTES];
        ring::rand::SystemRandom::new()
            .fill(&mut bytes)
            .map_err(|_| KeyError::NoRandomness)?;
        Ok(ClusterKey { bytes })
    }

    /// Reads 64 hexadecimal digits; blanks around them are ignored.
    pub fn parse(text: &str) -> Result<ClusterKey, KeyError> {
        let text = text.trim();
        let found = text.chars().take_while(char::is_ascii_hexdigit).count();
        if found != 2 * KEY_BYTES || text.len() != 2 * KEY_BYTES {
            return Err(KeyError::Malformed { found });
        }
        let (pairs, _) = text.as_bytes().as_chunks::<2>();
        let mut bytes = [0; KEY_BYTES];
        for (byte, [high, low]) in bytes.iter_mut().zip(pairs) {
            *byte = hex_digit(*high) << 4 | hex_digit(*low);
        }
        Ok(ClusterKey { bytes })
    }

    /// The 64 digits, for the key file. Show it to nobody else.
    pub fn to_hex(&self) -> String {
        self.bytes
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect()
    }

    /// What a client shows to prove the key.
    pub fn client_proof(
        &self,
        exporter: &[u8; EXPORTER_BYTES],
        role: Role,
        node: &str,
    ) -> [u8; 32] {
        self.proof(&message(CLIENT_LABEL, exporter, role, node))
    }

    /// What the server shows to prove the key.
    pub fn server_proof(
        &self,
        exporter: &[u8; EXPORTER_BYTES],
        role: Role,
        node: &str,
    ) -> [u8; 32] {
        self.proof(&message(SERVER_LABEL, exporter, role, node))
    }

    /// Whether `proof` is a client's; constant time.
    pub fn verify_client(
        &self,
        proof: &[u8; 32],
        exporter: &[u8; EXPORTER_BYTES],
        role: Role,
        node: &str,
    ) -> bool {
        self.verify(proof, &message(CLIENT_LABEL, exporter, role, node))
    }

    /// Whether `proof` is the server's; constant time.
    pub fn verify_server(
        &self,
        proof: &[u8; 32],
        exporter: &[u8; EXPORTER_BYTES],
        role: Role,
        node: &str,
    ) -> bool {
        self.verify(proof, &message(SERVER_LABEL, exporter, role, node))
    }

    fn proof(&self, message: &[u8]) -> [u8; 32] {
        let mut proof = [0; 32];
        proof.copy_from_slice(hmac::sign(&self.hmac_key(), message).as_ref());
        proof
    }

    fn verify(&self, proof: &[u8; 32], message: &[u8]) -> bool {
        hmac::verify(&self.hmac_key(), message, proof).is_ok()
    }

    fn hmac_key(&self) -> hmac::Key {
        hmac::Key::new(hmac::HMAC_SHA256, &self.bytes)
    }
}

/// Label, exporter and role have fixed lengths, the node name comes last: no two inputs give one message.
fn message(label: &[u8], exporter: &[u8; EXPORTER_BYTES], role: Role, node: &str) -> Vec<u8> {
    let role = match role {
        Role::Render => 0,
        Role::Device => 1,
        Role::Observer => 2,
        Role::Operator => 3,
    };
    [label, exporter, &[role], node.as_bytes()].concat()
}

/// Value of a digit that is known to be hexadecimal.
fn hex_digit(digit: u8) -> u8 {
    match digit {
        b'0'..=b'9' => digit - b'0',
        b'a'..=b'f' => digit - b'a' + 10,
        _ => {
            digit
                .to_ascii_lowercase()
                .wrapping_sub(b'a')
                .wrapping_add(10)
                & 0x0f
        }
    }
}
