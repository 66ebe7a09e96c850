//! The real link behind the relay: loss, bursts, black holes, everything at once.

use std::time::{Duration, Instant};

use taut_link::{ClusterKey, Role, connect};
use taut_network_tests::bench::{
    age, client_options, serve_behind, server_options, state, wait_until,
};
use taut_network_tests::relay::{Burst, Direction, Impairment, Treatment};

/// Further age that the target allows, ms.
const TARGET_MS: f64 = 2.0;
#[test]
fn lost_states_cost_little_age_and_never_order_or_truth() {
    let run = age::measure(Duration::from_secs(4), &Impairment::losing(0.05), 1)
        .unwrap_or_else(|error| panic!("{error}"));
    println!("{run:?}");
    assert!(
        run.relay.lost > run.sent / 40 && run.relay.lost < run.sent / 10,
        "{run:?}"
    );
    assert_eq!(run.wrong, 0);
    assert!(run.arrived[1] < run.arrived[0]);
    // What the losses cost, whatever the load: where the sender itself stalls, a state lost before the stall can double the age.
    let limit = 2.0 * run.control.p99 + TARGET_MS;
    assert!(run.by_loss_alone.p99 <= limit, "{run:?}");
}

#[test]
fn after_a_burst_the_next_state_is_the_right_one() {
    let bursts = Impairment {
        bursts: Some(Burst {
            chance: 1.0 / 400.0,
            length: 20,
        }),
        ..Impairment::default()
    };
    let run =
        age::measure(Duration::from_secs(4), &bursts, 2).unwrap_or_else(|error| panic!("{error}"));
    println!("{run:?}");
    assert!(run.relay.lost_in_bursts >= 20, "{run:?}");
    assert_eq!(run.wrong, 0);
    // A burst is a gap of 20 datagrams, some of which may be time answers; two may meet.
    assert!(run.longest_gap >= 15, "{run:?}");
    let missing = run.sent - run.arrived[1];
    assert!(missing >= run.relay.lost_in_bursts / 2, "{run:?}");
}

#[test]
fn a_black_hole_ends_and_states_come_again_in_the_same_session() {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let key = ClusterKey::generate().expect("a key");
    let served = serve_behind(
        &runtime,
        server_options(&key),
        vec![Treatment::default()],
        3,
    );
    let (server, relay) = served.unwrap_or_else(|error| panic!("{error}"));
    let client = runtime
        .block_on(connect(client_options(&server, &key, Role::Render, "left")))
        .unwrap_or_else(|error| panic!("{error}"));
    let (mut broadcaster, mut tick) = (server.broadcaster(), 0);
    let mut states = Vec::new();
    let mut send_until =
        |states: &mut Vec<taut_link::ReceivedState>,
         done: &dyn Fn(&[taut_link::ReceivedState]) -> bool| {
            wait_until("states", || {
                tick += 1;
                let _ = broadcaster.send(&state(tick, tick, false));
                client.drain_states(states);
                done(states)
            })
            .unwrap_or_else(|error| panic!("{error}"));
            tick
        };
    send_until(&mut states, &|states| states.len() >= 100);
    relay.set_black_hole(true);
    let swallowed = || relay.counts(Direction::Down).swallowed;
    let in_the_dark = send_until(&mut states, &|_| swallowed() >= 300);
    states.clear();
    relay.set_black_hole(false);
    let start = Instant::now();
    send_until(&mut states, &|states| {
        states.iter().filter(|s| s.state.tick > in_the_dark).count() >= 100
    });
    println!(
        "100 states {:?} after the black hole closed",
        start.elapsed()
    );
    for received in &states {
        assert_eq!(
            received.state,
            state(received.state.tick, received.state.tick, false)
        );
    }
    assert!(
        states
            .windows(2)
            .all(|two| two[0].state.tick < two[1].state.tick)
    );
    assert_eq!(client.is_closed(), None);
    assert!(client.counters().lost >= 300 && client.counters().forged == 0);
}

#[test]
fn everything_at_once_leaves_a_session_that_holds() {
    let everything = Impairment {
        lost: 0.05,
        bursts: Some(Burst {
            chance: 0.001,
            length: 20,
        }),
        delay: Duration::from_millis(1),
        growth: None,
        jitter: Duration::from_millis(3),
        swapped: 0.05,
        doubled: 0.05,
        flipped: 0.02,
        longest: Some(1200),
        black_holes: Vec::from([std::ops::Range {
            start: 1000,
            end: 1200,
        }]),
    };
    let run = age::measure(Duration::from_secs(4), &everything, 4)
        .unwrap_or_else(|error| panic!("{error}"));
    println!("{run:?}");
    assert_eq!(run.wrong, 0);
    let relay = run.relay;
    assert!(relay.swapped > 0 && relay.doubled > 0 && relay.flipped > 0 && relay.swallowed >= 200);
    assert_eq!(
        relay.too_long, 0,
        "no datagram of the link is longer than 1200 bytes"
    );
    assert!(run.arrived[1] > run.sent / 2, "{run:?}");
}
