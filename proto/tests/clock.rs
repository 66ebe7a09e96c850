//! The clock filter against simulated clocks: offset, drift, queues, steps. Time is an argument, so an hour takes a moment.

use taut_proto::{
    ClockFilter,
    clock::{DRIFT_PPM, EXCHANGES_TO_LOCK, SLEW_PPM},
    time::TimeResponse,
};

const MS: u64 = 1_000_000;

/// SplitMix64: delays that differ, the same in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
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
    assert!(error_ns(&filter, &server, 50 * MS).abs() <= 1);
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
    assert!(error_ns(&filter, &after, 11_000 * MS).abs() <= 1);
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
