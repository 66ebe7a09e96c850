//! Discrete events over a bad network: each once, in order, whatever happens to the states.

use crate::samples::varied;
use proptest::prelude::*;
use std::collections::VecDeque;
use taut_proto::{
    EventBatch, EventInbox, EventOutbox,
    events::{MAX_BATCH, MAX_KEPT, MAX_QUEUED, REPEAT_NS, is_newer},
    state::EventRecord,
};

const MS: u64 = 1_000_000;

fn record(id: u32) -> EventRecord {
    EventRecord {
        id,
        tick: id,
        code: id ^ 0x55,
    }
}

fn ids(records: &[EventRecord]) -> Vec<u32> {
    records.iter().map(|record| record.id).collect()
}

fn drained(inbox: &mut EventInbox) -> Vec<u32> {
    let mut out = Vec::new();
    inbox.drain(&mut out);
    ids(&out)
}

fn repeated(outbox: &mut EventOutbox, now_ns: u64, by_all: Option<u32>) -> Vec<u32> {
    outbox
        .trail(now_ns, by_all)
        .map(|record| record.id)
        .collect()
}

/// A client that came in after event `after`.
fn inbox(after: u32) -> EventInbox {
    let mut inbox = EventInbox::default();
    inbox.receive(&EventBatch {
        after,
        records: Vec::new(),
    });
    inbox
}

#[test]
fn states_repeat_an_event_until_all_have_it_or_its_time_is_over() {
    let mut outbox = EventOutbox::default();
    assert!(outbox.push(record(1), 0));
    assert!(!outbox.push(record(1), 0), "told once");
    assert!(outbox.push(record(2), 10 * MS));
    assert_eq!(repeated(&mut outbox, 11 * MS, None), [1, 2]);
    assert_eq!(repeated(&mut outbox, 12 * MS, Some(1)), [2]);
    assert_eq!(repeated(&mut outbox, 10 * MS + REPEAT_NS - 1, Some(1)), [2]);
    assert_eq!(repeated(&mut outbox, 10 * MS + REPEAT_NS, Some(1)), [0; 0]);
    assert!(!outbox.repeats());
    assert_eq!(
        ids(&outbox.batch_after(0).records),
        [1, 2],
        "the stream tells both"
    );
}

#[test]
fn a_state_alone_delivers_only_the_next_event_and_the_stream_fills_gaps() {
    let mut inbox = inbox(4);
    inbox.repeated(&[record(6), record(7)]);
    assert_eq!(drained(&mut inbox), [0; 0], "5 is missing");
    inbox.repeated(&[record(5), record(6)]);
    assert_eq!(drained(&mut inbox), [5, 6]);
    inbox.receive(&EventBatch {
        after: 4,
        records: (5..=9).map(record).collect(),
    });
    assert_eq!(drained(&mut inbox), [7, 8, 9]);
    inbox.repeated(&[record(8), record(9)]);
    assert_eq!(drained(&mut inbox), [0; 0]);
}

#[test]
fn what_was_before_a_client_is_not_for_it() {
    let mut late = EventInbox::default();
    late.repeated(&[record(1), record(2)]);
    assert_eq!((drained(&mut late), late.newest()), (Vec::new(), None));
    late.receive(&EventBatch {
        after: 2,
        records: Vec::new(),
    });
    late.repeated(&[record(1), record(2), record(3)]);
    assert_eq!(drained(&mut late), [3]);
}

#[test]
fn numbers_may_wrap_and_the_stream_may_leave_numbers_out() {
    assert!(is_newer(3, u32::MAX - 3) && !is_newer(u32::MAX - 3, 3) && !is_newer(3, 3));
    let mut outbox = EventOutbox::default();
    let start = u32::MAX - 2;
    let mut inbox = inbox(start.wrapping_sub(1));
    // The first number may be any up to half the circle ahead.
    for id in [1 << 30, 1 << 31, 3 << 30, start - 1] {
        assert!(outbox.push(record(id), 0), "{id}");
    }
    for step in 0..6 {
        assert!(outbox.push(record(start.wrapping_add(step)), 0));
    }
    assert!(outbox.push(record(40), 0));
    inbox.receive(&outbox.batch_after(start.wrapping_sub(1)));
    assert_eq!(
        drained(&mut inbox),
        [u32::MAX - 2, u32::MAX - 1, u32::MAX, 0, 1, 2, 40]
    );
    assert_eq!(inbox.missed(), 0);
}

#[test]
fn a_stream_that_stands_still_for_too_long_is_told_what_it_missed() {
    let mut outbox = EventOutbox::default();
    let mut inbox = inbox(0);
    for id in 1..=MAX_KEPT as u32 {
        outbox.push(record(id), 0);
    }
    assert_eq!(outbox.batch_after(0).after, 0, "all are there yet");
    for id in 1..=10 {
        outbox.push(record(MAX_KEPT as u32 + id), 0);
    }
    let mut after = 0;
    let mut delivered = Vec::new();
    loop {
        let batch = outbox.batch_after(after);
        let Some(last) = batch.records.last() else {
            break;
        };
        assert!(batch.records.len() <= MAX_BATCH);
        after = last.id;
        inbox.receive(&batch);
        delivered.extend(drained(&mut inbox));
    }
    assert_eq!(delivered, (11..=MAX_KEPT as u32 + 10).collect::<Vec<_>>());
    assert_eq!(inbox.missed(), 10);
}

#[test]
fn a_queue_that_nobody_drains_keeps_the_newest_and_counts() {
    let mut inbox = inbox(0);
    for id in 1..=MAX_QUEUED as u32 + 3 {
        inbox.repeated(&[record(id)]);
    }
    assert_eq!(inbox.overrun(), 3);
    assert_eq!(
        drained(&mut inbox),
        (4..=MAX_QUEUED as u32 + 3).collect::<Vec<_>>()
    );
}

/// One datagram's way: 10 % are lost, some of them begin a burst of 20; others come late or twice.
#[derive(Clone, Copy, Debug)]
struct Fate {
    lost: bool,
    burst: bool,
    late_ms: u64,
    twice: bool,
}

fn fate() -> impl Strategy<Value = Fate> {
    varied!(Fate {
        lost: prop::bool::weighted(0.1),
        burst: prop::bool::weighted(0.01),
        late_ms: prop_oneof![4 => Just(0u64), 1 => 0u64..10],
        twice: prop::bool::weighted(0.1),
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// One second at 1 kHz, with a stream as slow as it likes and acknowledgements that come or not.
    #[test]
    fn none_is_lost_and_none_comes_twice(
        fates in prop::collection::vec(fate(), 1000),
        events in prop::collection::vec(0u64..950, 0..60),
        stream_delay_ms in 0u64..400,
        acknowledges in any::<bool>(),
        start in any::<u32>(),
    ) {
        let mut outbox = EventOutbox::default();
        let mut next = start % (1 << 31);
        outbox.push(record(next), 0);
        let first = next.wrapping_add(1);
        let mut inbox = inbox(next);
        let mut sent_up_to = next;
        let mut stream: VecDeque<(u64, EventBatch)> = VecDeque::new();
        let mut under_way: Vec<(u64, Vec<EventRecord>)> = Vec::new();
        let mut delivered = Vec::new();
        let (mut burst_left, mut acknowledged) = (0, None);
        for ms in 0..1000 + 500 {
            for _ in events.iter().filter(|at| **at == ms) {
                next = next.wrapping_add(1);
                outbox.push(record(next), ms * MS);
            }
            let news = outbox.batch_after(sent_up_to);
            if let Some(last) = news.records.last() {
                sent_up_to = last.id;
                stream.push_back((ms + stream_delay_ms, news));
            }
            if let Some(fate) = fates.get(ms as usize) {
                let trail: Vec<_> = outbox.trail(ms * MS, acknowledged).collect();
                if fate.burst {
                    burst_left = 20;
                }
                if burst_left > 0 {
                    burst_left -= 1;
                } else if !fate.lost {
                    under_way.push((ms + fate.late_ms, trail.clone()));
                    if fate.twice {
                        under_way.push((ms + fate.late_ms + 1, trail));
                    }
                }
            }
            under_way.retain(|(arrival, trail)| {
                if *arrival <= ms {
                    inbox.repeated(trail);
                }
                *arrival > ms
            });
            while let Some((arrival, news)) = stream.front() && *arrival <= ms {
                inbox.receive(news);
                stream.pop_front();
            }
            delivered.extend(drained(&mut inbox));
            if acknowledges {
                acknowledged = inbox.newest();
            }
        }
        let expected: Vec<u32> = (0..events.len() as u32).map(|k| first.wrapping_add(k)).collect();
        prop_assert_eq!(delivered, expected);
        prop_assert_eq!((inbox.missed(), inbox.overrun()), (0, 0));
    }
}
