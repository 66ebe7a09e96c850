//! Sealing and opening take no memory: across a roll of keys, under group keys, and with events to repeat.

use crate::samples::{self, must};

use assert_no_alloc::assert_no_alloc;
use taut_proto::{
    EventInbox, EventOutbox, GroupOpener, GroupSealer, Kind, Payload,
    group::{GroupKeys, SERVER_SENDER, SPREAD_NS},
    header::MAX_DATAGRAM_BYTES,
    seal::{Opener, ROLL_PACKETS, Sealer},
    state::EventRecord,
};

const MATERIAL: [u8; 28] = [3; 28];

#[test]
fn a_roll_of_keys_takes_no_memory() {
    let (sealer, mut opener) = (Sealer::new(&MATERIAL, 1, 2), Opener::new(&MATERIAL, 1, 2));
    let state = Payload::Hot(samples::hot());
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    sealer.skip_to(3 * ROLL_PACKETS - 500);
    let mut opened = 0;
    assert_no_alloc(|| {
        for _ in 0..2000 {
            if let Ok(datagram) = sealer.seal(&state, &mut buffer) {
                opened += usize::from(opener.open(datagram).is_ok());
            }
        }
    });
    assert_eq!(opened, 2000);
}

#[test]
fn a_change_of_generation_takes_no_memory_where_datagrams_are_sealed_and_opened() {
    let mut server = GroupSealer::new(1, SERVER_SENDER);
    let mut member = GroupOpener::default();
    for generation in [1, 2] {
        let group = taut_proto::Group {
            generation,
            ..samples::group()
        };
        server.learn(&group, 0);
        drop(member.turn_to(GroupKeys::derive(&group, 1, 1), 0));
    }
    let mut payload = [0; MAX_DATAGRAM_BYTES];
    let state = Payload::Hot(samples::hot());
    let length = must(state.encode_into(&mut payload));
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    let mut opened = 0;
    assert_no_alloc(|| {
        for step in 0..100 {
            let now_ns = step * SPREAD_NS / 50;
            let sealed = server.seal_bytes(Kind::Hot, &payload[..length], now_ns, &mut buffer);
            if let Ok(datagram) = sealed {
                opened += usize::from(member.open(datagram, now_ns).is_ok());
            }
        }
    });
    assert_eq!((opened, server.generation()), (100, Some(2)));
}

#[test]
fn events_take_no_memory_where_states_are_made_and_received() {
    let mut outbox = EventOutbox::default();
    let mut inbox = EventInbox::default();
    inbox.receive(&outbox.batch_after(0));
    let mut taken = Vec::with_capacity(4096);
    assert_no_alloc(|| {
        for id in 1..3000 {
            let record = EventRecord {
                id,
                tick: id,
                code: 0,
            };
            let now_ns = u64::from(id) * 1_000_000;
            outbox.push(record, now_ns);
            let trail: taut_proto::ArrayVec<_, 8> = outbox.trail(now_ns, inbox.newest()).collect();
            inbox.repeated(&trail);
            inbox.drain(&mut taken);
        }
    });
    assert_eq!(taken.len(), 2999);
}
