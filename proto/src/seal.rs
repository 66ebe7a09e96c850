//! Sealed datagrams: AES-128-GCM, header authenticated, keys of one session and direction.
//!
//! nonce = salt xor (0⁴ ‖ sequence, big-endian); additional data = the 24 header bytes.
//!
//! Keys roll without a word between the ends: the packets of one direction are numbered from 0 to the end of the session, and number n
//! belongs to the key generation n / [`ROLL_PACKETS`], whose key and salt are HKDF(secret, generation). So both ends know the
//! generation of every packet from its authenticated header, in any order of arrival, and nothing has to be switched in step.
//! Time rolls them as well: who seals leaves out the numbers that a key has left when it has been in use for [`ROLL_NS`].
//! Numbers never start again: the [`Sealer`] alone hands them out, no nonce comes twice, no key is ever used up, and one replay window
//! spans the generations. What is older than the window is refused whatever its key, so the [`Opener`] drops an old key when the window has
//! left its numbers.

use crate::{
    DecodeError, EncodeError, Header, Kind, PROTOCOL_VERSION, Payload, VersionRange,
    derive::Root,
    header::{HEADER_BYTES, MAX_DATAGRAM_BYTES, TAG_BYTES},
    replay::{Freshness, ReplayWindow, WINDOW},
};
use ring::aead::{AES_128_GCM, Aad, LessSafeKey, NONCE_LEN, Nonce, UnboundKey};
use std::sync::{
    RwLock,
    atomic::{AtomicU64, Ordering},
};

/// Bytes of the secret of one direction, from which the keys of its generations come.
pub const KEY_MATERIAL_BYTES: usize = 28;
/// Packets that one key seals: 17 minutes at 1 kHz, and far below the limits of GCM.
pub const ROLL_PACKETS: u64 = 1 << 20;
/// Longest that one key is in use where few packets are sealed, ns: an hour.
pub const ROLL_NS: u64 = 3_600_000_000_000;

const ROOT_PURPOSE: &[u8] = b"taut datagram keys 1";
/// 16 bytes of key, then the salt.
const GENERATION_BYTES: usize = 16 + NONCE_LEN;

/// Why a datagram was not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SealError {
    /// The payload cannot be written.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// There is no group key yet.
    #[error("a datagram for the group was not sealed: the server has not told the group key yet")]
    NoGroup,
    /// Of a kind that must not travel under a group key, or not from here.
    #[error("a datagram was not sealed: a group key may not carry its kind from this sender")]
    Misplaced,
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
    /// Of a kind that must not travel under a group key, or from a member that may not say it.
    #[error("a datagram is sealed by a group key, which may not carry its kind from its sender")]
    Misplaced,
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
    /// One past the highest sequence number seen before this one; where numbers were left out for a new key, the first of that key.
    pub expected: u64,
}

/// Key and salt of one generation.
struct GenerationKey {
    generation: u64,
    key: LessSafeKey,
    salt: [u8; NONCE_LEN],
}

impl GenerationKey {
    /// About two microseconds, no allocation.
    fn of(root: &Root, generation: u64) -> GenerationKey {
        let material = root.key::<GENERATION_BYTES>(&[&generation.to_le_bytes()]);
        let (key, salt) = material.split_at(16);
        let mut own_salt = [0; NONCE_LEN];
        own_salt.copy_from_slice(salt);
        let Ok(key) = UnboundKey::new(&AES_128_GCM, key) else {
            unreachable!("AES-128 takes 16 bytes");
        };
        GenerationKey {
            generation,
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

/// The number that was to come, `next` being one past the highest before `sequence`: numbers that were left out for a new key are not missing.
fn expected(next: u64, sequence: u64) -> u64 {
    let begins = generation_of(sequence) * ROLL_PACKETS;
    let left_out = begins > next && sequence - next > WINDOW;
    if left_out { begins } else { next }
}

fn generation_of(sequence: u64) -> u64 {
    sequence / ROLL_PACKETS
}

/// Seals one direction of one session. Shared by threads, none of which ever waits for another.
pub struct Sealer {
    root: Root,
    /// The key of generation g, if it is in place g mod 2. Who finds another one there derives its own, and leaves it if nobody reads.
    keys: [RwLock<GenerationKey>; 2],
    epoch: u32,
    sender: u16,
    flags: u16,
    version: u8,
    next: AtomicU64,
    /// Since when the present key is in use, as [`Sealer::roll_by_time`] was told; 0 before.
    in_use_since_ns: AtomicU64,
}

/// Room for one datagram. Reused, so that sending allocates nothing.
pub type DatagramBuffer = [u8; MAX_DATAGRAM_BYTES];

impl Sealer {
    /// `sender` and `epoch` go into every header. One sealer per secret, epoch and sender: two would give one number twice.
    pub fn new(material: &[u8; KEY_MATERIAL_BYTES], epoch: u32, sender: u16) -> Sealer {
        Sealer::flagged(material, epoch, sender, 0)
    }

    /// The same with flags in every header.
    pub(crate) fn flagged(
        material: &[u8; KEY_MATERIAL_BYTES],
        epoch: u32,
        sender: u16,
        flags: u16,
    ) -> Sealer {
        let root = Root::new(ROOT_PURPOSE, material);
        let keys = [0, 1].map(|generation| RwLock::new(GenerationKey::of(&root, generation)));
        Sealer {
            root,
            keys,
            epoch,
            sender,
            flags,
            version: PROTOCOL_VERSION,
            next: AtomicU64::new(0),
            in_use_since_ns: AtomicU64::new(0),
        }
    }

    /// The same under the version that both ends agreed on, where it is not the newest.
    #[must_use]
    pub fn speaking(self, version: u8) -> Sealer {
        Sealer { version, ..self }
    }

    /// The number of the next packet will be `sequence` at least. Never goes back: no number is given twice.
    pub fn skip_to(&self, sequence: u64) {
        self.next.fetch_max(sequence, Ordering::Relaxed);
    }

    /// Goes on with the next key if the present one has been in use for [`ROLL_NS`]. Call it now and then, with any clock that does not fall; costs
    /// one load.
    pub fn roll_by_time(&self, now_ns: u64) {
        let now_ns = now_ns.max(1);
        let since_ns = self.in_use_since_ns.load(Ordering::Relaxed);
        if since_ns != 0 && now_ns.saturating_sub(since_ns) < ROLL_NS {
            return;
        }
        // Of several threads one rolls.
        let mine = self.in_use_since_ns.compare_exchange(
            since_ns,
            now_ns,
            Ordering::Relaxed,
            Ordering::Relaxed,
        );
        if mine.is_ok() && since_ns != 0 {
            let present = generation_of(self.next.load(Ordering::Relaxed));
            self.skip_to((present + 1) * ROLL_PACKETS);
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
        // 2^64 packets are not sent: 584 million years at 1 kHz.
        let sequence = self.next.fetch_add(1, Ordering::Relaxed);
        let header = Header {
            version: self.version,
            kind,
            epoch: self.epoch,
            sender: self.sender,
            flags: self.flags,
            sequence,
            length: length as u16, // at most MAX_PAYLOAD_BYTES
        }
        .to_bytes();
        let (head, rest) = buffer.split_at_mut(HEADER_BYTES);
        let (body, after) = rest.split_at_mut(length);
        let tag = self.with_key(generation_of(sequence), |key| {
            key.key
                .seal_in_place_separate_tag(key.nonce(sequence), Aad::from(&header), body)
                .map_err(|_| EncodeError::BufferFull)
        })?;
        head.copy_from_slice(&header);
        after[..TAG_BYTES].copy_from_slice(tag.as_ref());
        Ok(&buffer[..HEADER_BYTES + length + TAG_BYTES])
    }

    /// Uses the key of `generation`. Waits for nobody: while another thread is at its place, it is derived once more.
    fn with_key<T>(&self, generation: u64, seal: impl FnOnce(&GenerationKey) -> T) -> T {
        let place = &self.keys[(generation % 2) as usize];
        if let Ok(key) = place.try_read()
            && key.generation == generation
        {
            return seal(&key);
        }
        let key = GenerationKey::of(&self.root, generation);
        let sealed = seal(&key);
        if let Ok(mut kept) = place.try_write()
            && kept.generation < generation
        {
            *kept = key;
        }
        sealed
    }
}

/// Opens one direction of one session, each datagram once.
pub struct Opener {
    root: Root,
    /// Of the newest packet so far.
    current: GenerationKey,
    /// Of the generation before, while the window holds numbers of it.
    previous: Option<GenerationKey>,
    /// Of a later generation that a header claims, until a packet proves it; kept so that forgeries cost no derivation each.
    claimed: Option<GenerationKey>,
    epoch: u32,
    sender: u16,
    flags: u16,
    version: u8,
    window: ReplayWindow,
    scratch: DatagramBuffer,
}

impl Opener {
    /// Accepts datagrams of `sender` and `epoch` only.
    pub fn new(material: &[u8; KEY_MATERIAL_BYTES], epoch: u32, sender: u16) -> Opener {
        Opener::flagged(material, epoch, sender, 0)
    }

    /// Accepts datagrams with these flags only.
    pub(crate) fn flagged(
        material: &[u8; KEY_MATERIAL_BYTES],
        epoch: u32,
        sender: u16,
        flags: u16,
    ) -> Opener {
        let root = Root::new(ROOT_PURPOSE, material);
        Opener {
            current: GenerationKey::of(&root, 0),
            root,
            previous: None,
            claimed: None,
            epoch,
            sender,
            flags,
            version: PROTOCOL_VERSION,
            window: ReplayWindow::default(),
            scratch: [0; MAX_DATAGRAM_BYTES],
        }
    }

    /// The same for the version that both ends agreed on, where it is not the newest.
    #[must_use]
    pub fn speaking(self, version: u8) -> Opener {
        Opener { version, ..self }
    }

    /// Opens `datagram`. Nothing that is not authentic changes the replay window. No allocation.
    pub fn open(&mut self, datagram: &[u8]) -> Result<Opened, OpenError> {
        let header = Header::parse(datagram).map_err(OpenError::Header)?;
        if header.version != self.version {
            return Err(OpenError::Header(DecodeError::WrongVersion {
                theirs: VersionRange::only(header.version),
                ours: VersionRange::only(self.version),
            }));
        }
        let ours = (self.epoch, self.sender, self.flags);
        // The last number cannot be marked as seen.
        if (header.epoch, header.sender, header.flags) != ours || header.sequence == u64::MAX {
            return Err(OpenError::Forged);
        }
        match self.window.check(header.sequence) {
            Freshness::Newest | Freshness::Late => {}
            Freshness::Duplicate | Freshness::TooOld => return Err(OpenError::Replayed),
        }
        let key = match key_for(
            generation_of(header.sequence),
            &self.root,
            &self.current,
            &self.previous,
            &mut self.claimed,
        ) {
            Some(key) => key,
            None => return Err(OpenError::Replayed), // of a generation whose key is gone
        };
        let sealed = &datagram[HEADER_BYTES..];
        let room = &mut self.scratch[..sealed.len()];
        room.copy_from_slice(sealed);
        let plain = key
            .key
            .open_in_place(
                key.nonce(header.sequence),
                Aad::from(&datagram[..HEADER_BYTES]),
                room,
            )
            .map_err(|_| OpenError::Forged)?;
        let expected = expected(self.window.next(), header.sequence);
        self.window.mark(header.sequence);
        let payload = Payload::decode(header.kind, plain).map_err(OpenError::Payload);
        let state_hash = match header.kind {
            Kind::Hot => crate::state::payload_hash(plain),
            Kind::Release => crate::state::payload_hash(crate::barrier::state_bytes(plain)),
            _ => 0,
        };
        self.roll_to(generation_of(header.sequence));
        Ok(Opened {
            header,
            payload: payload?,
            state_hash,
            expected,
        })
    }

    /// An authentic packet of `generation` came: the key that it proved becomes the current one, and what the window has left goes.
    fn roll_to(&mut self, generation: u64) {
        if generation > self.current.generation
            && let Some(proven) = self.claimed.take()
        {
            let last = std::mem::replace(&mut self.current, proven);
            // After a long silence generations may have been left out: late packets are of the one just before all the same.
            self.previous = Some(match generation - 1 {
                before if before == last.generation => last,
                before => GenerationKey::of(&self.root, before),
            });
        }
        let begins = self.current.generation * ROLL_PACKETS;
        if self.window.next() >= begins.saturating_add(WINDOW) {
            self.previous = None;
        }
    }
}

/// The key of `generation`, if a packet of it may still or already count.
fn key_for<'k>(
    generation: u64,
    root: &Root,
    current: &'k GenerationKey,
    previous: &'k Option<GenerationKey>,
    claimed: &'k mut Option<GenerationKey>,
) -> Option<&'k GenerationKey> {
    if generation == current.generation {
        return Some(current);
    }
    if generation < current.generation {
        return previous.as_ref().filter(|key| key.generation == generation);
    }
    if claimed
        .as_ref()
        .is_none_or(|key| key.generation != generation)
    {
        *claimed = Some(GenerationKey::of(root, generation));
    }
    claimed.as_ref()
}
