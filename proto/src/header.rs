//! Outer header of every datagram: 24 bytes, sent clear, authenticated with the payload.
//!
//! | offset | field    | bytes | meaning                                                  |
//! |--------|----------|-------|----------------------------------------------------------|
//! | 0      | magic    | 2     | [`MAGIC`]                                                |
//! | 2      | version  | 1     | the one that both ends agreed on at join                 |
//! | 3      | kind     | 1     | [`Kind`]                                                 |
//! | 4      | epoch    | 4     | incarnation of the server                                |
//! | 8      | sender   | 2     | session number of the client; 0 is the server            |
//! | 10     | flags    | 2     | under which key, see [`Header::flags`]                   |
//! | 12     | sequence | 8     | per session and direction, strictly increasing; the nonce |
//! | 20     | length   | 2     | payload bytes, without the tag                           |
//! | 22     | reserved | 2     | 0                                                        |

use crate::{DecodeError, codec::codes, version::MAGIC};

/// Bytes of the header.
pub const HEADER_BYTES: usize = 24;
/// Bytes of the authentication tag after the payload.
pub const TAG_BYTES: usize = 16;
/// Most bytes of a datagram, so that it also fits a QUIC datagram on a path of 1200 bytes.
pub const MAX_DATAGRAM_BYTES: usize = 1150;
/// Most bytes of a payload.
pub const MAX_PAYLOAD_BYTES: usize = MAX_DATAGRAM_BYTES - HEADER_BYTES - TAG_BYTES;

/// What a datagram carries. Number 1 is kept for bulk state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// [`crate::HotState`], server to client.
    Hot,
    /// [`crate::events::EventAck`], client to server.
    EventAck,
    /// [`crate::time::TimeRequest`], client to server.
    TimeRequest,
    /// [`crate::time::TimeResponse`], server to client.
    TimeResponse,
    /// [`crate::barrier::Arrive`], render node to the master of frames.
    Arrive,
    /// [`crate::barrier::Release`], master of frames to render nodes.
    Release,
    /// No payload: opens the path and says "alive".
    Heartbeat,
    /// [`crate::InputSample`], device bridge to server.
    Input,
    /// [`crate::WrenchCommand`], server to device bridge.
    Wrench,
    /// [`crate::ConstraintPart`], server to device bridge.
    Constraints,
    /// [`crate::HeadSample`], head tracker to server.
    Head,
    /// [`crate::Confirmation`], server to a client that hears the group.
    Confirm,
    /// [`crate::path::PathToken`], server to client: "who is there?"
    PathChallenge,
    /// [`crate::path::PathToken`], client to server, from where the challenge arrived.
    PathResponse,
    /// [`crate::ForceSample`], force source to server.
    Force,
    /// [`crate::PassedForce`], server to device bridge.
    PassedForce,
}

codes!(Kind, "datagram kind" {
    Hot = 0, EventAck = 2, TimeRequest = 3, TimeResponse = 4, Arrive = 5, Release = 6, Heartbeat = 7, Input = 8, Wrench = 9,
    Constraints = 10, Head = 11, Confirm = 12, PathChallenge = 13, PathResponse = 14, Force = 15, PassedForce = 16,
});

/// The header's fields that vary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Version of the protocol; whoever opens the datagram compares it with the one of the session.
    pub version: u8,
    /// What the payload is.
    pub kind: Kind,
    /// Incarnation of the server: drawn at random when a session of it starts.
    pub epoch: u32,
    /// Session number of the client; 0 is the server.
    pub sender: u16,
    /// 0 under a session's own keys; [`crate::group::FLAG_GROUP`] and the low bits of the group's generation under a group key.
    pub flags: u16,
    /// Per session and direction, strictly increasing: nonce and replay index.
    pub sequence: u64,
    /// Payload bytes, without the tag.
    pub length: u16,
}

impl Header {
    /// The 24 bytes.
    pub fn to_bytes(self) -> [u8; HEADER_BYTES] {
        let mut bytes = [0; HEADER_BYTES];
        bytes[0..2].copy_from_slice(&MAGIC.to_le_bytes());
        bytes[2] = self.version;
        bytes[3] = self.kind.code();
        bytes[4..8].copy_from_slice(&self.epoch.to_le_bytes());
        bytes[8..10].copy_from_slice(&self.sender.to_le_bytes());
        bytes[10..12].copy_from_slice(&self.flags.to_le_bytes());
        bytes[12..20].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[20..22].copy_from_slice(&self.length.to_le_bytes());
        bytes
    }

    /// Reads the header of `datagram` and checks magic, kind, length against the datagram's, and the reserved bytes.
    pub fn parse(datagram: &[u8]) -> Result<Header, DecodeError> {
        let Some((bytes, rest)) = datagram.split_first_chunk::<HEADER_BYTES>() else {
            return Err(DecodeError::Truncated);
        };
        let u16_at = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let u32_at = |at: usize| u32::from(u16_at(at)) | u32::from(u16_at(at + 2)) << 16;
        let u64_at = |at: usize| u64::from(u32_at(at)) | u64::from(u32_at(at + 4)) << 32;
        if u16_at(0) != MAGIC {
            return Err(DecodeError::WrongMagic);
        }
        let header = Header {
            version: bytes[2],
            kind: Kind::from_code(bytes[3])?,
            epoch: u32_at(4),
            sender: u16_at(8),
            flags: u16_at(10),
            sequence: u64_at(12),
            length: u16_at(20),
        };
        if u16_at(22) != 0 {
            return Err(DecodeError::Inconsistent { what: "reserved" });
        }
        let expected = usize::from(header.length) + TAG_BYTES;
        if rest.len() < expected {
            return Err(DecodeError::Truncated);
        }
        if rest.len() > expected || datagram.len() > MAX_DATAGRAM_BYTES {
            return Err(DecodeError::TrailingBytes {
                left: rest.len() - expected,
            });
        }
        Ok(header)
    }
}
