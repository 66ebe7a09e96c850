//! Discrete events over sockets: each reaches each client once, in order, whatever the hot plane loses.

use crate::support::*;
use std::time::{Duration, Instant};
use taut_link::{Broadcaster, ClientLink, ClientOptions, Role, Transport};
use taut_proto::{HotState, state::EventRecord};
use taut_test_kit::relay::{Burst, Impairment};

fn record(id: u32) -> EventRecord {
    EventRecord {
        id,
        tick: id,
        code: 3,
    }
}

/// The state of `tick` with these new events.
fn with_events(tick: u64, ids: std::ops::Range<u32>) -> HotState {
    let mut state = state(tick);
    state.events.extend(ids.map(record));
    state
}

/// Numbers of the events that arrived since the last call.
fn take(client: &ClientLink, into: &mut Vec<u32>) {
    let mut records = Vec::new();
    client.drain_events(&mut records);
    into.extend(records.iter().map(|record| {
        assert_eq!(*record, self::record(record.id));
        record.id
    }));
}

/// Waits until the client has a state, so that it is in and its path is open.
async fn enter(broadcaster: &mut Broadcaster, tick: u64, client: &ClientLink) -> u64 {
    broadcast_until(broadcaster, tick, || !drain(client).is_empty()).await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_event_is_lost_and_none_comes_twice_over_a_bad_network() {
    let impairment = Impairment {
        lost: 0.1,
        bursts: Some(Burst {
            chance: 0.005,
            length: 21,
        }),
        doubled: 0.1,
        swapped: 0.1,
        flipped: 0.02,
        delay: Duration::from_micros(500),
        ..Impairment::default()
    };
    let (server, relay) = behind_relay(impairment, 3).await;
    let client = client(&server, Role::Render, "left").await;
    let mut broadcaster = server.broadcaster();
    let mut tick = enter(&mut broadcaster, 1, &client).await;
    let (mut taken, mut next) = (Vec::new(), 1);
    // Until the network was bad enough: how much it loses in 400 states is up to the rhythm of this machine.
    while next <= 400 || (lost_down(&relay) <= 50 && next <= 4000) {
        let count = u32::try_from(tick % 3).unwrap_or(0); // 0, 1 or 2 at a time
        broadcaster.send(&with_events(tick, next..next + count));
        next += count;
        tick += 1;
        tokio::time::sleep(Duration::from_millis(1)).await;
        take(&client, &mut taken);
    }
    broadcast_until(&mut broadcaster, tick, || {
        take(&client, &mut taken);
        taken.len() as u32 >= next - 1
    })
    .await;
    tokio::time::sleep(Duration::from_millis(100)).await;
    take(&client, &mut taken);
    assert_eq!(taken, (1..next).collect::<Vec<_>>());
    assert_eq!(client.events_lost(), (0, 0));
    assert!(lost_down(&relay) > 50, "{}", lost_down(&relay));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn events_come_without_any_state_after_them() {
    // Nothing of the hot plane arrives at all.
    let (server, _relay) = behind_relay(Impairment::losing(1.0), 4).await;
    let client = client(&server, Role::Render, "left").await;
    server.broadcaster().send(&with_events(1, 1..4));
    let mut taken = Vec::new();
    wait_until("the stream", || {
        take(&client, &mut taken);
        taken == [1, 2, 3]
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_late_client_gets_what_comes_after_it_and_slow_ones_get_all() {
    let server = server().await;
    let mut broadcaster = server.broadcaster();
    let first = client(&server, Role::Render, "first").await;
    let tick = enter(&mut broadcaster, 1, &first).await;
    broadcaster.send(&with_events(tick, 1..5));
    let rare = join(ClientOptions {
        rate_hz: 1,
        transport: Transport::QuicDatagram,
        ..options(&server, Role::Observer, "rare")
    })
    .await;
    for k in 0..10 {
        broadcaster.send(&with_events(
            tick + 1 + k,
            5 + k as u32 * 8..13 + k as u32 * 8,
        ));
    }
    let (mut by_first, mut by_rare) = (Vec::new(), Vec::new());
    wait_until("all", || {
        take(&first, &mut by_first);
        take(&rare, &mut by_rare);
        by_first.len() >= 84 && by_rare.len() >= 80
    })
    .await;
    assert_eq!(by_first, (1..85).collect::<Vec<_>>());
    assert_eq!(by_rare, (5..85).collect::<Vec<_>>());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn states_repeat_an_event_until_it_is_acknowledged_and_not_for_ever() {
    let server = server().await;
    let client = client(&server, Role::Render, "left").await;
    let mut broadcaster = server.broadcaster();
    let tick = enter(&mut broadcaster, 1, &client).await;
    broadcaster.send(&with_events(tick, 1..3));
    let start = Instant::now();
    let mut states = Vec::new();
    let mut seen = 0;
    broadcast_until(&mut broadcaster, tick + 1, || {
        client.drain_states(&mut states);
        seen += states
            .iter()
            .filter(|state| !state.state.events.is_empty())
            .count();
        let quiet = states
            .last()
            .is_some_and(|state| state.state.events.is_empty());
        states.clear();
        seen > 0 && quiet
    })
    .await;
    assert!(start.elapsed() < PATIENCE);
    let mut taken = Vec::new();
    take(&client, &mut taken);
    assert_eq!(taken, [1, 2]);
}
