//! Group keys: who may say what under them, and how generations change.

use crate::samples::{self, must, sealed};

use proptest::prelude::*;
use taut_proto::{
    Group, GroupOpener, GroupSealer, Kind, Payload, Role,
    group::{
        FLAG_GROUP, GroupKeys, GroupSecret, PREVIOUS_NS, SERVER_SENDER, SPREAD_NS, is_member,
        may_carry,
    },
    header::MAX_DATAGRAM_BYTES,
    seal::{OpenError, Opener, SealError, Sealer},
};

const EPOCH: u32 = 77;
const LEFT: u16 = 1;
const RIGHT: u16 = 2;

/// The sample's members under a secret of the generation's own.
fn group(generation: u32) -> Group {
    Group {
        generation,
        secret: GroupSecret([generation as u8; 32]),
        ..samples::group()
    }
}

fn sealer(sender: u16, generation: u32) -> GroupSealer {
    let mut sealer = GroupSealer::new(EPOCH, sender);
    sealer.learn(&group(generation), 0);
    sealer
}

fn opener(own: u16, generation: u32) -> GroupOpener {
    let mut opener = GroupOpener::default();
    let keys = GroupKeys::derive(&group(generation), EPOCH, own);
    assert!(opener.turn_to(keys, 0).is_none());
    opener
}

fn turn(opener: &mut GroupOpener, own: u16, generation: u32, now_ns: u64) {
    drop(opener.turn_to(GroupKeys::derive(&group(generation), EPOCH, own), now_ns));
}

fn seal(sealer: &mut GroupSealer, payload: &Payload, now_ns: u64) -> Vec<u8> {
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    must(sealer.seal(payload, now_ns, &mut buffer)).to_vec()
}

#[test]
fn the_server_speaks_to_all_members_and_each_datagram_counts_once() {
    let state = Payload::Hot(samples::hot());
    let datagram = seal(&mut sealer(SERVER_SENDER, 1), &state, 0);
    for own in [LEFT, RIGHT] {
        let mut opener = opener(own, 1);
        let opened = must(opener.open(&datagram, 0));
        assert_eq!(opened.payload, state);
        assert_eq!(opened.header.flags, FLAG_GROUP | 1);
        assert_eq!(opener.open(&datagram, 0), Err(OpenError::Replayed));
    }
}

#[test]
fn a_member_speaks_to_the_others_in_its_own_name() {
    let mut left = sealer(LEFT, 1);
    let datagram = seal(&mut left, &Payload::Heartbeat, 0);
    let opened = opener(RIGHT, 1).open(&datagram, 0);
    assert_eq!(opened.map(|opened| opened.header.sender), Ok(LEFT));
    assert_eq!(
        opener(LEFT, 1).open(&datagram, 0),
        Err(OpenError::Forged),
        "its own words come back from nobody but a forger"
    );
}

#[test]
fn a_group_key_carries_pictures_frames_between_nodes_and_signs_of_life_only() {
    let pictures: Vec<Kind> = [SERVER_SENDER, LEFT]
        .into_iter()
        .flat_map(|sender| {
            samples::datagrams()
                .into_iter()
                .map(|(_, payload)| payload.kind())
                .filter(move |kind| may_carry(*kind, sender))
        })
        .collect();
    let of_the_server = [Kind::Hot, Kind::Heartbeat];
    let of_a_node = [Kind::Heartbeat, Kind::Arrive, Kind::Release];
    assert_eq!(pictures, [&of_the_server[..], &of_a_node].concat());
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    for (name, payload) in samples::datagrams() {
        if !may_carry(payload.kind(), LEFT) {
            let sealed = sealer(LEFT, 1)
                .seal(&payload, 0, &mut buffer)
                .map(<[u8]>::len);
            assert_eq!(sealed, Err(SealError::Misplaced), "{name}");
        }
    }
}

/// A member that turned bad has the secret and may seal anything with code of its own.
#[test]
fn what_a_bad_member_seals_all_the_same_is_refused() {
    let mut right = opener(RIGHT, 1);
    let material = group(1).material(LEFT);
    // Under the right key, yet without the group's flag: the key alone does not make it pairwise, nor grouped.
    let pairwise = Sealer::new(&material, EPOCH, LEFT);
    for (name, payload) in samples::datagrams() {
        let datagram = sealed(&pairwise, &payload);
        assert_eq!(right.open(&datagram, 0), Err(OpenError::Forged), "{name}");
        let mut flagged = datagram;
        flagged[10..12].copy_from_slice(&(FLAG_GROUP | 1).to_le_bytes());
        let refused = right.open(&flagged, 0).expect_err("it was not sealed so");
        let expected = match may_carry(payload.kind(), LEFT) {
            true => OpenError::Forged,
            false => OpenError::Misplaced,
        };
        assert_eq!(refused, expected, "{name}");
    }
    // The pairwise opener of a session takes nothing that has the group's flag, even if the keys were the same.
    let mut own = Opener::new(&material, EPOCH, LEFT);
    let grouped = seal(&mut sealer(LEFT, 1), &Payload::Heartbeat, 0);
    assert_eq!(own.open(&grouped), Err(OpenError::Forged));
}

#[test]
fn who_left_cannot_read_on_and_who_came_cannot_read_back() {
    let mut server = sealer(SERVER_SENDER, 1);
    let state = Payload::Hot(samples::hot());
    let before = seal(&mut server, &state, 0);
    server.learn(&group(2), 0);
    let after = seal(&mut server, &state, SPREAD_NS);
    assert!(opener(LEFT, 1).open(&after, SPREAD_NS).is_err());
    assert!(opener(LEFT, 2).open(&before, 0).is_err());
    assert!(opener(LEFT, 2).open(&after, SPREAD_NS).is_ok());
}

#[test]
fn generations_change_without_a_gap_and_the_old_one_ends() {
    let state = Payload::Heartbeat;
    let mut server = sealer(SERVER_SENDER, 1);
    let (mut early, mut late) = (opener(LEFT, 1), opener(RIGHT, 1));
    let old = seal(&mut server, &state, 0);
    server.learn(&group(2), 1000);
    turn(&mut early, LEFT, 2, 1000);
    // All along: the one who knows already, and the one who does not know yet.
    for now_ns in (1000..1000 + SPREAD_NS).step_by(1_000_000) {
        let datagram = seal(&mut server, &state, now_ns);
        assert!(early.open(&datagram, now_ns).is_ok());
        assert!(late.open(&datagram, now_ns).is_ok());
    }
    turn(&mut late, RIGHT, 2, 1000 + SPREAD_NS);
    let now_ns = 1000 + SPREAD_NS;
    let datagram = seal(&mut server, &state, now_ns);
    assert_eq!(server.generation(), Some(2));
    assert!(early.open(&datagram, now_ns).is_ok() && late.open(&datagram, now_ns).is_ok());
    // What was sealed before still opens, and opens once; later nothing of the old generation does.
    let mut third = opener(RIGHT, 1);
    turn(&mut third, RIGHT, 2, now_ns);
    assert!(third.open(&old, now_ns + PREVIOUS_NS - 1).is_ok());
    assert_eq!(
        third.open(&old, now_ns + PREVIOUS_NS - 1),
        Err(OpenError::Replayed)
    );
    let mut fourth = opener(RIGHT, 1);
    turn(&mut fourth, RIGHT, 2, now_ns);
    assert_eq!(
        fourth.open(&old, now_ns + PREVIOUS_NS),
        Err(OpenError::Forged)
    );
}

#[test]
fn a_generation_that_is_told_twice_starts_nothing_again() {
    let mut server = sealer(SERVER_SENDER, 5);
    let first = seal(&mut server, &Payload::Heartbeat, 0);
    for generation in [5, 4] {
        server.learn(&group(generation), 0);
    }
    let second = seal(&mut server, &Payload::Heartbeat, SPREAD_NS);
    assert_ne!(first[12..20], second[12..20], "another sequence number");
    let mut left = opener(LEFT, 5);
    assert!(left.open(&first, 0).is_ok());
    turn(&mut left, LEFT, 5, 0);
    assert_eq!(left.open(&first, 0), Err(OpenError::Replayed));
    turn(&mut left, LEFT, 4, 0);
    assert_eq!((left.generation(), server.generation()), (Some(5), Some(5)));
}

#[test]
fn a_member_that_missed_generations_is_not_confused_by_equal_flags() {
    let mut server = sealer(SERVER_SENDER, 1);
    let mut left = opener(LEFT, 1);
    let old = seal(&mut server, &Payload::Heartbeat, 0);
    // 5 has the low bits of 1.
    server.learn(&group(5), 0);
    turn(&mut left, LEFT, 5, 0);
    let new = seal(&mut server, &Payload::Heartbeat, SPREAD_NS);
    assert_eq!(old[10..12], new[10..12]);
    assert!(left.open(&new, SPREAD_NS).is_ok());
    assert!(left.open(&old, SPREAD_NS).is_ok());
    assert_eq!(left.open(&old, SPREAD_NS), Err(OpenError::Replayed));
    assert_eq!(left.open(&new, SPREAD_NS), Err(OpenError::Replayed));
}

#[test]
fn without_a_group_nothing_is_sealed_and_nothing_opens() {
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    let sealed = GroupSealer::new(EPOCH, LEFT)
        .seal(&Payload::Heartbeat, 0, &mut buffer)
        .map(<[u8]>::len);
    assert_eq!(sealed, Err(SealError::NoGroup));
    let datagram = seal(&mut sealer(LEFT, 1), &Payload::Heartbeat, 0);
    assert_eq!(
        GroupOpener::default().open(&datagram, 0),
        Err(OpenError::Forged)
    );
}

#[test]
fn every_key_is_another() {
    let mut seen = std::collections::HashSet::new();
    for generation in 0..50 {
        let group = Group {
            generation,
            ..samples::group()
        };
        for sender in 0..50 {
            assert!(seen.insert(group.material(sender)));
        }
    }
}

#[test]
fn devices_are_not_members_and_the_secret_is_not_shown() {
    assert!(is_member(Role::Render) && is_member(Role::Observer) && is_member(Role::Operator));
    assert!(!is_member(Role::Device));
    let shown = format!("{:?}", samples::group());
    assert!(
        shown.contains("GroupSecret(secret)") && !shown.contains("5, 5"),
        "{shown}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Any order of learning, sealing and arrival: nothing opens twice, and what arrives within the spread opens.
    #[test]
    fn changes_in_any_order_lose_nothing_within_the_spread(
        steps in prop::collection::vec((0u64..40_000_000, any::<bool>(), 0u64..2_000_000), 1..60),
    ) {
        let mut server = sealer(SERVER_SENDER, 1);
        let mut left = opener(LEFT, 1);
        let (mut now_ns, mut generation) = (0, 1);
        let mut learns_at: Option<(u32, u64)> = None;
        let mut opened = Vec::new();
        for (pause, change, delay) in steps {
            now_ns += pause;
            if let Some((newest, at)) = learns_at && now_ns >= at {
                turn(&mut left, LEFT, newest, at);
                learns_at = None;
            }
            if change && learns_at.is_none() {
                now_ns += 20_000_000; // the server gathers what changes within this time
                generation += 1;
                server.learn(&group(generation), now_ns);
                learns_at = Some((generation, now_ns + delay)); // well within the spread
            }
            let datagram = seal(&mut server, &Payload::Heartbeat, now_ns);
            prop_assert!(left.open(&datagram, now_ns).is_ok());
            opened.push(datagram);
        }
        for datagram in &opened {
            prop_assert!(left.open(datagram, now_ns).is_err());
        }
    }

    #[test]
    fn damaged_group_datagrams_are_refused(bit in 0usize..(40 * 8)) {
        let mut datagram = seal(&mut sealer(LEFT, 1), &Payload::Heartbeat, 0);
        datagram[bit / 8] ^= 1 << (bit % 8);
        prop_assert!(opener(RIGHT, 1).open(&datagram, 0).is_err());
    }
}
