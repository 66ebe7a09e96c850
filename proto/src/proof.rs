//! Proofs that a peer holds a secret, bound to one TLS connection.
//!
//! A proof is HMAC-SHA-256(secret, label ‖ exporter ‖ role ‖ grant ‖ issue ‖ node), where the exporter is 32 bytes of keying material of the
//! TLS connection (RFC 9266, channel binding): it cannot be used on any other connection, so a man in the middle gains nothing by
//! passing it on.

use crate::{DecodeError, EncodeError, Role, codec::Reader, codec::Wire, codec::Writer};
use ring::{
    digest::{SHA256, digest},
    hmac,
};
use std::fmt;
use zeroize::Zeroize;

/// Bytes of keying material that a proof is bound to.
pub const EXPORTER_BYTES: usize = 32;

const CLIENT_LABEL: &[u8] = b"taut client proof 2";
const SERVER_LABEL: &[u8] = b"taut server proof 2";
const FINGERPRINT_LABEL: &[u8] = b"taut credential fingerprint 1";

/// By what right a client joins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Grant {
    /// It holds the cluster key itself.
    Master,
    /// It holds a credential for its role and name.
    Node {
        /// Which issue of it, from 1.
        issue: u16,
    },
    /// It holds a credential for its role and any name.
    AnyNode {
        /// Which issue of it, from 1.
        issue: u16,
    },
}

impl Grant {
    const fn tag(self) -> u8 {
        match self {
            Grant::Master => 0,
            Grant::Node { .. } => 1,
            Grant::AnyNode { .. } => 2,
        }
    }

    /// Which issue of a credential; 0 for the cluster key.
    pub const fn issue(self) -> u16 {
        match self {
            Grant::Master => 0,
            Grant::Node { issue } | Grant::AnyNode { issue } => issue,
        }
    }
}

impl Wire for Grant {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        self.tag().write(to)?;
        self.issue().write(to)
    }
    fn read(from: &mut Reader<'_>) -> Result<Grant, DecodeError> {
        let (tag, issue) = (u8::read(from)?, u16::read(from)?);
        match tag {
            0 if issue == 0 => Ok(Grant::Master),
            0 => Err(DecodeError::Inconsistent { what: "issue" }),
            1 => Ok(Grant::Node { issue }),
            2 => Ok(Grant::AnyNode { issue }),
            tag => Err(DecodeError::UnknownTag { what: "grant", tag }),
        }
    }
}

/// The claim that a proof is over: who joins, and by what right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claim<'a> {
    /// What it joins as.
    pub role: Role,
    /// Its name.
    pub node: &'a str,
    /// By what right.
    pub grant: Grant,
}

/// The secret with which a client of one grant and the server prove themselves to each other. Wiped from memory when it is
/// dropped.
#[derive(Clone, PartialEq, Eq)]
pub struct JoinSecret([u8; 32]);

impl fmt::Debug for JoinSecret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JoinSecret(secret)")
    }
}

impl Drop for JoinSecret {
    fn drop(&mut self) {
        self.0.zeroize();
    }
}

impl JoinSecret {
    pub(crate) fn new(bytes: [u8; 32]) -> JoinSecret {
        JoinSecret(bytes)
    }

    pub(crate) fn bytes(&self) -> &[u8; 32] {
        &self.0
    }

    /// What the secret is known by: it cannot be found from it.
    pub(crate) fn fingerprint(&self) -> [u8; 32] {
        let mut bytes = [0; 32];
        let hashed = digest(&SHA256, &[FINGERPRINT_LABEL, &self.0].concat());
        bytes.copy_from_slice(hashed.as_ref());
        bytes
    }

    /// What a client shows.
    pub fn client_proof(&self, exporter: &[u8; EXPORTER_BYTES], claim: Claim<'_>) -> [u8; 32] {
        self.proof(&message(CLIENT_LABEL, exporter, claim))
    }

    /// What the server shows.
    pub fn server_proof(&self, exporter: &[u8; EXPORTER_BYTES], claim: Claim<'_>) -> [u8; 32] {
        self.proof(&message(SERVER_LABEL, exporter, claim))
    }

    /// Whether `proof` is a client's; constant time.
    pub fn verify_client(
        &self,
        proof: &[u8; 32],
        exporter: &[u8; EXPORTER_BYTES],
        claim: Claim<'_>,
    ) -> bool {
        self.verify(proof, &message(CLIENT_LABEL, exporter, claim))
    }

    /// Whether `proof` is the server's; constant time.
    pub fn verify_server(
        &self,
        proof: &[u8; 32],
        exporter: &[u8; EXPORTER_BYTES],
        claim: Claim<'_>,
    ) -> bool {
        self.verify(proof, &message(SERVER_LABEL, exporter, claim))
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
        hmac::Key::new(hmac::HMAC_SHA256, &self.0)
    }
}

/// Everything before the node name has a fixed length: no two inputs give one message.
fn message(label: &[u8], exporter: &[u8; EXPORTER_BYTES], claim: Claim<'_>) -> Vec<u8> {
    let role = [claim.role.code(), claim.grant.tag()];
    let issue = claim.grant.issue().to_le_bytes();
    [label, exporter, &role, &issue, claim.node.as_bytes()].concat()
}
