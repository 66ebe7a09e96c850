//! States: what is sent, and what has come.

use super::*;
use taut_link::{Broadcaster, ReceivedState};
use taut_proto::{
    PoseF32,
    state::{RunState, ToolState},
};

/// States that may be on the way at once where a test counts losses: more than a socket's buffer holds would be lost by a starved
/// machine, and not by what is tested.
pub const MAX_ON_THE_WAY: u64 = 50;

/// State of `tick`, 1 kHz, whose numbers tell the tick.
pub fn state(tick: u64) -> HotState {
    let mut state = HotState {
        tick,
        sample_time_ns: tick * 1_000_000,
        scene_revision: 7,
        run: RunState::Running,
        ..HotState::empty()
    };
    state.tools.push(ToolState {
        god_object: PoseF32 {
            position: [tick as f32 * 1e-6, 0.0, 0.1],
            ..PoseF32::IDENTITY
        },
        force: [0.0, 1.5, tick as f32 * 1e-3],
        ..ToolState::default()
    });
    state
}

/// Sends states of growing tick until `done`, one per millisecond; gives up after [`PATIENCE`]. Returns the next tick.
pub async fn broadcast_until(
    broadcaster: &mut Broadcaster,
    first: u64,
    done: impl FnMut() -> bool,
) -> u64 {
    broadcast_while_may(broadcaster, first, |_| true, done).await
}

/// The same, where `may_send` is asked before each tick.
async fn broadcast_while_may(
    broadcaster: &mut Broadcaster,
    first: u64,
    mut may_send: impl FnMut(u64) -> bool,
    mut done: impl FnMut() -> bool,
) -> u64 {
    let start = Instant::now();
    let mut tick = first;
    while !done() {
        assert!(
            start.elapsed() < PATIENCE,
            "what was waited for did not happen by tick {tick}"
        );
        if may_send(tick) {
            broadcaster.send(&state(tick));
            tick += 1;
        }
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    tick
}

/// Sends states until `client` has `count` of them; the next tick.
pub async fn take_states(
    server: &ServerLink,
    client: &ClientLink,
    first: u64,
    count: usize,
) -> u64 {
    states_of(server, client, first, count).await.0
}

/// Sends states until `client` has `count` of them; the next tick, and they.
pub async fn states_of(
    server: &ServerLink,
    client: &ClientLink,
    first: u64,
    count: usize,
) -> (u64, Vec<ReceivedState>) {
    let mut states = Vec::new();
    let next = broadcast_until(&mut server.broadcaster(), first, || {
        client.drain_states(&mut states);
        states.len() >= count
    })
    .await;
    assert_in_order(&states);
    (next, states)
}

/// As [`broadcast_until`], but a state is sent only while fewer than [`MAX_ON_THE_WAY`] states are neither in `settled` nor lost on purpose.
/// `settled` says how many states have arrived so far, or were lost where the test wants it.
pub async fn broadcast_in_step_until(
    broadcaster: &mut Broadcaster,
    first: u64,
    mut settled: impl FnMut() -> u64,
    done: impl FnMut() -> bool,
) -> u64 {
    let before = settled();
    let may_send = |tick| tick - first < settled() - before + MAX_ON_THE_WAY;
    broadcast_while_may(broadcaster, first, may_send, done).await
}

pub fn drain(client: &ClientLink) -> Vec<ReceivedState> {
    let mut states = Vec::new();
    client.drain_states(&mut states);
    states
}

pub fn assert_in_order(states: &[ReceivedState]) {
    for pair in states.windows(2) {
        assert!(pair[0].state.tick < pair[1].state.tick);
    }
    for received in states {
        assert_eq!(received.state, state(received.state.tick));
        assert_eq!(Ok(received.state_hash), received.state.hash());
    }
}
