//! The clock filter against simulated clocks: offset, drift, queues, steps. Time is an argument, so an hour takes a moment.

use taut_proto::{
    ClockFilter,
    clock::{DRIFT_PPM, EXCHANGES_TO_LOCK, SLEW_PPM},
    time::TimeResponse,
};

const MS: u64 = 1_000_000;

/// SplitMix64: delays that differ, the same in every run.
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % limit
    }
}

/// A server whose clock is `offset` ahead of the client's at client time 0 and runs fast by `drift_ppm`.
struct Server {
    offset: i64,
    drift_ppm: i64,
}

impl Server {
    fn time(&self, client: u64) -> u64 {
        let drift = client as i64 / 1000 * self.drift_ppm / 1000;
        (client as i64 + self.offset + drift) as u64
    }

    /// One exchange with the given delays; returns when it ends, client time.
    fn exchange(&self, filter: &mut ClockFilter, sent: u64, up: u64, down: u64) -> u64 {
        let turnaround = 20_000;
        let response = TimeResponse {
            client_sent: sent,
            server_received: self.time(sent + up),
            server_sent: self.time(sent + up + turnaround),
        };
        let received = sent + up + turnaround + down;
        assert!(filter.update(&response, received));
        received
    }
}

fn error_ns(filter: &ClockFilter, server: &Server, now: u64) -> i64 {
    let time = filter.session_time(now).map_or(0, |time| time.ns);
    time as i64 - server.time(now) as i64
}

#[test]
fn symmetric_delays_give_the_exact_offset() {
    let server = Server {
        offset: 123_456_789_000,
        drift_ppm: 0,
    };
    let mut filter = ClockFilter::default();
    for i in 0..EXCHANGES_TO_LOCK as u64 {
        assert_eq!(filter.session_time(i * 5 * MS), None, "not before the lock");
        server.exchange(&mut filter, i * 5 * MS, 100_000, 100_000);
    }
    // Half of the drift during an exchange is all that is not known.
    assert!(error_ns(&filter, &server, 50 * MS).abs() <= 15);
}

#[test]
fn the_stated_uncertainty_holds_under_jitter_and_drift() {
    for (seed, drift_ppm) in [(1, 0), (2, DRIFT_PPM), (3, -DRIFT_PPM)] {
        let server = Server {
            offset: -5_000_000_000,
            drift_ppm,
        };
        let mut random = Random(seed);
        let mut filter = ClockFilter::default();
        let mut worst = 0;
        for i in 0..6_000_u64 {
            let sent = 10_000 * MS + i * 100 * MS;
            // Mostly 50 to 150 µs each way; one in ten waits in a queue for up to 5 ms.
            let mut delay = || {
                50_000
                    + random.below(100_000)
                    + if random.below(10) == 0 {
                        random.below(5_000_000)
                    } else {
                        0
                    }
            };
            let (up, down) = (delay(), delay());
            server.exchange(&mut filter, sent, up, down);
            let now = sent + 60 * MS;
            if let Some(time) = filter.session_time(now) {
                let error = (time.ns as i64 - server.time(now) as i64).unsigned_abs();
                assert!(
                    error <= time.uncertainty_ns,
                    "error {error} above the stated {}",
                    time.uncertainty_ns
                );
                if i > 64 {
                    worst = worst.max(error);
                }
            }
        }
        // Half a usual round trip, and the drift over the time that a good exchange is kept.
        assert!(worst < 300_000, "worst error {worst} ns at {drift_ppm} ppm");
    }
}

#[test]
fn session_time_never_runs_backwards_nor_faster_than_the_slew() {
    let server = Server {
        offset: 0,
        drift_ppm: 0,
    };
    let mut random = Random(4);
    let mut filter = ClockFilter::default();
    let mut last: Option<(u64, u64)> = None;
    for i in 0..2_000_u64 {
        let sent = 1_000 * MS + i * 20 * MS;
        let end = server.exchange(
            &mut filter,
            sent,
            50_000 + random.below(3_000_000),
            50_000 + random.below(3_000_000),
        );
        for now in (end..sent + 20 * MS).step_by(MS as usize) {
            let Some(time) = filter.session_time(now) else {
                continue;
            };
            if let Some((last_now, last_ns)) = last {
                let (passed, given) = ((now - last_now) as i64, time.ns as i64 - last_ns as i64);
                let allowed = passed / 1000 * SLEW_PPM / 1000 + 2;
                assert!(
                    (given - passed).abs() <= allowed,
                    "{given} ns given in {passed} ns"
                );
            }
            last = Some((now, time.ns));
        }
    }
}

#[test]
fn a_restarted_server_is_followed_after_a_fresh_lock() {
    let mut filter = ClockFilter::default();
    let before = Server {
        offset: 3_600_000_000_000,
        drift_ppm: 0,
    };
    for i in 0..100 {
        before.exchange(&mut filter, i * 100 * MS, 100_000, 100_000);
    }
    let after = Server {
        offset: -9_000_000_000,
        drift_ppm: 0,
    };
    for i in 100..100 + EXCHANGES_TO_LOCK as u64 {
        after.exchange(&mut filter, i * 100 * MS, 100_000, 100_000);
    }
    assert_eq!(filter.steps(), 1);
    assert!(error_ns(&filter, &after, 11_000 * MS).abs() <= 15);
}

#[test]
fn an_exchange_that_contradicts_itself_is_ignored() {
    let mut filter = ClockFilter::default();
    let response = |client_sent, server_received, server_sent| TimeResponse {
        client_sent,
        server_received,
        server_sent,
    };
    assert!(
        !filter.update(&response(1_000, 500, 600), 900),
        "received before it was sent"
    );
    assert!(
        !filter.update(&response(1_000, 600, 500), 2_000),
        "answered before it came"
    );
    assert!(
        !filter.update(&response(1_000, 0, 5_000), 2_000),
        "longer at the server than under way"
    );
    assert!(
        !filter.update(&response(u64::MAX, u64::MAX, u64::MAX), u64::MAX),
        "beyond all time"
    );
    assert_eq!(filter.round_trip_ns(), None);
}

/// Exchanges every 50 ms for `seconds` while the way up and the way down take what `ways` says (ns, of the time since the attack began); at each, what
/// the filter says after a minute without an attack.
fn under_attack(
    drift_ppm: i64,
    seconds: u64,
    ways: impl Fn(u64) -> (u64, u64),
    mut seen: impl FnMut(u64, i64, u64),
) {
    let server = Server {
        offset: 7_000_000_000,
        drift_ppm,
    };
    let mut random = Random(5);
    let mut filter = ClockFilter::default();
    let begin = 60_000 * MS;
    for sent in (0..begin + seconds * 1000 * MS).step_by(50 * MS as usize) {
        let (up, down) = match sent.checked_sub(begin) {
            None => (0, 0),
            Some(elapsed) => ways(elapsed),
        };
        let mut usual = || 50_000 + random.below(100_000);
        let end = server.exchange(&mut filter, sent, up + usual(), down + usual());
        if sent >= begin {
            let time = filter.session_time(end).expect("not locked");
            let error = error_ns(&filter, &server, end);
            assert!(error.unsigned_abs() <= time.uncertainty_ns, "{error}");
            seen(sent - begin, error, time.uncertainty_ns);
        }
    }
}

#[test]
fn a_delay_that_grows_on_either_way_moves_session_time_by_no_more_than_drift() {
    let growing = |elapsed: u64| elapsed / 10; // 2 s after 20 s
    for drift_ppm in [0, 50, -DRIFT_PPM] {
        for (up, down) in [(1, 0), (0, 1), (1, 1), (1, 3)] {
            under_attack(
                drift_ppm,
                20,
                |elapsed| (up * growing(elapsed), down * growing(elapsed)),
                |elapsed, error, uncertainty| {
                    // What was known when it began, and the drift since.
                    let allowed = 200_000 + elapsed / 1_000_000 * DRIFT_PPM as u64 * 2;
                    assert!(error.unsigned_abs() <= allowed, "{error} after {elapsed}");
                    assert!(uncertainty <= 2 * allowed, "{uncertainty} after {elapsed}");
                },
            );
        }
    }
}

#[test]
fn a_path_that_was_never_quick_is_as_uncertain_as_half_its_round_trip() {
    let server = Server {
        offset: 3_000_000_000,
        drift_ppm: 0,
    };
    let mut filter = ClockFilter::default();
    for i in 0..64 {
        server.exchange(&mut filter, i * 50 * MS, 400 * MS, 20 * MS);
    }
    let now = 64 * 50 * MS + 500 * MS;
    let time = filter.session_time(now).expect("locked");
    let error = error_ns(&filter, &server, now);
    assert_eq!(error / MS as i64, 190, "half of the difference of the ways");
    assert!(time.uncertainty_ns > 209 * MS && time.uncertainty_ns < 215 * MS);
}

#[test]
fn clocks_that_drift_faster_than_assumed_are_found_out_and_followed() {
    let server = Server {
        offset: 0,
        drift_ppm: 5 * DRIFT_PPM,
    };
    let mut filter = ClockFilter::default();
    for i in 0..2000 {
        server.exchange(&mut filter, i * 50 * MS, 100_000, 100_000);
    }
    // Slewing cannot keep up with it; the uncertainty says by how much it trails, but for what one round trip hides.
    let now = 2000 * 50 * MS;
    let time = filter.session_time(now).expect("locked");
    let error = error_ns(&filter, &server, now).unsigned_abs();
    assert!(
        error > MS && error <= time.uncertainty_ns + 200_000,
        "{error}"
    );
    assert_eq!(filter.steps(), 0);
}
