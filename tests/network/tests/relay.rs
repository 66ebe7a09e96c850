//! What the relay promises: rates, order, determinism, arithmetic of its counters.

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use taut_network_tests::relay::{
    Burst, Direction, Fate, Fates, Impairment, Loss, Relay, Treatment, Waiting,
};

/// Standard deviations that a count may be off: once in 10^9 runs if seeds were drawn anew.
const SIGMAS: f64 = 6.0;
const PATIENCE: Duration = Duration::from_secs(60);

fn fates(impairment: &Impairment, seed: u64, count: usize) -> Vec<Fate> {
    let mut fates = Fates::new(impairment.clone(), seed, 0, Direction::Down);
    (0..count).map(|_| fates.decide(100)).collect()
}

#[track_caller]
fn assert_binomial(what: &str, count: usize, of: usize, probability: f64) {
    let expected = of as f64 * probability;
    let deviation = (expected * (1.0 - probability)).sqrt();
    let off = (count as f64 - expected).abs();
    assert!(
        off <= SIGMAS * deviation,
        "{what}: {count} of {of} where {expected} are due"
    );
}

#[test]
fn every_rate_is_the_one_that_was_set() {
    let count = 200_000;
    let impairment = Impairment {
        lost: 0.05,
        swapped: 0.02,
        doubled: 0.01,
        flipped: 0.001,
        delay: Duration::from_millis(3),
        jitter: Duration::from_millis(2),
        ..Impairment::default()
    };
    let fates = fates(&impairment, 1, count);
    let number = |happened: fn(&Fate) -> bool| fates.iter().filter(|fate| happened(fate)).count();
    assert_binomial(
        "lost",
        number(|fate| fate.lost == Some(Loss::Alone)),
        count,
        0.05,
    );
    assert_binomial("swapped", number(|fate| fate.swapped), count, 0.02);
    assert_binomial("doubled", number(|fate| fate.doubled), count, 0.01);
    assert_binomial(
        "flipped",
        number(|fate| fate.flipped.is_some()),
        count,
        0.001,
    );
    let late = number(|fate| fate.delay > Duration::from_millis(4));
    assert_binomial("in the upper half of the jitter", late, count, 0.5);
    let (least, most) = (Duration::from_millis(3), Duration::from_millis(5));
    assert!(
        fates
            .iter()
            .all(|fate| (least..=most).contains(&fate.delay))
    );
}

#[test]
fn bursts_have_their_length_and_their_rate() {
    let (count, chance, length) = (400_000, 0.001, 20_u32);
    let impairment = Impairment {
        bursts: Some(Burst { chance, length }),
        ..Impairment::default()
    };
    let fates = fates(&impairment, 2, count);
    let lost: Vec<bool> = fates
        .iter()
        .map(|fate| fate.lost == Some(Loss::Burst))
        .collect();
    let runs: Vec<usize> = lost
        .split(|lost| !lost)
        .map(<[bool]>::len)
        .filter(|run| *run > 0)
        .collect();
    // Two bursts may follow each other at once; the last may be cut off.
    assert!(
        runs[..runs.len() - 1]
            .iter()
            .all(|run| run.is_multiple_of(20)),
        "{runs:?}"
    );
    let bursts = lost.iter().filter(|lost| **lost).count() / 20;
    let free = count - bursts * 19;
    assert_binomial("bursts", bursts, free, chance);
}

#[test]
fn a_seed_decides_the_same_again_and_settings_do_not_shift_each_others_dice() {
    let plan = Impairment {
        lost: 0.1,
        swapped: 0.1,
        ..Impairment::default()
    };
    assert_eq!(fates(&plan, 3, 5000), fates(&plan, 3, 5000));
    assert_ne!(fates(&plan, 3, 5000), fates(&plan, 4, 5000));
    let more = Impairment {
        flipped: 0.5,
        ..plan.clone()
    };
    let lost = |plan| {
        fates(plan, 3, 5000)
            .iter()
            .map(|fate| fate.lost)
            .collect::<Vec<_>>()
    };
    assert_eq!(lost(&plan), lost(&more));
    let other_way = |direction, flow| {
        let mut fates = Fates::new(plan.clone(), 3, flow, direction);
        (0..5000).map(|_| fates.decide(1).lost).collect::<Vec<_>>()
    };
    assert_ne!(other_way(Direction::Up, 0), other_way(Direction::Down, 0));
    assert_ne!(other_way(Direction::Up, 0), other_way(Direction::Up, 1));
}

#[test]
fn black_holes_and_length_limits_are_exact() {
    let plan = Impairment {
        black_holes: vec![10..20, 30..31],
        longest: Some(1200),
        ..Impairment::default()
    };
    let mut fates = Fates::new(plan, 5, 0, Direction::Up);
    for number in 0..40 {
        let length = if number == 5 { 1201 } else { 1200 };
        let expected = match number {
            5 => Some(Loss::TooLong),
            10..20 | 30 => Some(Loss::BlackHole),
            _ => None,
        };
        assert_eq!(fates.decide(length).lost, expected, "{number}");
    }
}

/// A server's socket, a client's, and a relay between them.
fn between(treatment: Treatment) -> (UdpSocket, UdpSocket, Relay) {
    let waiting = Waiting::bind().unwrap_or_else(|error| panic!("{error}"));
    let socket = || {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        socket
            .set_read_timeout(Some(Duration::from_millis(50)))
            .expect("a timeout");
        socket
    };
    let (server, client) = (socket(), socket());
    client.connect(waiting.address()).expect("connected");
    let address = server.local_addr().expect("an address");
    let relay = waiting
        .start(address, vec![treatment], 6)
        .unwrap_or_else(|error| panic!("{error}"));
    (server, client, relay)
}

/// Everything that comes until `done` and nothing more is there.
fn numbers(socket: &UdpSocket, mut done: impl FnMut() -> bool) -> Vec<u32> {
    let (start, mut numbers, mut buffer) = (Instant::now(), Vec::new(), [0; 64]);
    loop {
        let finished = done(); // before the look: what has passed by then is in the socket
        match socket.recv(&mut buffer) {
            Ok(4) => numbers.push(u32::from_le_bytes([
                buffer[0], buffer[1], buffer[2], buffer[3],
            ])),
            Ok(other) => panic!("{other} bytes"),
            Err(_) if finished => return numbers,
            Err(_) => assert!(start.elapsed() < PATIENCE, "only {} came", numbers.len()),
        }
    }
}

#[test]
fn what_passes_arrives_in_order_both_ways_and_the_counters_add_up() {
    let plan = Impairment {
        lost: 0.1,
        doubled: 0.1,
        delay: Duration::from_millis(2),
        jitter: Duration::from_millis(2),
        ..Impairment::default()
    };
    let (server, client, relay) = between(Treatment::both_ways(plan));
    let count = 200_u32; // fewer than a socket holds: nobody reads meanwhile
    for number in 0..count {
        client.send(&number.to_le_bytes()).expect("sent");
        std::thread::sleep(Duration::from_micros(100));
    }
    let settled = |direction| {
        let counts = relay.counts(direction);
        counts.received == u64::from(count)
            && counts.passed == counts.received - counts.all_lost() + counts.doubled
    };
    let up = numbers(&server, || settled(Direction::Up));
    let counts = relay.counts(Direction::Up);
    assert!(up.is_sorted(), "{up:?}");
    assert_eq!(up.len() as u64, counts.passed);
    assert!(
        counts.lost > 0 && counts.doubled > 0 && counts.send_errors == 0,
        "{counts:?}"
    );
    assert_eq!(relay.upstream().len(), 200);

    // The relay's port towards the server is where answers go.
    client.send(&count.to_le_bytes()).expect("sent");
    let mut buffer = [0; 64];
    let back = loop {
        if let Ok((_, from)) = server.recv_from(&mut buffer) {
            break from;
        }
        client.send(&count.to_le_bytes()).expect("sent"); // the first may be lost
    };
    for number in 0..count {
        server.send_to(&number.to_le_bytes(), back).expect("sent");
        std::thread::sleep(Duration::from_micros(100));
    }
    let down = numbers(&client, || settled(Direction::Down));
    assert!(down.is_sorted(), "{down:?}");
    assert_eq!(down.len() as u64, relay.counts(Direction::Down).passed);
}

#[test]
fn swapped_datagrams_follow_the_next_one_and_the_last_still_arrives() {
    let plan = Impairment {
        swapped: 1.0,
        ..Impairment::default()
    };
    let (server, client, relay) = between(Treatment::both_ways(plan));
    for number in 0..9_u32 {
        client.send(&number.to_le_bytes()).expect("sent");
    }
    let up = numbers(&server, || relay.counts(Direction::Up).passed == 9);
    assert_eq!(up, [1, 0, 3, 2, 5, 4, 7, 6, 8]);
}

#[test]
fn the_black_hole_swallows_all_until_it_is_closed_and_flipped_bits_are_single() {
    let plan = Impairment {
        flipped: 1.0,
        ..Impairment::default()
    };
    let (server, client, relay) = between(Treatment::both_ways(plan));
    relay.set_black_hole(true);
    for _ in 0..10 {
        client.send(&[0; 4]).expect("sent");
    }
    assert!(numbers(&server, || relay.counts(Direction::Up).swallowed == 10).is_empty());
    relay.set_black_hole(false);
    for _ in 0..10 {
        client.send(&[0; 4]).expect("sent");
    }
    let up = numbers(&server, || relay.counts(Direction::Up).passed == 10);
    assert_eq!(up.len(), 10);
    assert!(up.iter().all(|number| number.count_ones() == 1), "{up:?}");
}
