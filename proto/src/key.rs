//! The cluster key: the master secret of a workbench, from which everything else is derived.
//!
//! | derived                        | by HKDF-SHA-256 over        | held by                              |
//! |--------------------------------|-----------------------------|--------------------------------------|
//! | the server's identity (Ed25519)| label                       | the server                           |
//! | secret of a credential         | label, role, issue, name    | one node, or all nodes of one role   |
//! | secret of the master           | label                       | whoever holds the key itself         |
//!
//! Nothing derived leads back to the key or across to another secret (RFC 5869), so that the server needs no list of credentials, and a
//! credential that is stolen opens nothing but its own role and name. Files: [`crate::credential`]; proofs: [`crate::proof`].

use crate::{
    Role,
    credential::{Credential, Holder},
    derive::Root,
    pin::ServerPin,
    proof::{Grant, JoinSecret},
    text::{hex, parse_hex},
};
use ring::{
    rand::SecureRandom,
    signature::{Ed25519KeyPair, KeyPair},
};
use std::fmt;
use zeroize::{Zeroize, Zeroizing};

const KEY_BYTES: usize = 32;
/// Domain of all derivations; the number goes up with their layout.
const SALT: &[u8] = b"taut cluster key 1";
const IDENTITY_LABEL: &[u8] = b"server identity";
const MASTER_LABEL: &[u8] = b"join master";
const NODE_LABEL: &[u8] = b"join node";
const ANY_NODE_LABEL: &[u8] = b"join any node";

/// Why a text is no key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// Not 64 hexadecimal digits.
    #[error(
        "a cluster key is 64 hexadecimal digits, this has {found} usable ones: make one with `taut keys`, or a credential of the one in use"
    )]
    Malformed {
        /// Hexadecimal digits before the first other character.
        found: usize,
    },
    /// The system gives no random numbers.
    #[error("the system gives no random numbers for a cluster key: try again")]
    NoRandomness,
}

/// The master secret of a workbench: its holder may be anything, the server included. Wiped from memory when it is dropped.
#[derive(Clone, PartialEq, Eq)]
pub struct ClusterKey {
    bytes: [u8; KEY_BYTES],
}

impl fmt::Debug for ClusterKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ClusterKey(secret)")
    }
}

impl Drop for ClusterKey {
    fn drop(&mut self) {
        self.bytes.zeroize();
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
        let bytes = parse_hex(text.trim()).map_err(|found| KeyError::Malformed { found })?;
        Ok(ClusterKey { bytes })
    }

    /// The 64 digits, for the key file. Show it to nobody else.
    pub fn to_hex(&self) -> String {
        hex(&self.bytes)
    }

    /// The seed of the server's Ed25519 identity. For the server alone.
    pub fn identity_seed(&self) -> Zeroizing<[u8; 32]> {
        self.derive(&[IDENTITY_LABEL])
    }

    /// What clients know the server by: the fingerprint of its public key.
    pub fn server_pin(&self) -> ServerPin {
        let Ok(pair) = Ed25519KeyPair::from_seed_unchecked(self.identity_seed().as_slice()) else {
            unreachable!("an Ed25519 seed has 32 bytes");
        };
        ServerPin::of_ed25519(pair.public_key().as_ref())
    }

    /// A credential for one role. The same arguments give the same credential, so that it can be written again.
    pub fn credential(&self, role: Role, holder: Holder, issue: u16) -> Credential {
        let (grant, node) = match &holder {
            Holder::Node(node) => (Grant::Node { issue }, node.as_str()),
            Holder::AnyNode => (Grant::AnyNode { issue }, ""),
        };
        let secret = self.join_secret(role, node, grant);
        Credential::new(role, holder, issue, self.server_pin(), secret)
    }

    /// The secret that a client of this role, name and grant must have.
    pub fn join_secret(&self, role: Role, node: &str, grant: Grant) -> JoinSecret {
        let role = [role.code()];
        let derived = match grant {
            Grant::Master => self.derive(&[MASTER_LABEL]),
            Grant::Node { issue } => {
                self.derive(&[NODE_LABEL, &role, &issue.to_le_bytes(), node.as_bytes()])
            }
            Grant::AnyNode { issue } => self.derive(&[ANY_NODE_LABEL, &role, &issue.to_le_bytes()]),
        };
        JoinSecret::new(*derived)
    }

    /// The labels have no common beginning, role and issue have fixed lengths, the name comes last: no two inputs give one message.
    fn derive(&self, info: &[&[u8]]) -> Zeroizing<[u8; 32]> {
        Root::new(SALT, &self.bytes).key(info)
    }
}
