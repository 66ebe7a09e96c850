//! Sealed datagrams: what is sealed opens once; anything else is refused.

use crate::samples::{must, sealed};
use proptest::prelude::*;
use taut_proto::{
    ArrayVec, DecodeError, HotState, InputSample, Kind, PROTOCOL_VERSION, Payload, PoseF32,
    PoseF64, VersionRange,
    barrier::{Release, ReleaseHead},
    header::{HEADER_BYTES, MAX_DATAGRAM_BYTES},
    seal::{DatagramBuffer, OpenError, Opener, Sealer},
    state::{
        BodyState, ContactState, EventRecord, HeadState, MAX_BODIES, MAX_CONTACTS, MAX_EVENTS,
        MAX_TOOLS, RunState, ToolState,
    },
};

const MATERIAL: [u8; 28] = [0x5a; 28];
const EPOCH: u32 = 77;
const SENDER: u16 = 3;

fn pair() -> (Sealer, Opener) {
    (
        Sealer::new(&MATERIAL, EPOCH, SENDER),
        Opener::new(&MATERIAL, EPOCH, SENDER),
    )
}

fn buffer() -> DatagramBuffer {
    [0; MAX_DATAGRAM_BYTES]
}

fn input(index: u64) -> Payload {
    Payload::Input(InputSample {
        sample_time_ns: 5,
        clock_uncertainty_ns: 7,
        index,
        pose: PoseF64::IDENTITY,
        velocity: [0.5; 6],
        buttons: 1,
        flags: 0,
        rendered: [0.0; 6],
        set_made_ns: 0,
    })
}

fn fullest() -> HotState {
    HotState {
        sample_time_ns: 1 << 61,
        tick: 1 << 61,
        scene_revision: u32::MAX,
        run: RunState::Fault,
        constraint_age_us: u32::MAX,
        head: HeadState::default(),
        tools: ArrayVec::from([ToolState::default(); MAX_TOOLS]),
        bodies: ArrayVec::from(
            [BodyState {
                id: 1,
                flags: 0,
                pose: PoseF32::IDENTITY,
            }; MAX_BODIES],
        ),
        contacts: ArrayVec::from(
            [ContactState {
                pair: [0, 1],
                point: [0.0; 3],
                normal: [0.0, 0.0, 1.0],
                force: 1.0,
                gap: 0.0,
            }; MAX_CONTACTS],
        ),
        events: ArrayVec::from(
            [EventRecord {
                id: 1,
                tick: 2,
                code: 3,
            }; MAX_EVENTS],
        ),
    }
}

#[test]
fn the_fullest_state_fits_a_quic_datagram_at_the_smallest_mtu() {
    let (sealer, mut opener) = pair();
    let state = fullest();
    let datagram = sealed(&sealer, &Payload::Hot(state.clone()));
    assert_eq!(datagram.len(), 1036);
    assert!(datagram.len() <= MAX_DATAGRAM_BYTES);
    let opened = must(opener.open(&datagram));
    assert_eq!(opened.payload, Payload::Hot(state.clone()));
    assert_eq!(Ok(opened.state_hash), state.hash());
}

#[test]
fn a_datagram_opens_once() {
    let (sealer, mut opener) = pair();
    let datagram = sealed(&sealer, &input(1));
    assert!(opener.open(&datagram).is_ok());
    assert_eq!(opener.open(&datagram), Err(OpenError::Replayed));
}

#[test]
fn sequence_numbers_grow_and_gaps_can_be_seen() {
    let (sealer, mut opener) = pair();
    let datagrams: Vec<_> = (0..4).map(|index| sealed(&sealer, &input(index))).collect();
    let mut open = |at: usize| {
        opener
            .open(&datagrams[at])
            .map(|opened| (opened.header.sequence, opened.expected))
    };
    assert_eq!(open(0), Ok((0, 0)));
    assert_eq!(open(3), Ok((3, 1)), "two are missing");
    assert_eq!(open(2), Ok((2, 4)), "one comes late");
}

#[test]
fn every_flipped_bit_and_every_truncation_is_refused() {
    let (sealer, mut opener) = pair();
    let datagram = sealed(&sealer, &input(1));
    for bit in 0..datagram.len() * 8 {
        let mut bent = datagram.clone();
        bent[bit / 8] ^= 1 << (bit % 8);
        assert!(opener.open(&bent).is_err(), "bit {bit}");
    }
    for length in 0..datagram.len() {
        assert!(opener.open(&datagram[..length]).is_err(), "{length} bytes");
    }
    let mut longer = datagram.clone();
    longer.push(0);
    assert!(opener.open(&longer).is_err());
    assert!(
        opener.open(&datagram).is_ok(),
        "and the forgeries did not use up its number"
    );
}

#[test]
fn another_key_epoch_or_sender_does_not_open() {
    let datagram = sealed(&pair().0, &input(1));
    let mut other_key = MATERIAL;
    other_key[0] ^= 1;
    let mut other_salt = MATERIAL;
    other_salt[27] ^= 1;
    for mut opener in [
        Opener::new(&other_key, EPOCH, SENDER),
        Opener::new(&other_salt, EPOCH, SENDER),
        Opener::new(&MATERIAL, EPOCH + 1, SENDER),
        Opener::new(&MATERIAL, EPOCH, SENDER + 1),
    ] {
        assert_eq!(opener.open(&datagram), Err(OpenError::Forged));
    }
}

#[test]
fn another_version_is_named() {
    let (sealer, mut opener) = pair();
    let mut datagram = sealed(&sealer, &input(1));
    datagram[2] = 9;
    let wrong = DecodeError::WrongVersion {
        theirs: VersionRange::only(9),
        ours: VersionRange::only(PROTOCOL_VERSION),
    };
    assert_eq!(opener.open(&datagram), Err(OpenError::Header(wrong)));
}

#[test]
fn a_good_seal_on_nonsense_is_an_error_of_the_payload() {
    let (sealer, mut opener) = pair();
    let mut buffer = buffer();
    let datagram = must(sealer.seal_bytes(Kind::Input, &[0xff; 3], &mut buffer));
    assert_eq!(
        opener.open(datagram),
        Err(OpenError::Payload(DecodeError::Truncated))
    );
}

#[test]
fn the_payload_is_not_readable_on_the_way() {
    let (sealer, _) = pair();
    let mut buffer = buffer();
    let secret = [0x42; 64];
    let datagram = must(sealer.seal_bytes(Kind::Hot, &secret, &mut buffer));
    assert!(
        !datagram[HEADER_BYTES..]
            .windows(4)
            .any(|window| window == [0x42; 4])
    );
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_are_refused_without_panic(bytes in prop::collection::vec(any::<u8>(), 0..1400)) {
        let (_, mut opener) = pair();
        prop_assert!(opener.open(&bytes).is_err());
    }

    #[test]
    fn a_forged_body_under_a_true_header_is_refused(sequence in any::<u64>(), body in prop::collection::vec(any::<u8>(), 16..1100)) {
        let header = taut_proto::Header {
            version: PROTOCOL_VERSION, kind: Kind::Input, epoch: EPOCH, sender: SENDER, flags: 0, sequence, length: (body.len() - 16) as u16,
        };
        let datagram = [&header.to_bytes()[..], &body].concat();
        let (_, mut opener) = pair();
        prop_assert_eq!(opener.open(&datagram), Err(OpenError::Forged));
    }
}

#[test]
fn the_fullest_release_fits_and_its_state_has_the_fingerprint_that_the_state_had() {
    let (sealer, mut opener) = pair();
    for members in [0_u16, 1, 32] {
        let release = Release {
            head: ReleaseHead {
                members: (1..=members).collect(),
                ..ReleaseHead::default()
            },
            state: fullest(),
        };
        let datagram = sealed(&sealer, &Payload::Release(release.clone()));
        let opened = opener.open(&datagram).expect("just sealed");
        assert_eq!(opened.payload, Payload::Release(release));
        assert_eq!(Ok(opened.state_hash), fullest().hash());
    }
}
