//! A session in which nobody rests: clients join, leave, vanish without a word and are refused, behind a bad network, while datagrams are forged.
//!
//! What must hold all the time: states are those that were sent, in order; nothing forged is accepted; whoever vanished is let go;
//! memory does not grow with the number of clients that have come and gone.

use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use taut_link::{
    Broadcaster, ClientLink, ClientOptions, ClusterKey, Counters, Role, ServerOptions,
    SessionClock, Transport, connect,
};

use super::threads::runtime;
use super::{BenchError, Ticker, resident_bytes, serve_behind, server_options, state};
use crate::forge::{FORGERIES, Forger, MAX_FORGED_BYTES, Seen, payload_of_every_kind};
use crate::random::Random;
use crate::relay::{Burst, Direction, Impairment, RelayCounts, Treatment};

/// Most clients at a time.
const MAX_MEMBERS: usize = 6;
/// Time between two things that happen to clients.
const EVENT_PERIOD: Duration = Duration::from_millis(100);
/// Silence after which the server lets a client go.
const IDLE: Duration = Duration::from_secs(2);
/// Share of the run after which memory is taken as the level to compare with.
const WARM_SHARE: f64 = 0.5;

/// What came of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Soak {
    /// States sent.
    pub states: u64,
    /// States that clients got.
    pub received: u64,
    /// Clients that joined, left in good order, vanished, and were refused for a wrong key.
    pub joined: u64,
    /// See above.
    pub left: u64,
    /// See above.
    pub vanished: u64,
    /// See above.
    pub refused: u64,
    /// Joins that did not come about in time, for the network's sake.
    pub failed_joins: u64,
    /// Datagrams forged at the server's own port.
    pub forged: u64,
    /// States that differ from what was sent or are out of order: must be 0.
    pub wrong: u64,
    /// Clients that the server still has at the end: must be 0.
    pub remaining: u64,
    /// Resident memory after the first part of the run, and at the end, bytes.
    pub memory: [u64; 2],
    /// The server's counters.
    pub server: Counters,
    /// What the relay did down and up.
    pub relay: [RelayCounts; 2],
}

struct Member {
    link: ClientLink,
    newest: u64,
}

/// Runs for `duration`, decided by `seed`.
///
/// # Errors
/// The server does not come about, or counters do not settle.
pub fn run(duration: Duration, seed: u64) -> Result<Soak, BenchError> {
    let runtime = runtime(2)?;
    let key = ClusterKey::generate()?;
    let other_key = ClusterKey::generate()?;
    let options = ServerOptions {
        idle_timeout: IDLE,
        node_timeout: IDLE,
        ..server_options(&key)
    };
    let (server, relay) = serve_behind(&runtime, options, vec![bad_network()], seed)?;
    let clock = server.clock();
    let options = |key: &ClusterKey, node: String, transport| ClientOptions {
        transport,
        idle_timeout: IDLE,
        ..ClientOptions::new(
            server.quic_addr().to_string(),
            key.clone(),
            Role::Render,
            node,
        )
    };
    let (mut random, mut result) = (Random::new(seed), Soak::default());
    let mut members = Vec::<Member>::new();
    let stop = Arc::new(AtomicBool::new(false));
    let attack = Attack {
        broadcaster: server.broadcaster(),
        clock,
        target: server.udp_addr(),
        stop: stop.clone(),
    };
    let attack = std::thread::Builder::new()
        .name("states".to_owned())
        .spawn(move || attack.run(seed))?;
    let (start, mut last_event, mut warm) = (Instant::now(), Instant::now(), false);
    while start.elapsed() < duration {
        std::thread::sleep(Duration::from_millis(5));
        members
            .iter_mut()
            .for_each(|member| take(member, &mut result));
        members.retain(|member| member.link.is_closed().is_none());
        while server.try_event().is_some() {}
        if !warm && start.elapsed().as_secs_f64() > WARM_SHARE * duration.as_secs_f64() {
            warm = true;
            result.memory[0] = resident_bytes().unwrap_or(0);
        }
        if last_event.elapsed() < EVENT_PERIOD {
            continue;
        }
        last_event = Instant::now();
        let happens = random.below(10);
        if members.len() < 2 || (happens < 5 && members.len() < MAX_MEMBERS) {
            let transport = if random.chance(0.5) {
                Transport::Udp
            } else {
                Transport::QuicDatagram
            };
            let node = format!("node-{}", result.joined + result.failed_joins);
            match runtime.block_on(connect(options(&key, node, transport))) {
                Ok(link) => {
                    result.joined += 1;
                    members.push(Member { link, newest: 0 });
                }
                Err(_) => result.failed_joins += 1,
            }
        } else if happens < 8 {
            let member = members.swap_remove(random.below(members.len()));
            result.left += 1;
            runtime.block_on(member.link.close());
        } else if happens < 9 {
            let node = format!("victim-{}", result.vanished);
            if vanish(options(&key, node, Transport::Udp))? {
                result.vanished += 1;
            }
        } else {
            let node = format!("stranger-{}", result.refused);
            let strange = options(&other_key, node, Transport::Udp);
            result.refused += u64::from(runtime.block_on(connect(strange)).is_err());
        }
    }
    drop(members);
    stop.store(true, Ordering::Relaxed);
    let sent = attack.join();
    let sent = sent.map_err(|_| BenchError::Missing("the sending thread panicked".to_owned()))?;
    (result.states, result.forged) = sent?;
    let gone = super::wait_until("the last client to be let go", || {
        server.clients().is_empty()
    });
    result.remaining = server.clients().len() as u64;
    gone?;
    result.memory[1] = resident_bytes().unwrap_or(0);
    result.server = server.counters();
    result.relay = [Direction::Down, Direction::Up].map(|way| relay.counts(way));
    Ok(result)
}

/// Sends a state per millisecond, and beside each a forgery to the server's own port.
struct Attack {
    broadcaster: Broadcaster,
    clock: SessionClock,
    target: SocketAddr,
    stop: Arc<AtomicBool>,
}

impl Attack {
    /// Until told to stop; how many states and forgeries.
    fn run(mut self, seed: u64) -> Result<(u64, u64), BenchError> {
        let thief = UdpSocket::bind("127.0.0.1:0")?;
        let (mut forger, mut random) = (Forger::new(seed, 0, 1), Random::new(seed + 1));
        let payloads = payload_of_every_kind();
        let genuine = crate::forge::OneWay::new(seed, 0, 1);
        let seen = Seen {
            taken: vec![genuine.genuine(&payloads[0])],
            coming: genuine.genuine(&payloads[0]),
            other_way: genuine.genuine(&payloads[0]),
        };
        let mut ticker = Ticker::new(Duration::from_millis(1));
        let (mut states, mut forged, mut buffer) = (0, 0, [0; MAX_FORGED_BYTES]);
        while !self.stop.load(Ordering::Relaxed) {
            ticker.wait();
            states += 1;
            let state = state(states, self.clock.now_ns(), states % 2 == 0);
            let _ = self.broadcaster.send(&state);
            let forgery = FORGERIES[random.below(FORGERIES.len())];
            let payload = &payloads[random.below(payloads.len())];
            let length = forger.forge(forgery, &seen, payload, &mut buffer);
            forged += u64::from(thief.send_to(&buffer[..length], self.target).is_ok());
        }
        Ok((states, forged))
    }
}

/// A wireless network on a bad day.
fn bad_network() -> Treatment {
    Treatment::both_ways(Impairment {
        lost: 0.02,
        bursts: Some(Burst {
            chance: 0.0005,
            length: 20,
        }),
        delay: Duration::from_micros(500),
        jitter: Duration::from_millis(2),
        swapped: 0.01,
        doubled: 0.01,
        flipped: 0.002,
        ..Impairment::default()
    })
}

/// Joins and dies without a word: its network tasks are gone before it could say one. Whether it had joined.
fn vanish(options: ClientOptions) -> Result<bool, BenchError> {
    let runtime = runtime(1)?;
    let joined = runtime.block_on(connect(options));
    runtime.shutdown_background();
    Ok(joined.is_ok())
}

fn take(member: &mut Member, result: &mut Soak) {
    let mut states = Vec::new();
    member.link.drain_states(&mut states);
    for received in states {
        let tick = received.state.tick;
        let sent = state(tick, received.state.sample_time_ns, tick % 2 == 0);
        let right = received.state.hash() == sent.hash() && tick > member.newest;
        result.received += 1;
        result.wrong += u64::from(!right);
        member.newest = tick;
    }
}
