//! Sealed datagrams: AES-128-GCM, header authenticated, one key per session and direction.
//!
//! nonce = salt xor (0⁴ ‖ sequence, big-endian); additional data = the 24 header bytes. A key never seals one sequence number twice:
//! the [`Sealer`] alone hands them out, and stops at [`MAX_PACKETS`].

use crate::{
    DecodeError, EncodeError, Header, Kind, Payload,
    header::{HEADER_BYTES, MAX_DATAGRAM_BYTES, TAG_BYTES},
    replay::{Freshness, ReplayWindow},
};
use ring::aead::{AES_128_GCM, Aad, LessSafeKey, NONCE_LEN, Nonce, UnboundKey};
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of key material per direction: 16 of key, 12 of salt.
pub const KEY_MATERIAL_BYTES: usize = 28;
/// Packets that one key may seal: 34 years at 1 kHz, far below the limits of GCM.
pub const MAX_PACKETS: u64 = 1 << 40;

/// Why a datagram was not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SealError {
    /// The payload cannot be written.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The key is used up.
    #[error("a session has sealed all the packets that its key allows: connect again")]
    Exhausted,
}

/// Why a datagram was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// The header is not ours, or of another version.
    #[error(transparent)]
    Header(DecodeError),
    /// The seal is broken: another key, another epoch or sender, or changed bytes.
    #[error(
        "a datagram is not sealed by this session's key: it is forged, damaged or of an earlier session"
    )]
    Forged,
    /// Seen before, or too old to tell.
    #[error("a datagram was seen before: it is a duplicate or replayed")]
    Replayed,
    /// The seal is good, the payload is not.
    #[error(transparent)]
    Payload(DecodeError),
}

/// A datagram that was opened.
#[derive(Clone, Debug, PartialEq)]
pub struct Opened {
    /// Its header.
    pub header: Header,
    /// Its payload.
    pub payload: Payload,
    /// [`crate::state::payload_hash`] of the state's bytes, for HOT and RELEASE; 0 for the others.
    pub state_hash: u64,
    /// One past the highest sequence number seen before this one.
    pub expected: u64,
}

struct DirectionKey {
    key: LessSafeKey,
    salt: [u8; NONCE_LEN],
}

impl DirectionKey {
    fn new(material: &[u8; KEY_MATERIAL_BYTES]) -> DirectionKey {
        let (key, salt) = material.split_at(16);
        let mut own_salt = [0; NONCE_LEN];
        own_salt.copy_from_slice(salt);
        let Ok(key) = UnboundKey::new(&AES_128_GCM, key) else {
            unreachable!("AES-128 takes 16 bytes");
        };
        DirectionKey {
            key: LessSafeKey::new(key),
            salt: own_salt,
        }
    }

    fn nonce(&self, sequence: u64) -> Nonce {
        let mut nonce = self.salt;
        for (byte, of_sequence) in nonce[4..].iter_mut().zip(sequence.to_be_bytes()) {
            *byte ^= of_sequence;
        }
        Nonce::assume_unique_for_key(nonce)
    }
}

/// Seals one direction of one session. Shared by threads: sequence numbers come from an atomic.
pub struct Sealer {
    key: DirectionKey,
    epoch: u32,
    sender: u16,
    next: AtomicU64,
}

/// Room for one datagram. Reused, so that sending allocates nothing.
pub type DatagramBuffer = [u8; MAX_DATAGRAM_BYTES];

impl Sealer {
    /// `sender` and `epoch` go into every header.
    pub fn new(material: &[u8; KEY_MATERIAL_BYTES], epoch: u32, sender: u16) -> Sealer {
        Sealer {
            key: DirectionKey::new(material),
            epoch,
            sender,
            next: AtomicU64::new(0),
        }
    }

    /// Seals `payload` into `buffer` and returns the datagram. No allocation.
    pub fn seal<'a>(
        &self,
        payload: &Payload,
        buffer: &'a mut DatagramBuffer,
    ) -> Result<&'a [u8], SealError> {
        let room = &mut buffer[HEADER_BYTES..MAX_DATAGRAM_BYTES - TAG_BYTES];
        let length = payload.encode_into(room)?;
        self.seal_encoded(payload.kind(), length, buffer)
    }

    /// Seals a payload that is encoded already: `payload` is copied into `buffer`. No allocation.
    pub fn seal_bytes<'a>(
        &self,
        kind: Kind,
        payload: &[u8],
        buffer: &'a mut DatagramBuffer,
    ) -> Result<&'a [u8], SealError> {
        let room = &mut buffer[HEADER_BYTES..MAX_DATAGRAM_BYTES - TAG_BYTES];
        let Some(place) = room.get_mut(..payload.len()) else {
            return Err(EncodeError::BufferFull.into());
        };
        place.copy_from_slice(payload);
        self.seal_encoded(kind, payload.len(), buffer)
    }

    fn seal_encoded<'a>(
        &self,
        kind: Kind,
        length: usize,
        buffer: &'a mut DatagramBuffer,
    ) -> Result<&'a [u8], SealError> {
        let sequence = self.next.fetch_add(1, Ordering::Relaxed);
        if sequence >= MAX_PACKETS {
            self.next.store(MAX_PACKETS, Ordering::Relaxed);
            return Err(SealError::Exhausted);
        }
        let header = Header {
            kind,
            epoch: self.epoch,
            sender: self.sender,
            flags: 0,
            sequence,
            length: length as u16, // at most MAX_PAYLOAD_BYTES
        }
        .to_bytes();
        let (head, rest) = buffer.split_at_mut(HEADER_BYTES);
        let (body, after) = rest.split_at_mut(length);
        let tag = self
            .key
            .key
            .seal_in_place_separate_tag(self.key.nonce(sequence), Aad::from(&header), body)
            .map_err(|_| EncodeError::BufferFull)?;
        head.copy_from_slice(&header);
        after[..TAG_BYTES].copy_from_slice(tag.as_ref());
        Ok(&buffer[..HEADER_BYTES + length + TAG_BYTES])
    }
}

/// Opens one direction of one session, each datagram once.
pub struct Opener {
    key: DirectionKey,
    epoch: u32,
    sender: u16,
    window: ReplayWindow,
    scratch: DatagramBuffer,
}

impl Opener {
    /// Accepts datagrams of `sender` and `epoch` only.
    pub fn new(material: &[u8; KEY_MATERIAL_BYTES], epoch: u32, sender: u16) -> Opener {
        Opener {
            key: DirectionKey::new(material),
            epoch,
            sender,
            window: ReplayWindow::default(),
            scratch: [0; MAX_DATAGRAM_BYTES],
        }
    }

    /// Opens `datagram`. Nothing that is not authentic changes the replay window. No allocation.
    pub fn open(&mut self, datagram: &[u8]) -> Result<Opened, OpenError> {
        let header = Header::parse(datagram).map_err(OpenError::Header)?;
        if header.epoch != self.epoch || header.sender != self.sender {
            return Err(OpenError::Forged);
        }
        match self.window.check(header.sequence) {
            Freshness::Newest | Freshness::Late => {}
            Freshness::Duplicate | Freshness::TooOld => return Err(OpenError::Replayed),
        }
        let sealed = &datagram[HEADER_BYTES..];
        let room = &mut self.scratch[..sealed.len()];
        room.copy_from_slice(sealed);
        let plain = self
            .key
            .key
            .open_in_place(
                self.key.nonce(header.sequence),
                Aad::from(&datagram[..HEADER_BYTES]),
                room,
            )
            .map_err(|_| OpenError::Forged)?;
        let expected = self.window.next();
        self.window.mark(header.sequence);
        let payload = Payload::decode(header.kind, plain).map_err(OpenError::Payload)?;
        let state_hash = match header.kind {
            Kind::Hot => crate::state::payload_hash(plain),
            Kind::Release => crate::state::payload_hash(crate::barrier::state_bytes(plain)),
            _ => 0,
        };
        Ok(Opened {
            header,
            payload,
            state_hash,
            expected,
        })
    }
}
