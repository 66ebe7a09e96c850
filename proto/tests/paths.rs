//! The choice between multicast and unicast, and the pace of a client, under a virtual clock.

use proptest::prelude::*;
use taut_proto::{
    multicast::{
        ALIVE_NS, FIRST_RETRY_NS, LONGEST_RETRY_NS, MulticastWatch, PROOF, SILENCE_NS, StatePath,
    },
    pace::{FIRST_HOLD_NS, LONGEST_HOLD_NS, LOWERED_PERIOD_NS, MENDED_NS, Pace},
};

const MS: u64 = 1_000_000;

/// Looks every millisecond from `from_ms` to `to_ms`; the group is heard where `heard` says so, the server lives. Returns what was asked, and when.
fn watch(
    watch: &mut MulticastWatch,
    milliseconds: std::ops::Range<u64>,
    heard: impl Fn(u64) -> bool,
) -> Vec<(u64, StatePath)> {
    let mut asked = Vec::new();
    for ms in milliseconds {
        if heard(ms) {
            watch.heard(ms * MS);
        }
        if let Some(path) = watch.wish(ms * MS, Some(ms * MS)) {
            watch.asked(path, ms * MS);
            asked.push((ms, path));
        }
    }
    asked
}

#[test]
fn multicast_is_taken_when_it_is_steady_and_left_when_it_is_silent() {
    let mut client = MulticastWatch::default();
    assert_eq!(
        watch(&mut client, 0..500, |_| false),
        [],
        "no group, no wish"
    );
    let proof = u64::from(PROOF);
    assert_eq!(
        watch(&mut client, 500..1000, |_| true),
        [(500 + proof - 1, StatePath::Multicast)]
    );
    assert_eq!(
        watch(&mut client, 1000..2000, |_| false),
        [(999 + SILENCE_NS / MS, StatePath::Unicast)]
    );
    let retry = 999 + (SILENCE_NS + FIRST_RETRY_NS) / MS;
    assert_eq!(
        watch(&mut client, 2000..4000, |_| true),
        [(retry.max(2000 + proof - 1), StatePath::Multicast)]
    );
}

#[test]
fn now_and_then_a_datagram_is_no_group() {
    let mut client = MulticastWatch::default();
    let every = SILENCE_NS / MS;
    assert_eq!(watch(&mut client, 0..20_000, |ms| ms % every == 0), []);
    assert_eq!(client.path(), StatePath::Unicast);
}

#[test]
fn a_dead_server_is_asked_nothing() {
    let mut client = MulticastWatch::default();
    watch(&mut client, 0..100, |_| true);
    assert_eq!(client.path(), StatePath::Multicast);
    let alive = Some(99 * MS);
    for ms in 100..99 + ALIVE_NS / MS {
        let silent = ms * MS >= 99 * MS + SILENCE_NS;
        let wish = client.wish(ms * MS, alive);
        assert_eq!(wish, silent.then_some(StatePath::Unicast), "{ms}");
    }
    assert_eq!(client.wish(99 * MS + ALIVE_NS, alive), None);
    assert_eq!(client.wish(SILENCE_NS * 10, None), None);
}

#[test]
fn a_group_that_fails_again_and_again_is_tried_ever_more_rarely() {
    let mut client = MulticastWatch::default();
    // Heard for 50 ms, then silent for 150 ms, for ten minutes.
    let asked = watch(&mut client, 0..600_000, |ms| ms % 200 < 50);
    let tried: Vec<u64> = asked
        .iter()
        .filter(|(_, path)| *path == StatePath::Multicast)
        .map(|(ms, _)| *ms)
        .collect();
    for pair in tried.windows(3) {
        assert!(pair[2] - pair[1] >= pair[1] - pair[0], "{tried:?}");
    }
    assert!(
        tried.len() <= 6 + (600_000 / (LONGEST_RETRY_NS / MS)) as usize,
        "{tried:?}"
    );
    assert!(tried.len() >= 6, "{tried:?}");
    // Steady for long enough, the next failure is a first one again.
    let steady = 600_000..600_000 + 3 * LONGEST_RETRY_NS / MS;
    let end = steady.end;
    watch(&mut client, steady, |_| true);
    let asked = watch(&mut client, end..end + 3000, |ms| ms > end + 200);
    assert_eq!(asked.len(), 2, "{asked:?}");
    assert!(asked[1].0 - asked[0].0 <= FIRST_RETRY_NS / MS + 1);
}

#[test]
fn a_full_way_lowers_the_rate_for_a_moment() {
    let mut pace = Pace::default();
    assert_eq!(pace.period_ns(0), 0);
    pace.blocked(MS);
    assert_eq!(pace.period_ns(MS), LOWERED_PERIOD_NS);
    assert_eq!(pace.period_ns(MS + FIRST_HOLD_NS - 1), LOWERED_PERIOD_NS);
    assert_eq!(pace.period_ns(MS + FIRST_HOLD_NS), 0, "back by itself");
}

#[test]
fn relapses_hold_longer_and_a_mended_way_starts_again() {
    let mut pace = Pace::default();
    let (mut now_ns, mut hold_ns) = (0, FIRST_HOLD_NS);
    for _ in 0..10 {
        pace.blocked(now_ns);
        assert!(pace.is_lowered(now_ns + hold_ns - 1) && !pace.is_lowered(now_ns + hold_ns));
        now_ns += hold_ns + MS;
        hold_ns = (2 * hold_ns).min(LONGEST_HOLD_NS);
    }
    now_ns += MENDED_NS;
    pace.blocked(now_ns);
    assert!(!pace.is_lowered(now_ns + FIRST_HOLD_NS));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever happens, a lowered rate ends within the longest hold after the last trouble.
    #[test]
    fn the_full_rate_always_comes_back(troubles in prop::collection::vec(0u64..20_000_000_000, 1..100)) {
        let mut pace = Pace::default();
        let mut now_ns = 0;
        for pause in troubles {
            now_ns += pause;
            pace.blocked(now_ns);
            prop_assert!(pace.is_lowered(now_ns));
        }
        prop_assert!(!pace.is_lowered(now_ns + LONGEST_HOLD_NS));
    }

    /// However the group behaves: after every silence of 100 ms with a living server, the client is on unicast.
    #[test]
    fn a_silent_group_never_keeps_a_client(gaps in prop::collection::vec(0u64..300, 1..400)) {
        let mut client = MulticastWatch::default();
        let (mut ms, mut heard) = (0, 0);
        for gap in gaps {
            let end = ms + gap.max(1);
            while ms < end {
                if let Some(path) = client.wish(ms * MS, Some(ms * MS)) {
                    client.asked(path, ms * MS);
                }
                prop_assert!((ms - heard) * MS < SILENCE_NS || client.path() == StatePath::Unicast);
                ms += 1;
            }
            client.heard(ms * MS);
            heard = ms;
        }
    }
}
