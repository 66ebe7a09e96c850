//! Publishing is for the broadcaster's real-time thread: it allocates nothing, whether anybody reads or not.

use assert_no_alloc::assert_no_alloc;
use taut_observers::{MAX_WAITING, state_channel};
use taut_proto::HotState;
use taut_proto::state::{
    BodyState, ContactState, EventRecord, MAX_BODIES, MAX_CONTACTS, MAX_EVENTS, MAX_TOOLS,
    ToolState,
};

/// As full as a state can be; its events are those after `newest`.
fn full_state(newest: u32) -> HotState {
    let mut state = HotState::empty();
    state.tools.extend([ToolState::default(); MAX_TOOLS]);
    let pose = state.head.pose;
    let body = BodyState {
        id: 0,
        flags: 0,
        pose,
    };
    state.bodies.extend([body; MAX_BODIES]);
    let contact = ContactState {
        pair: [0; 2],
        point: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        force: 0.0,
        gap: 0.0,
    };
    state.contacts.extend([contact; MAX_CONTACTS]);
    state
        .events
        .extend((1..=MAX_EVENTS as u32).map(|more| EventRecord {
            id: newest + more,
            tick: newest,
            code: 1,
        }));
    state
}

#[test]
fn publishing_and_taking_allocate_nothing() {
    let (mut outlet, mut feed) = state_channel();
    let count = 2 * MAX_WAITING / MAX_EVENTS;
    let states: Vec<HotState> = (0..count)
        .map(|k| full_state((k * MAX_EVENTS) as u32))
        .collect();
    let taken = assert_no_alloc(|| {
        // Twice what may wait, unread; then read.
        for state in &states {
            outlet.publish(state);
        }
        let fresh = feed.fresh();
        fresh.map_or(0, |fresh| fresh.events.len())
    });
    assert_eq!(taken, MAX_WAITING);
}
