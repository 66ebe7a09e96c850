//! Discrete events behind a network that loses, doubles and swaps, both ways: each reaches the client once, in order.

use std::time::{Duration, Instant};

use taut_link::{ClusterKey, Role, connect};
use taut_proto::state::EventRecord;

use super::threads::runtime;
use super::{BenchError, Ticker, client_options, serve_behind, server_options, state, wait_until};
use crate::relay::{Direction, Impairment, RelayCounts, Treatment};

/// Time between two states; every fifth has an event.
const PERIOD: Duration = Duration::from_millis(1);
const STATES_PER_EVENT: u64 = 5;

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Events {
    /// Events sent.
    pub sent: u32,
    /// Events that arrived.
    pub arrived: u32,
    /// Of these, out of order, twice or changed: must be 0.
    pub wrong: u32,
    /// Events that the client itself counts as lost.
    pub lost: u64,
    /// What the relay did to datagrams down.
    pub relay: RelayCounts,
}

/// Sends events for `duration` through a network that suffers `impairment` both ways, decided by `seed`.
pub fn measure(
    duration: Duration,
    impairment: &Impairment,
    seed: u64,
) -> Result<Events, BenchError> {
    let runtime = runtime(2)?;
    let key = ClusterKey::generate()?;
    let bad = Treatment::both_ways(impairment.clone());
    let (server, relay) = serve_behind(&runtime, server_options(&key), vec![bad], seed)?;
    let clock = server.clock();
    let options = client_options(&server, &key, Role::Render, "node");
    let client = runtime.block_on(connect(options))?;
    let mut broadcaster = server.broadcaster();
    let (mut tick, mut next, mut taken) = (0, 1_u32, Vec::new());
    let mut ticker = Ticker::new(PERIOD);
    // The path opens with the client's first datagram: what was told before the join is not its.
    while client.counters().states == 0 && tick < 30_000 {
        ticker.wait();
        tick += 1;
        let _ = broadcaster.send(&state(tick, clock.now_ns(), false));
    }
    let start = Instant::now();
    while start.elapsed() < duration {
        ticker.wait();
        tick += 1;
        let mut now = state(tick, clock.now_ns(), false);
        if tick % STATES_PER_EVENT == 0 {
            now.events.push(record(next));
            next += 1;
        }
        let _ = broadcaster.send(&now);
        client.drain_events(&mut taken);
    }
    let sent = next - 1;
    let arriving = wait_until("the last event", || {
        client.drain_events(&mut taken);
        taken.len() >= sent as usize
    });
    // Those that do not come are counted, not an error.
    let _ = arriving;
    std::thread::sleep(Duration::from_millis(200));
    client.drain_events(&mut taken);
    let in_order = taken
        .iter()
        .zip(1..)
        .filter(|(event, id)| **event == record(*id));
    let arrived = taken.len() as u32;
    let (missed, overrun) = client.events_lost();
    Ok(Events {
        sent,
        arrived,
        wrong: arrived - in_order.count() as u32,
        lost: missed + overrun,
        relay: relay.counts(Direction::Down),
    })
}

fn record(id: u32) -> EventRecord {
    EventRecord {
        id,
        tick: id,
        code: 3,
    }
}
