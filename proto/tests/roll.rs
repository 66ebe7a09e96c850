//! Keys that roll: no gap, no second use of a nonce, no way back for an attacker.

use crate::samples::{must, sealed};
use proptest::prelude::*;
use std::collections::HashSet;
use taut_proto::{
    Payload,
    header::MAX_DATAGRAM_BYTES,
    replay::WINDOW,
    seal::{OpenError, Opener, ROLL_NS, ROLL_PACKETS, Sealer},
    time::TimeRequest,
};

const MATERIAL: [u8; 28] = [0x5a; 28];

fn pair() -> (Sealer, Opener) {
    (Sealer::new(&MATERIAL, 1, 2), Opener::new(&MATERIAL, 1, 2))
}

fn seal(sealer: &Sealer, value: u64) -> Vec<u8> {
    sealed(
        sealer,
        &Payload::TimeRequest(TimeRequest { client_sent: value }),
    )
}

fn sequence(datagram: &[u8]) -> u64 {
    datagram[12..20]
        .try_into()
        .map_or(u64::MAX, u64::from_le_bytes)
}

#[test]
fn a_whole_generation_is_sealed_and_opened_and_the_next_one_goes_on() {
    let (sealer, mut opener) = pair();
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    for number in 0..ROLL_PACKETS + 2 * WINDOW {
        let datagram = must(sealer.seal(&Payload::Heartbeat, &mut buffer));
        let opened = opener
            .open(datagram)
            .unwrap_or_else(|error| panic!("{number}: {error}"));
        assert_eq!((opened.header.sequence, opened.expected), (number, number));
    }
}

#[test]
fn a_key_is_left_after_an_hour_and_what_was_left_out_is_not_missing() {
    let (sealer, mut opener) = pair();
    let start = 5 * ROLL_NS; // any clock
    let mut counts = |sealer: &Sealer| {
        let datagram = seal(sealer, 1);
        let opened = must(opener.open(&datagram));
        (opened.header.sequence, opened.expected)
    };
    sealer.roll_by_time(start);
    assert_eq!(counts(&sealer), (0, 0));
    sealer.roll_by_time(start + ROLL_NS - 1);
    assert_eq!(counts(&sealer), (1, 1));
    sealer.roll_by_time(start + ROLL_NS);
    sealer.roll_by_time(start + ROLL_NS + 1);
    assert_eq!(counts(&sealer), (ROLL_PACKETS, ROLL_PACKETS));
    assert_eq!(counts(&sealer), (ROLL_PACKETS + 1, ROLL_PACKETS + 1));
    // The first of a key may be lost like any other.
    sealer.roll_by_time(start + 2 * ROLL_NS);
    let _ = seal(&sealer, 2);
    assert_eq!(counts(&sealer), (2 * ROLL_PACKETS + 1, 2 * ROLL_PACKETS));
    // Where a key is used up nothing is left out, and what is lost is missing.
    sealer.skip_to(3 * ROLL_PACKETS - 1);
    let _ = counts(&sealer);
    let _ = seal(&sealer, 3);
    assert_eq!(counts(&sealer), (3 * ROLL_PACKETS + 1, 3 * ROLL_PACKETS));
}

#[test]
fn one_plain_text_under_two_generations_has_nothing_in_common() {
    let (sealer, _) = pair();
    let bodies: Vec<_> = (0..64)
        .map(|generation| {
            sealer.skip_to(generation * ROLL_PACKETS);
            let datagram = seal(&sealer, 7);
            assert_eq!(sequence(&datagram), generation * ROLL_PACKETS);
            datagram[24..].to_vec()
        })
        .collect();
    assert_eq!(bodies.iter().collect::<HashSet<_>>().len(), bodies.len());
}

#[test]
fn packets_of_old_generations_are_refused_for_ever() {
    let (sealer, mut opener) = pair();
    sealer.skip_to(ROLL_PACKETS - 4);
    let old: Vec<_> = (0..4).map(|value| seal(&sealer, value)).collect();
    // Two of them arrive, two are held back by an attacker.
    assert!(opener.open(&old[0]).is_ok() && opener.open(&old[1]).is_ok());
    assert!(opener.open(&seal(&sealer, 4)).is_ok(), "the roll");
    assert_eq!(opener.open(&old[0]), Err(OpenError::Replayed));
    assert!(opener.open(&old[2]).is_ok(), "late, within the window");
    sealer.skip_to(ROLL_PACKETS + WINDOW + 4);
    assert!(opener.open(&seal(&sealer, 5)).is_ok());
    for datagram in &old {
        assert_eq!(opener.open(datagram), Err(OpenError::Replayed));
    }
    for generations in [2, 3, 50] {
        sealer.skip_to(generations * ROLL_PACKETS);
        assert!(opener.open(&seal(&sealer, 6)).is_ok());
        for datagram in &old {
            assert_eq!(opener.open(datagram), Err(OpenError::Replayed));
        }
    }
}

#[test]
fn a_silence_of_many_generations_ends_with_the_first_packet() {
    let (sealer, mut opener) = pair();
    assert!(opener.open(&seal(&sealer, 0)).is_ok());
    for sequence in [5 * ROLL_PACKETS + 1, 1 << 40, 1 << 62] {
        sealer.skip_to(sequence);
        let (first, second) = (seal(&sealer, 1), seal(&sealer, 2));
        assert!(opener.open(&second).is_ok());
        assert!(opener.open(&first).is_ok(), "overtaken");
    }
}

#[test]
fn late_packets_of_a_generation_that_was_left_out_still_count() {
    let (sealer, mut opener) = pair();
    assert!(opener.open(&seal(&sealer, 0)).is_ok());
    sealer.skip_to(2 * ROLL_PACKETS - 1);
    let (last_of_one, first_of_two) = (seal(&sealer, 1), seal(&sealer, 2));
    assert!(opener.open(&first_of_two).is_ok());
    assert!(opener.open(&last_of_one).is_ok());
}

#[test]
fn a_forged_later_generation_rolls_nothing() {
    let (sealer, mut opener) = pair();
    let genuine = seal(&sealer, 0);
    let ahead = {
        let other = Sealer::new(&[1; 28], 1, 2);
        other.skip_to(9 * ROLL_PACKETS);
        seal(&other, 0)
    };
    for _ in 0..3 {
        assert_eq!(opener.open(&ahead), Err(OpenError::Forged));
    }
    assert!(opener.open(&genuine).is_ok());
}

#[test]
fn numbers_never_go_back() {
    let (sealer, _) = pair();
    sealer.skip_to(100);
    sealer.skip_to(7);
    assert_eq!(sequence(&seal(&sealer, 0)), 100);
}

#[test]
fn threads_that_cross_a_roll_together_share_no_number() {
    let (sealer, mut opener) = pair();
    sealer.skip_to(ROLL_PACKETS - 200);
    let sealer = &sealer;
    let mut all: Vec<Vec<u8>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4)
            .map(|_| scope.spawn(move || (0..100).map(|n| seal(sealer, n)).collect::<Vec<_>>()))
            .collect();
        threads
            .into_iter()
            .flat_map(|thread| thread.join().unwrap_or_default())
            .collect()
    });
    assert_eq!(
        all.iter()
            .map(|d| sequence(d))
            .collect::<HashSet<_>>()
            .len(),
        400
    );
    all.sort_by_key(|datagram| sequence(datagram));
    for datagram in &all {
        assert!(opener.open(datagram).is_ok());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Around a roll, with any loss, any order within the window and any repeats: each opens once, none twice.
    #[test]
    fn any_loss_and_order_across_rolls(
        rolls in 1u64..5,
        before in 0u64..300,
        // Of each packet: how far it is put off, whether it is lost, whether it comes twice.
        fates in prop::collection::vec((0usize..200, prop::bool::weighted(0.2), prop::bool::weighted(0.2)), 1..500),
    ) {
        let (sealer, mut opener) = pair();
        sealer.skip_to((rolls * ROLL_PACKETS).saturating_sub(before));
        let mut arrivals = Vec::new();
        for (place, (delay, lost, doubled)) in fates.iter().enumerate() {
            let datagram = seal(&sealer, place as u64);
            if !lost {
                arrivals.push((place + delay, datagram.clone()));
                if *doubled {
                    arrivals.push((place + delay + 7, datagram));
                }
            }
        }
        arrivals.sort_by_key(|(time, _)| *time);
        let mut seen = HashSet::new();
        for (_, datagram) in &arrivals {
            let first = seen.insert(sequence(datagram));
            match opener.open(datagram) {
                Ok(opened) => {
                    prop_assert!(first);
                    prop_assert_eq!(opened.header.sequence, sequence(datagram));
                }
                Err(error) => {
                    prop_assert!(!first, "{} of {:?}", error, sequence(datagram));
                    prop_assert_eq!(error, OpenError::Replayed);
                }
            }
        }
    }
}
