//! Limits against floods under a virtual clock.

use proptest::prelude::*;
use std::{
    collections::hash_map::DefaultHasher,
    hash::BuildHasherDefault,
    net::{IpAddr, Ipv4Addr, SocketAddr},
};
use taut_proto::limits::{
    Attempt, JoinGuard, JoinLimits, Rate, SourceTable, TokenBucket, UnknownSources,
};

type Fixed = BuildHasherDefault<DefaultHasher>;

const MS: u64 = 1_000_000;
const S: u64 = 1_000_000_000;

fn source(host: u32, port: u16) -> SocketAddr {
    SocketAddr::from((Ipv4Addr::from(host), port))
}

fn host(number: u32) -> IpAddr {
    Ipv4Addr::from(number).into()
}

const RATE: Rate = Rate {
    per_second: 10,
    burst: 5,
};

#[test]
fn a_burst_passes_and_then_the_rate() {
    let mut bucket = TokenBucket::default();
    let passed = (0..100).filter(|_| bucket.take(RATE, 3 * S)).count();
    assert_eq!(passed, 5);
    // One per 100 ms from then on, however many ask.
    let passed = (1..=1000)
        .filter(|ms| bucket.take(RATE, 3 * S + ms * MS))
        .count();
    assert_eq!(passed, 10);
    // A pause fills it again, no further than the burst.
    let passed = (0..100).filter(|_| bucket.take(RATE, 100 * S)).count();
    assert_eq!(passed, 5);
}

#[test]
fn a_clock_that_goes_back_opens_nothing() {
    let mut bucket = TokenBucket::default();
    assert_eq!((0..9).filter(|_| bucket.take(RATE, 5 * S)).count(), 5);
    assert!(!bucket.take(RATE, S));
    assert!(!bucket.take(RATE, 0));
}

proptest! {
    /// b + r·t, in every window, whatever the arrivals; and nobody is refused who keeps to the rate.
    #[test]
    fn no_window_lets_more_through_than_burst_and_rate(
        per_second in 1_u32..5000,
        burst in 1_u32..200,
        gaps in prop::collection::vec(0_u64..20 * MS, 1..400),
    ) {
        let rate = Rate { per_second, burst };
        let mut bucket = TokenBucket::default();
        let mut now = S;
        let mut passed = Vec::new();
        for gap in gaps {
            now += gap;
            if bucket.take(rate, now) {
                passed.push(now);
            }
        }
        for (first, start) in passed.iter().enumerate() {
            for (last, end) in passed.iter().enumerate().skip(first) {
                let most = f64::from(burst) + (end - start) as f64 * 1e-9 * f64::from(per_second);
                // The period is a whole number of ns.
                prop_assert!((last - first + 1) as f64 <= most * 1.001 + 1e-6);
            }
        }
    }

    #[test]
    fn who_keeps_to_the_rate_is_never_refused(
        per_second in 1_u32..5000,
        extra in prop::collection::vec(0_u64..MS, 1..200),
    ) {
        let rate = Rate { per_second, burst: 1 };
        let mut bucket = TokenBucket::default();
        let mut now = 0;
        for extra in extra {
            prop_assert!(bucket.take(rate, now));
            now += S / u64::from(per_second) + extra;
        }
    }

    /// However many sources there are, the table keeps its size, and a source that speaks all the time is remembered among three others.
    #[test]
    fn the_table_never_grows_and_the_newest_stay(keys in prop::collection::vec(any::<u32>(), 1..2000)) {
        let mut table = SourceTable::<u32, TokenBucket, Fixed>::with_hasher(8, Fixed::default());
        let capacity = table.capacity();
        for (now, key) in keys.into_iter().enumerate() {
            let now = now as u64 + 1;
            let fresh = TokenBucket::default();
            let bucket = table.entry(key, now).expect("nothing is held");
            bucket.take(RATE, now);
            let noted = *bucket;
            prop_assert!(noted != fresh);
            prop_assert_eq!(table.entry(key, now).copied(), Some(noted));
        }
        prop_assert_eq!(table.capacity(), capacity);
    }

    /// A flood from any number of sources: all of them together get no more than the total, each no more than its own.
    #[test]
    fn a_flood_from_many_sources_is_bounded(seed in any::<u32>(), sources in 1_u32..5000) {
        let of_one = Rate { per_second: 32, burst: 64 };
        let of_all = Rate { per_second: 1000, burst: 500 };
        let mut unknown = UnknownSources::with_hasher(of_one, of_all, Fixed::default());
        let mut admitted = 0;
        let mut of_first = 0;
        for step in 0..20_000_u32 {
            let number = step.wrapping_mul(2_654_435_761).wrapping_add(seed) % sources;
            let now = S + u64::from(step) * 100_000; // 2 s in all
            if unknown.admit(source(number, 9), now) {
                admitted += 1;
                of_first += u32::from(number == 0);
            }
        }
        prop_assert!(admitted <= 500 + 2 * 1000 + 1);
        if sources < 100 {
            prop_assert!(of_first <= 64 + 2 * 32 + 1);
        }
    }

    /// Whatever happens, an address never has more under way than it may, and what began can always end.
    #[test]
    fn attempts_under_way_are_bounded(steps in prop::collection::vec((0_u32..3, any::<bool>(), 0_u64..S), 1..500)) {
        let limits = JoinLimits { at_once: 4, ..JoinLimits::default() };
        let mut guard = JoinGuard::with_hasher(limits, Fixed::default());
        let mut under_way = [0_u16; 3];
        let mut now = 0;
        for (address, begins, gap) in steps {
            now += gap;
            let count = &mut under_way[address as usize];
            if begins {
                if guard.begin(host(address), now) {
                    *count += 1;
                }
            } else if *count > 0 {
                guard.end(host(address), Attempt::Ended, now);
                *count -= 1;
            }
            prop_assert!(*count <= 4);
        }
    }
}

#[test]
fn wrong_proofs_cost_longer_and_longer_waits_and_a_right_one_ends_them() {
    let mut guard = JoinGuard::with_hasher(JoinLimits::default(), Fixed::default());
    let mut now = S;
    let fail = |guard: &mut JoinGuard<Fixed>, now: u64| {
        assert!(guard.begin(host(1), now), "at {now}");
        guard.end(host(1), Attempt::WrongProof, now);
    };
    for _ in 0..3 {
        fail(&mut guard, now);
    }
    for wait in [250, 500, 1000, 2000, 2000] {
        fail(&mut guard, now);
        assert!(!guard.begin(host(1), now + wait * MS - 1), "{wait}");
        assert!(guard.begin(host(2), now), "others wait for nobody");
        guard.end(host(2), Attempt::Ended, now);
        now += wait * MS;
    }
    assert!(guard.begin(host(1), now));
    guard.end(host(1), Attempt::Proven, now);
    for _ in 0..4 {
        fail(&mut guard, now);
    }
    assert!(!guard.begin(host(1), now + 250 * MS - 1));
    assert!(guard.begin(host(1), now + 250 * MS));
}

#[test]
fn a_host_with_a_whole_ipv6_network_counts_as_one() {
    let limits = JoinLimits {
        attempts: RATE,
        ..JoinLimits::default()
    };
    let mut guard = JoinGuard::with_hasher(limits, Fixed::default());
    let passed = (0_u16..100)
        .filter(|n| guard.begin(IpAddr::from([0x2001, 0xdb8, 0, 7, *n, 0, 0, 1]), S))
        .count();
    assert_eq!(passed, 5);
    assert!(guard.begin(IpAddr::from([0x2001, 0xdb8, 0, 8, 0, 0, 0, 1]), S));
}

/// Attempts under way are never forgotten for want of room: the server would lose count.
#[test]
fn a_full_table_refuses_new_addresses_instead_of_forgetting_open_attempts() {
    let mut guard = JoinGuard::with_hasher(JoinLimits::default(), Fixed::default());
    let begun: Vec<u32> = (0..10_000).filter(|n| guard.begin(host(*n), S)).collect();
    assert!(begun.len() <= 1024, "{}", begun.len());
    for n in &begun {
        guard.end(host(*n), Attempt::Ended, S);
    }
    assert!(guard.begin(host(20_000), 2 * S));
}
