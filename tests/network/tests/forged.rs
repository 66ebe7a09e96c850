//! Forged, replayed, truncated and damaged datagrams: none is accepted, and none hinders a genuine one.

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use taut_link::{ClientOptions, ClusterKey, Role, serve};
use taut_network_tests::bench::{reading, server_options, small_content};
use taut_network_tests::forge::{
    Attack, FORGERIES, Forger, Forgery, MAX_FORGED_BYTES, Seen, attack, payload_of_every_kind,
};
use taut_network_tests::relay::{Direction, Treatment, Waiting};
use taut_proto::{Header, PROTOCOL_VERSION, limits::Rate};

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

/// Waits without a limit that a loaded machine would miss.
fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < PATIENCE, "{what}: did not happen");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Which counter of the server a forgery belongs to, by the header alone.
#[derive(Debug, Default, PartialEq, Eq)]
struct Due {
    garbage: u64,
    wrong_version: u64,
    /// Forged, replayed, or dropped unopened beyond a session's rate.
    refused: u64,
}

#[test]
fn a_servers_counters_account_for_every_one_of_a_hundred_thousand_on_its_socket() {
    /// Sent before the server is waited for: fewer than its socket holds.
    const AT_A_TIME: u64 = 50;
    const FORGERIES_SENT: u64 = 100_000;
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let waiting = Waiting::bind().unwrap_or_else(|error| panic!("{error}"));
    let key = ClusterKey::generate().expect("a key");
    let mut options = server_options(&key);
    options.announced_udp_port = Some(waiting.address().port());
    // The thief may send as much as it likes, so that every datagram is looked at; the bridge is silent for longer than a node may be.
    let rate = Rate {
        per_second: 1_000_000,
        burst: 1_000_000,
    };
    (
        options.limits.unknown_source,
        options.limits.unknown_sources,
    ) = (rate, rate);
    (options.idle_timeout, options.node_timeout) = (10 * PATIENCE, PATIENCE);
    let server = runtime
        .block_on(serve(options, small_content()))
        .unwrap_or_else(|error| panic!("{error}"));
    let relay = waiting
        .start(server.udp_addr(), vec![Treatment::default()], 1)
        .unwrap_or_else(|error| panic!("{error}"));
    let options = ClientOptions {
        idle_timeout: 10 * PATIENCE,
        connect_timeout: PATIENCE,
        ..ClientOptions::new(server.quic_addr().to_string(), key, Role::Device, "bridge")
    };
    let bridge = runtime
        .block_on(taut_link::connect(options))
        .unwrap_or_else(|error| panic!("{error}"));
    for index in 1..=50 {
        bridge.send_input(&reading(index));
    }
    wait_until("the inputs", || {
        let counters = server.counters();
        counters.inputs + counters.inputs_late == 50
    });
    // From now on the bridge is behind a black hole: what is under way is known, and nothing else moves the counters.
    relay.set_black_hole(true);
    let settled = || {
        let counts = relay.counts(Direction::Up);
        counts.passed + counts.swallowed == counts.received
            && server.counters().packets_received == counts.passed
    };
    wait_until("quiet", settled);

    let stolen = relay.upstream();
    let taken: Vec<Vec<u8>> = stolen[..40].to_vec();
    let template = taken[30].clone();
    let header = Header::parse(&template).unwrap_or_else(|error| panic!("{error}"));
    let mut coming = template;
    coming[12..20].copy_from_slice(&(header.sequence + 1_000_000).to_le_bytes());
    let seen = Seen {
        other_way: coming.clone(),
        coming,
        taken,
    };
    let mut forger = Forger::new(9, header.epoch, header.sender);
    let payloads = payload_of_every_kind();
    let thief = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    let before = server.counters();
    let path = server.clients()[0].udp_address;
    let (mut due, mut buffer) = (Due::default(), [0; MAX_FORGED_BYTES]);
    let counted = || {
        let now = server.counters();
        Due {
            garbage: now.garbage - before.garbage,
            wrong_version: now.wrong_version - before.wrong_version,
            refused: now.forged + now.replayed + now.flooded
                - (before.forged + before.replayed + before.flooded),
        }
    };
    for number in 0..FORGERIES_SENT {
        let forgery = FORGERIES[number as usize % FORGERIES.len()];
        let payload = &payloads[number as usize / FORGERIES.len() % payloads.len()];
        let length = forger.forge(forgery, &seen, payload, &mut buffer);
        match Header::parse(&buffer[..length]) {
            Ok(header) if header.version != PROTOCOL_VERSION => due.wrong_version += 1,
            Ok(_) => due.refused += 1,
            Err(_) => due.garbage += 1,
        }
        thief
            .send_to(&buffer[..length], server.udp_addr())
            .expect("loopback takes it");
        if number % AT_A_TIME == AT_A_TIME - 1 {
            wait_until("counting", || counted() == due);
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
    relay.set_black_hole(false);
    wait_until("a genuine datagram", || {
        server.counters().packets_received > before.packets_received
    });
    assert!(FORGERIES.contains(&Forgery::Replayed));
    assert_eq!(bridge.is_closed(), None);
}
