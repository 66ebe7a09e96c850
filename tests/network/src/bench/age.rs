//! Age of the newest state at a client, behind a bad network and, at the same time, behind a good one.
//!
//! Both clients are in one session, behind one relay that treats their flows differently. The age at a moment is the time since the sample of the
//! newest state that has arrived by then; it is looked at ten times per millisecond, between the first and the last arrival.

use std::collections::HashSet;
use std::time::{Duration, Instant};

use taut_link::{ClientLink, ClusterKey, ReceivedState, Role, ServerLink, SessionClock, connect};
use tokio::runtime::Runtime;

use super::threads::{on_own_thread, runtime};
use super::{
    BenchError, Quantiles, Ticker, client_options, paths, request_fifo, serve_behind,
    server_options, state, wait_until,
};
use crate::relay::{Direction, Impairment, RelayCounts, Treatment};

/// Time between two states.
const PERIOD: Duration = Duration::from_millis(1);
/// Time between two looks at the age.
const LOOK: Duration = Duration::from_micros(100);
/// Real-time priority of all threads of the run, where the system grants it.
const PRIORITY: u8 = 70;

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Age {
    /// Age behind the good network, ms.
    pub control: Quantiles,
    /// Age behind the bad one, ms.
    pub impaired: Quantiles,
    /// Age behind the good network, ms, if what the other client missed had not come there either: what the losses cost, without what the
    /// machine's load did to the two differently.
    pub by_loss_alone: Quantiles,
    /// Whether the run was of the real-time class.
    pub fifo: bool,
    /// States sent.
    pub sent: u64,
    /// States that each client got: good, bad.
    pub arrived: [u64; 2],
    /// Longest run of states missing behind the bad network.
    pub longest_gap: u64,
    /// States that are not what was sent, out of order or twice, at either client: must be 0.
    pub wrong: u64,
    /// What the relay did to datagrams down, both flows together.
    pub relay: RelayCounts,
}

/// Sends states for `duration` to a client behind a good network and one whose states suffer `impairment`, decided by `seed`.
pub fn measure(duration: Duration, impairment: &Impairment, seed: u64) -> Result<Age, BenchError> {
    on_own_thread("age", || {
        let fifo = request_fifo(PRIORITY);
        measure_here(duration, impairment.clone(), seed, fifo)
    })
}

fn measure_here(
    duration: Duration,
    impairment: Impairment,
    seed: u64,
    fifo: bool,
) -> Result<Age, BenchError> {
    let runtime = runtime(2)?;
    let key = ClusterKey::generate()?;
    let bad = Treatment {
        down: impairment,
        ..Treatment::default()
    };
    let treatments = vec![Treatment::default(), bad];
    let (server, relay) = serve_behind(&runtime, server_options(&key), treatments, seed)?;
    let clock = server.clock();
    let clients = connect_in_turn(&runtime, &server, &key)?;
    let mut broadcaster = server.broadcaster();
    let mut states = [Vec::new(), Vec::new()];
    let mut ticker = Ticker::new(PERIOD);
    let start = Instant::now();
    let mut sent = 0;
    while start.elapsed() < duration {
        ticker.wait();
        sent += 1;
        let _ = broadcaster.send(&state(sent, clock.now_ns(), false));
        if sent % 16 == 0 {
            drain(&clients, &mut states);
        }
    }
    std::thread::sleep(Duration::from_millis(200));
    drain(&clients, &mut states);
    let lost: u64 = clients.iter().map(|client| client.counters().overrun).sum();
    if lost > 0 {
        return Err(BenchError::Missing(format!(
            "{lost} states were not drained in time"
        )));
    }
    let arrivals = states.each_ref().map(|states| arrivals(states, clock));
    let got: HashSet<u64> = states[1]
        .iter()
        .map(|state| state.state.sample_time_ns)
        .collect();
    let both = arrivals[0]
        .iter()
        .filter(|(_, sample)| got.contains(sample));
    let both: Vec<_> = both.copied().collect();
    let [control, impaired] = arrivals.map(|arrivals| Quantiles::of(ages_ms(&arrivals)));
    let counts = relay.counts(Direction::Down);
    Ok(Age {
        control,
        impaired,
        by_loss_alone: Quantiles::of(ages_ms(&both)),
        fifo,
        sent,
        arrived: states.each_ref().map(|states| states.len() as u64),
        longest_gap: longest_gap(&states[1]),
        wrong: states.iter().map(|states| wrong(states)).sum(),
        relay: counts,
    })
}

/// The client behind the good network, then the other: the relay numbers its flows so.
fn connect_in_turn(
    runtime: &Runtime,
    server: &ServerLink,
    key: &ClusterKey,
) -> Result<Vec<ClientLink>, BenchError> {
    let mut clients = Vec::new();
    for node in ["control", "impaired"] {
        let options = client_options(server, key, Role::Render, node);
        clients.push(runtime.block_on(connect(options))?);
        wait_until("the path to open", || paths(server) == clients.len())?;
    }
    Ok(clients)
}

fn drain(clients: &[ClientLink], states: &mut [Vec<ReceivedState>; 2]) {
    for (client, states) in clients.iter().zip(states) {
        client.drain_states(states);
    }
}

/// Arrival and sample of each state, ns of the session.
fn arrivals(states: &[ReceivedState], clock: SessionClock) -> Vec<(u64, u64)> {
    let of =
        |received: &ReceivedState| (clock.at(received.received), received.state.sample_time_ns);
    states.iter().map(of).collect()
}

/// Ages at every look, ms, from arrivals (arrival, sample; ns, in the order of arrival).
fn ages_ms(arrivals: &[(u64, u64)]) -> Vec<f64> {
    let mut ages = Vec::new();
    let (Some((first, _)), Some((last, _))) = (arrivals.first(), arrivals.last()) else {
        return ages;
    };
    let (mut index, mut newest, mut now) = (0, 0, *first);
    while now <= *last {
        while let Some((_, sample)) = arrivals.get(index).filter(|(arrival, _)| *arrival <= now) {
            newest = newest.max(*sample);
            index += 1;
        }
        ages.push(now.saturating_sub(newest) as f64 * 1e-6);
        now += LOOK.as_nanos() as u64;
    }
    ages
}

fn longest_gap(states: &[ReceivedState]) -> u64 {
    let gaps = states
        .windows(2)
        .map(|two| two[1].state.tick.saturating_sub(two[0].state.tick + 1));
    gaps.max().unwrap_or(0)
}

/// States that differ from what was sent at their tick, or that do not follow the one before.
fn wrong(states: &[ReceivedState]) -> u64 {
    let disordered = states
        .windows(2)
        .filter(|two| two[0].state.tick >= two[1].state.tick);
    let changed = states.iter().filter(|received| {
        let sent = state(received.state.tick, received.state.sample_time_ns, false);
        received.state != sent || received.state.hash() != Ok(received.state_hash)
    });
    (disordered.count() + changed.count()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_age_grows_until_the_next_arrival() {
        // Samples every millisecond, 0.2 ms on the way; the third is lost.
        let arrivals = [(200_000, 0), (1_200_000, 1_000_000), (3_200_000, 3_000_000)];
        let ages = ages_ms(&arrivals);
        assert_eq!(ages.len(), 31);
        assert!((ages[0] - 0.2).abs() < 1e-9);
        assert!((ages[9] - 1.1).abs() < 1e-9);
        assert!((ages[10] - 0.2).abs() < 1e-9);
        assert!((ages[29] - 2.1).abs() < 1e-9);
    }
}
