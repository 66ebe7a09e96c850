//! Datagrams that must not be accepted: what an attacker makes who sees everything, knows the protocol, and lacks the session's keys.
//!
//! A [`Forger`] has the genuine datagrams of a session as they went by, and keys of its own. Every forgery that it makes differs from every
//! genuine datagram that the receiver has not taken yet.

use taut_proto::{
    Payload,
    header::{HEADER_BYTES, MAX_DATAGRAM_BYTES, MAX_PAYLOAD_BYTES, TAG_BYTES},
    seal::{KEY_MATERIAL_BYTES, Opener, Sealer},
};

use crate::random::Random;

/// How a forgery is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Forgery {
    /// Random bytes of random length.
    Noise,
    /// A right header, random payload and tag.
    RightHeader,
    /// A genuine datagram that the receiver has taken.
    Replayed,
    /// A genuine one that it has not, cut short.
    Truncated,
    /// The same with more bytes.
    Extended,
    /// The same with one wrong bit.
    BitFlipped,
    /// The same with another header field: kind, epoch, sender, flags, sequence or length.
    HeaderChanged,
    /// Well sealed, but by a key of the attacker's own.
    OtherKey,
    /// Header of one genuine datagram, payload and tag of another.
    Spliced,
    /// A genuine datagram of the other direction.
    Reflected,
}

/// All of them.
pub const FORGERIES: [Forgery; 10] = [
    Forgery::Noise,
    Forgery::RightHeader,
    Forgery::Replayed,
    Forgery::Truncated,
    Forgery::Extended,
    Forgery::BitFlipped,
    Forgery::HeaderChanged,
    Forgery::OtherKey,
    Forgery::Spliced,
    Forgery::Reflected,
];

/// What an attacker has seen of one direction.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// Datagrams that the receiver took, newest last.
    pub taken: Vec<Vec<u8>>,
    /// One that it has not got yet.
    pub coming: Vec<u8>,
    /// One of the other direction.
    pub other_way: Vec<u8>,
}

/// Makes forgeries by a seed.
pub struct Forger {
    random: Random,
    own: Sealer,
}

impl Forger {
    /// A forger whose own key is of the same epoch and sender as the one that it forges.
    pub fn new(seed: u64, epoch: u32, sender: u16) -> Forger {
        let mut random = Random(seed);
        let mut material = [0; KEY_MATERIAL_BYTES];
        random.fill(&mut material);
        Forger {
            random,
            own: Sealer::new(&material, epoch, sender),
        }
    }

    /// Makes one into `buffer`; its length. `payload` is what [`Forgery::OtherKey`] seals.
    pub fn forge(
        &mut self,
        forgery: Forgery,
        seen: &Seen,
        payload: &Payload,
        buffer: &mut [u8; MAX_FORGED_BYTES],
    ) -> usize {
        let random = &mut self.random;
        match forgery {
            Forgery::Noise => {
                let length = random.below(MAX_DATAGRAM_BYTES + 50);
                random.fill(&mut buffer[..length]);
                length
            }
            Forgery::RightHeader => {
                let length = HEADER_BYTES + random.below(MAX_PAYLOAD_BYTES) + TAG_BYTES;
                random.fill(&mut buffer[HEADER_BYTES..length]);
                buffer[..HEADER_BYTES].copy_from_slice(&seen.coming[..HEADER_BYTES]);
                set_payload_length(buffer, length);
                length
            }
            Forgery::Replayed => put(buffer, &seen.taken[random.below(seen.taken.len())]),
            Forgery::Reflected => put(buffer, &seen.other_way),
            Forgery::Truncated => {
                put(buffer, &seen.coming);
                let length = random.below(seen.coming.len());
                if length > HEADER_BYTES + TAG_BYTES && random.chance(0.5) {
                    set_payload_length(buffer, length); // so that the header agrees
                }
                length
            }
            Forgery::Extended => {
                let genuine = put(buffer, &seen.coming);
                let length = (genuine + 1 + random.below(100)).min(buffer.len());
                random.fill(&mut buffer[genuine..length]);
                if length <= MAX_DATAGRAM_BYTES && random.chance(0.5) {
                    set_payload_length(buffer, length);
                }
                length
            }
            Forgery::BitFlipped => {
                let length = put(buffer, &seen.coming);
                let bit = random.below(8 * length);
                buffer[bit / 8] ^= 1 << (bit % 8);
                length
            }
            Forgery::HeaderChanged => {
                let length = put(buffer, &seen.coming);
                // From kind on: offset and bytes of the fields of the header's table, `reserved` included.
                let fields = [(3, 1), (4, 4), (8, 2), (10, 2), (12, 8), (20, 2), (22, 2)];
                let (at, bytes) = fields[random.below(fields.len())];
                let change = 1 + random.below(255) as u8; // not zero: something changes
                buffer[at + random.below(bytes)] ^= change;
                length
            }
            Forgery::OtherKey => {
                let mut own = [0; MAX_DATAGRAM_BYTES];
                let sealed = self.own.seal(payload, &mut own);
                put(buffer, sealed.unwrap_or_else(|error| panic!("{error}")))
            }
            Forgery::Spliced => {
                let body = &seen.taken[random.below(seen.taken.len())];
                let length = put(buffer, body);
                buffer[..HEADER_BYTES].copy_from_slice(&seen.coming[..HEADER_BYTES]);
                set_payload_length(buffer, length);
                length
            }
        }
    }
}

/// Room for any forgery: a little more than a receiver takes.
pub const MAX_FORGED_BYTES: usize = MAX_DATAGRAM_BYTES + 100;

fn put(buffer: &mut [u8], datagram: &[u8]) -> usize {
    buffer[..datagram.len()].copy_from_slice(datagram);
    datagram.len()
}

/// Makes the header's length field agree with a datagram of `length` bytes.
fn set_payload_length(buffer: &mut [u8], length: usize) {
    let payload = (length - HEADER_BYTES - TAG_BYTES) as u16;
    buffer[20..22].copy_from_slice(&payload.to_le_bytes());
}

/// One direction of a session for tests: a sealer and an opener of the same key.
pub struct OneWay {
    /// The sender's end.
    pub sealer: Sealer,
    /// The receiver's end.
    pub opener: Opener,
}

impl OneWay {
    /// Keys by a seed.
    pub fn new(seed: u64, epoch: u32, sender: u16) -> OneWay {
        let mut material = [0; KEY_MATERIAL_BYTES];
        Random(seed).fill(&mut material);
        OneWay {
            sealer: Sealer::new(&material, epoch, sender),
            opener: Opener::new(&material, epoch, sender),
        }
    }

    /// The next genuine datagram.
    pub fn genuine(&self, payload: &Payload) -> Vec<u8> {
        let mut buffer = [0; MAX_DATAGRAM_BYTES];
        let sealed = self.sealer.seal(payload, &mut buffer);
        sealed.unwrap_or_else(|error| panic!("{error}")).to_vec()
    }
}

/// A payload of every kind: those of the golden datagrams.
pub fn payload_of_every_kind() -> Vec<Payload> {
    let material = std::array::from_fn(|i| i as u8);
    let mut opener = Opener::new(&material, 0x0102_0304, 5);
    let golden = include_str!("../../../proto/tests/golden.txt");
    let digits = golden
        .lines()
        .filter_map(|line| line.strip_prefix("datagram/")?.split_once(' '));
    let datagrams = digits.map(|(name, digits)| {
        let bytes: Vec<u8> = (0..digits.len() / 2)
            .filter_map(|i| u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).ok())
            .collect();
        (name, bytes)
    });
    let opened = datagrams.map(|(name, bytes)| match opener.open(&bytes) {
        Ok(opened) => opened.payload,
        Err(error) => panic!("{name}: {error}"),
    });
    opened.collect()
}

/// What came of [`attack`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Attack {
    /// Forgeries tried.
    pub forged: u64,
    /// Forgeries accepted: must be 0.
    pub accepted: u64,
    /// Genuine datagrams sent between them.
    pub genuine: u64,
    /// Genuine ones refused: must be 0, or a forgery had an effect.
    pub refused: u64,
}

/// `forgeries` of every sort, kind and direction against the opening of datagrams, with genuine datagrams between them.
pub fn attack(forgeries: u64, seed: u64) -> Attack {
    const EPOCH: u32 = 0x5eed;
    const PER_GENUINE: u64 = 40;
    const KEPT: usize = 64;
    let payloads = payload_of_every_kind();
    let mut ways = [OneWay::new(seed, EPOCH, 7), OneWay::new(seed + 1, EPOCH, 0)];
    let mut forgers = [
        Forger::new(seed + 2, EPOCH, 7),
        Forger::new(seed + 3, EPOCH, 0),
    ];
    let mut seen = [Seen::default(), Seen::default()];
    let mut result = Attack::default();
    let mut buffer = [0; MAX_FORGED_BYTES];
    let mut round = 0;
    while result.forged < forgeries {
        let payload = &payloads[round / 2 % payloads.len()];
        let (this, other) = (round % 2, (round + 1) % 2);
        seen[this].coming = ways[this].genuine(payload);
        seen[this].other_way = ways[other].genuine(payload);
        for number in 0..PER_GENUINE {
            let forgery = FORGERIES[number as usize % FORGERIES.len()];
            let needs_taken = matches!(forgery, Forgery::Replayed | Forgery::Spliced);
            if needs_taken && seen[this].taken.is_empty() {
                continue;
            }
            let length = forgers[this].forge(forgery, &seen[this], payload, &mut buffer);
            result.forged += 1;
            result.accepted += u64::from(ways[this].opener.open(&buffer[..length]).is_ok());
        }
        result.genuine += 1;
        let coming = std::mem::take(&mut seen[this].coming);
        result.refused += u64::from(ways[this].opener.open(&coming).is_err());
        let taken = &mut seen[this].taken;
        if taken.len() < KEPT {
            taken.push(coming);
        } else {
            taken[round / 2 % KEPT] = coming;
        }
        round += 1;
    }
    result
}
