//! A session in which nobody rests: clients join, leave, vanish without a word and are refused, behind a bad network, while datagrams are forged.
//!
//! What must hold all the time: states are those that were sent, in order; each event comes once; nothing forged is accepted; whoever vanished
//! is let go. Now and then everybody leaves: what this process has then is written down, and must not grow.

use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use taut_link::{
    Broadcaster, ClientLink, ClientOptions, ClusterKey, Counters, Role, ServerLink, ServerOptions,
    SessionClock, Transport, connect,
};
use taut_proto::HotState;
use taut_proto::state::{EventRecord, event_code};
use tokio::runtime::Runtime;

use super::soak_log::SoakLog;
use super::threads::{joined, runtime};
use super::{BenchError, Ticker, memory, serve_behind, server_options, state, wait_until};
use crate::forge::{FORGERIES, Forger, MAX_FORGED_BYTES, Seen, payload_of_every_kind};
use crate::random::Random;
use crate::relay::{Burst, Direction, Impairment, Relay, RelayCounts, Treatment};

/// Most clients at a time.
const MAX_MEMBERS: usize = 6;
/// Time between two things that happen to clients.
const EVENT_PERIOD: Duration = Duration::from_millis(100);
/// Silence after which the server lets a client go.
const IDLE: Duration = Duration::from_secs(2);
/// Time between two moments at which everybody has left, as a share of the run; at least and at most this long.
const QUIET_SHARE: f64 = 0.05;
const QUIET_PERIOD_S: (f64, f64) = (1.0, 60.0);
/// An event comes with each state whose tick is a multiple of this.
const TICKS_PER_EVENT: u64 = 16;

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
    /// Events that clients got.
    pub events: u64,
    /// Events that were missing or came again: must be 0.
    pub wrong_events: u64,
    /// Moments at which everybody had left and the server had let everybody go.
    pub quiet: u64,
    /// The server's counters.
    pub server: Counters,
    /// What the relay did down and up.
    pub relay: [RelayCounts; 2],
}

struct Member {
    link: ClientLink,
    newest: u64,
    event: Option<u32>,
}

/// Runs until `log` is as old as `duration`, decided by `seed`.
pub fn run(duration: Duration, seed: u64, log: &mut SoakLog) -> Result<Soak, BenchError> {
    let runtime = runtime(2)?;
    let keys = [ClusterKey::generate()?, ClusterKey::generate()?];
    let options = ServerOptions {
        idle_timeout: IDLE,
        node_timeout: IDLE,
        ..server_options(&keys[0])
    };
    let (server, relay) = serve_behind(&runtime, options, vec![bad_network()], seed)?;
    let stop = Arc::new(AtomicBool::new(false));
    let attack = Attack {
        broadcaster: server.broadcaster(),
        clock: server.clock(),
        target: server.udp_addr(),
        stop: stop.clone(),
    };
    let attack = std::thread::Builder::new()
        .name("states".to_owned())
        .spawn(move || attack.run(seed))?;
    let mut crowd = Crowd {
        runtime: &runtime,
        server: &server,
        relay: &relay,
        keys: &keys,
        random: Random(seed),
        members: Vec::new(),
        result: Soak::default(),
    };
    let quiet_s = (QUIET_SHARE * duration.as_secs_f64()).clamp(QUIET_PERIOD_S.0, QUIET_PERIOD_S.1);
    let this = log.name("links");
    let run = (|| {
        while log.elapsed_s() < duration.as_secs_f64() {
            crowd.come_and_go(Duration::from_secs_f64(quiet_s))?;
            crowd.rest()?;
            memory::give_back();
            log.note(&this, std::process::id())?;
        }
        crowd.rest()
    })();
    stop.store(true, Ordering::Relaxed);
    let sent = joined(attack)?;
    run?;
    let mut result = crowd.result;
    (result.states, result.forged) = sent?;
    result.server = server.counters();
    result.relay = [Direction::Down, Direction::Up].map(|way| relay.counts(way));
    Ok(result)
}

/// Those who come and go.
struct Crowd<'a> {
    runtime: &'a Runtime,
    server: &'a ServerLink,
    relay: &'a Relay,
    /// The server's, and one of a stranger.
    keys: &'a [ClusterKey; 2],
    random: Random,
    members: Vec<Member>,
    result: Soak,
}

impl Crowd<'_> {
    fn options(&self, key: usize, node: String, transport: Transport) -> ClientOptions {
        let server = self.server.quic_addr().to_string();
        ClientOptions {
            transport,
            idle_timeout: IDLE,
            ..ClientOptions::new(server, self.keys[key].clone(), Role::Render, node)
        }
    }

    /// For this long.
    fn come_and_go(&mut self, time: Duration) -> Result<(), BenchError> {
        let (start, mut last_event) = (Instant::now(), Instant::now());
        while start.elapsed() < time {
            std::thread::sleep(Duration::from_millis(5));
            for member in &mut self.members {
                take(member, &mut self.result);
            }
            self.members
                .retain(|member| member.link.is_closed().is_none());
            while self.server.try_event().is_some() {}
            if last_event.elapsed() >= EVENT_PERIOD {
                last_event = Instant::now();
                self.something_happens()?;
            }
        }
        Ok(())
    }

    fn something_happens(&mut self) -> Result<(), BenchError> {
        let happens = self.random.below(10);
        if self.members.len() < 2 || (happens < 5 && self.members.len() < MAX_MEMBERS) {
            self.join();
        } else if happens < 8 {
            let member = self
                .members
                .swap_remove(self.random.below(self.members.len()));
            self.result.left += 1;
            self.runtime.block_on(member.link.close());
        } else if happens < 9 {
            let node = format!("victim-{}", self.result.vanished);
            if vanish(self.options(0, node, Transport::Udp))? {
                self.result.vanished += 1;
            }
        } else {
            let node = format!("stranger-{}", self.result.refused);
            let strange = self.options(1, node, Transport::Udp);
            self.result.refused += u64::from(self.runtime.block_on(connect(strange)).is_err());
        }
        Ok(())
    }

    fn join(&mut self) {
        let transport = if self.random.chance(0.5) {
            Transport::Udp
        } else {
            Transport::QuicDatagram
        };
        let node = format!("node-{}", self.result.joined + self.result.failed_joins);
        match self
            .runtime
            .block_on(connect(self.options(0, node, transport)))
        {
            Ok(link) => {
                self.result.joined += 1;
                self.members.push(Member {
                    link,
                    newest: 0,
                    event: None,
                });
            }
            Err(_) => self.result.failed_joins += 1,
        }
    }

    /// Everybody leaves; the server must let all of them go, those who vanished before included.
    fn rest(&mut self) -> Result<(), BenchError> {
        for member in self.members.drain(..) {
            self.result.left += 1;
            self.runtime.block_on(member.link.close());
        }
        let gone = wait_until("the last client to be let go", || {
            while self.server.try_event().is_some() {}
            self.server.clients().is_empty()
        });
        self.relay.forget_clients();
        self.result.quiet += u64::from(gone.is_ok());
        gone
    }
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
        let (mut forger, mut random) = (Forger::new(seed, 0, 1), Random(seed + 1));
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
            let mut state = sent(states, self.clock.now_ns());
            if states.is_multiple_of(TICKS_PER_EVENT) {
                state.events.push(event(states));
            }
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

/// The state of `tick`, without events: those come with the states until each client has acknowledged them.
fn sent(tick: u64, sample_time_ns: u64) -> HotState {
    state(tick, sample_time_ns, tick.is_multiple_of(2))
}

/// The event that comes with the state of `tick`.
fn event(tick: u64) -> EventRecord {
    EventRecord {
        id: (tick / TICKS_PER_EVENT) as u32,
        tick: tick as u32,
        code: event_code::BUTTON_DOWN,
    }
}

fn take(member: &mut Member, result: &mut Soak) {
    let mut states = Vec::new();
    member.link.drain_states(&mut states);
    for received in states {
        let mut state = received.state;
        state.events.clear();
        let right = state == sent(state.tick, state.sample_time_ns) && state.tick > member.newest;
        result.received += 1;
        result.wrong += u64::from(!right);
        member.newest = state.tick;
    }
    let mut events = Vec::new();
    member.link.drain_events(&mut events);
    for got in events {
        let is_next = member.event.is_none_or(|last| got.id == last + 1);
        let right = is_next && got == event(u64::from(got.id) * TICKS_PER_EVENT);
        result.events += 1;
        result.wrong_events += u64::from(!right);
        member.event = Some(got.id);
    }
    if member.link.events_lost() != (0, 0) {
        result.wrong_events += 1;
    }
}
