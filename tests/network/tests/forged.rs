//! Forged, replayed, truncated and damaged datagrams: none is accepted, and none hinders a genuine one.

use std::net::UdpSocket;
use std::time::Duration;

use taut_link::{ClientLink, ClientOptions, ClusterKey, Counters, Role, ServerLink};
use taut_network_tests::bench::{BenchError, reading, serve_behind, server_options, wait_until};
use taut_network_tests::forge::{
    Attack, FORGERIES, Forger, Forgery, MAX_FORGED_BYTES, Seen, attack, payload_of_every_kind,
};
use taut_network_tests::relay::{Direction, Relay, Treatment};
use taut_proto::{Header, PROTOCOL_VERSION, limits::Rate};
use tokio::runtime::Runtime;

const PATIENCE: Duration = Duration::from_secs(60);

#[test]
fn none_of_a_million_forgeries_is_accepted() {
    let Attack {
        forged,
        accepted,
        genuine,
        refused,
    } = attack(1_000_000, 1);
    assert!(forged >= 1_000_000);
    assert_eq!(accepted, 0);
    assert!(genuine > 20_000);
    assert_eq!(refused, 0, "a forgery had an effect");
}

#[test]
fn every_sort_of_forgery_differs_from_what_is_coming() {
    let payloads = payload_of_every_kind();
    let way = taut_network_tests::forge::OneWay::new(3, 1, 7);
    let mut forger = Forger::new(4, 1, 7);
    let seen = Seen {
        taken: vec![way.genuine(&payloads[0])],
        coming: way.genuine(&payloads[0]),
        other_way: way.genuine(&payloads[1]),
    };
    let mut buffer = [0; MAX_FORGED_BYTES];
    for forgery in FORGERIES {
        for _ in 0..1000 {
            let length = forger.forge(forgery, &seen, &payloads[0], &mut buffer);
            assert_ne!(buffer[..length], seen.coming, "{forgery:?}");
        }
    }
}

/// Which counter of the server a datagram belongs to.
#[derive(Debug, Default, PartialEq, Eq)]
struct Due {
    garbage: u64,
    wrong_version: u64,
    /// Forged, replayed, or dropped unopened beyond a session's rate.
    refused: u64,
}

impl Due {
    /// What the server counted since `before`.
    fn counted(before: &Counters, now: &Counters) -> Self {
        let refused = |of: &Counters| of.forged + of.replayed + of.flooded;
        Self {
            garbage: now.garbage - before.garbage,
            wrong_version: now.wrong_version - before.wrong_version,
            refused: refused(now) - refused(before),
        }
    }

    /// Counts a forgery by its header alone.
    fn count(&mut self, forged: &[u8]) {
        match Header::parse(forged) {
            Ok(header) if header.version != PROTOCOL_VERSION => self.wrong_version += 1,
            Ok(_) => self.refused += 1,
            Err(_) => self.garbage += 1,
        }
    }
}

/// A server, and a bridge behind a relay. They are dropped in this order.
struct Session {
    bridge: ClientLink,
    relay: Relay,
    server: ServerLink,
    _runtime: Runtime,
}

impl Session {
    /// The bridge has sent 50 inputs and is behind a black hole now: what is under way is known, and nothing else moves the counters.
    fn silenced() -> Result<Self, BenchError> {
        let runtime = Runtime::new()?;
        let key = ClusterKey::generate()?;
        let mut options = server_options(&key);
        // The thief may send as much as it likes, so that every datagram is looked at; the bridge is silent for longer than a node may be.
        let rate = Rate {
            per_second: 1_000_000,
            burst: 1_000_000,
        };
        options.limits.unknown_source = rate;
        options.limits.unknown_sources = rate;
        (options.idle_timeout, options.node_timeout) = (10 * PATIENCE, PATIENCE);
        let (server, relay) = serve_behind(&runtime, options, vec![Treatment::default()], 1)?;
        let options = ClientOptions {
            idle_timeout: 10 * PATIENCE,
            connect_timeout: PATIENCE,
            ..ClientOptions::new(server.quic_addr().to_string(), key, Role::Device, "bridge")
        };
        let bridge = runtime.block_on(taut_link::connect(options))?;
        for index in 1..=50 {
            bridge.send_input(&reading(index));
        }
        wait_until("the inputs", || {
            let counters = server.counters();
            counters.inputs + counters.inputs_late == 50
        })?;
        relay.set_black_hole(true);
        wait_until("quiet", || {
            let counts = relay.counts(Direction::Up);
            counts.passed + counts.swallowed == counts.received
                && server.counters().packets_received == counts.passed
        })?;
        Ok(Self {
            bridge,
            relay,
            server,
            _runtime: runtime,
        })
    }

    /// What a thief took of the bridge's datagrams, and a forger of that session.
    fn stolen(&self) -> (Seen, Forger) {
        let taken = self.relay.upstream()[..40].to_vec();
        let header = Header::parse(&taken[30]).unwrap_or_else(|error| panic!("{error}"));
        let mut coming = taken[30].clone();
        coming[12..20].copy_from_slice(&(header.sequence + 1_000_000).to_le_bytes());
        let seen = Seen {
            other_way: coming.clone(),
            coming,
            taken,
        };
        (seen, Forger::new(9, header.epoch, header.sender))
    }
}

#[test]
fn a_servers_counters_account_for_each_of_100000_forgeries() -> Result<(), BenchError> {
    /// Sent before the server is waited for: fewer than its socket holds.
    const AT_A_TIME: u64 = 50;
    const FORGERIES_SENT: u64 = 100_000;
    let session = Session::silenced()?;
    let server = &session.server;
    let (seen, mut forger) = session.stolen();
    let payloads = payload_of_every_kind();
    let thief = UdpSocket::bind("127.0.0.1:0")?;
    let before = server.counters();
    let path = server.clients()[0].udp_address;
    let (mut due, mut buffer) = (Due::default(), [0; MAX_FORGED_BYTES]);
    for number in 0..FORGERIES_SENT {
        let forgery = FORGERIES[number as usize % FORGERIES.len()];
        let payload = &payloads[number as usize / FORGERIES.len() % payloads.len()];
        let length = forger.forge(forgery, &seen, payload, &mut buffer);
        due.count(&buffer[..length]);
        thief.send_to(&buffer[..length], server.udp_addr())?;
        if number % AT_A_TIME == AT_A_TIME - 1 {
            wait_until("counting", || {
                Due::counted(&before, &server.counters()) == due
            })?;
        }
    }
    assert_eq!(
        due.garbage + due.wrong_version + due.refused,
        FORGERIES_SENT
    );
    assert!(
        due.refused > FORGERIES_SENT / 3 && due.garbage > 0 && due.wrong_version > 0,
        "{due:?}"
    );
    let after = server.counters();
    assert_eq!(after.packets_received, before.packets_received);
    assert_eq!(
        (after.inputs, after.inputs_late, after.inputs_refused),
        (before.inputs, before.inputs_late, before.inputs_refused)
    );
    assert_eq!(
        server.clients()[0].udp_address,
        path,
        "a thief moved the path"
    );

    // The one that was coming all the time still gets through.
    session.relay.set_black_hole(false);
    wait_until("a genuine datagram", || {
        server.counters().packets_received > before.packets_received
    })?;
    assert!(FORGERIES.contains(&Forgery::Replayed));
    assert_eq!(session.bridge.is_closed(), None);
    Ok(())
}
