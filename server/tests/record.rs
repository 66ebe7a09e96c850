//! `taut record` beside servers that stop, are killed and come back.

use std::net::UdpSocket;
use std::path::Path;

use crate::support::{PATIENCE, Running, Workplace, wait_until};

/// Times of the rows of a trace, s.
fn times(trace: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(trace).unwrap_or_default();
    let rows = text.lines().skip(1);
    rows.filter_map(|row| row.split(',').next()?.parse().ok())
        .collect()
}

#[test]
fn a_recording_goes_on_when_its_server_was_killed_and_comes_back() {
    let place = Workplace::new();
    let free = || match UdpSocket::bind(("127.0.0.1", 0)).and_then(|socket| socket.local_addr()) {
        Ok(address) => address.to_string(),
        Err(error) => panic!("no port: {error}"),
    };
    let (address, out) = (free(), place.text("trace.csv"));
    let serve = place.serve("workbench.toml", "120", &["--quic", &address]);
    let first = Running::start(&serve);
    wait_until("no server", || first.says("serving on"));
    let key = place.text("cluster.key");
    let recorder = Running::start(&["record", "--server", &address, "--key", &key, "--out", &out]);
    // Rows go through a buffer, so that there are some hundreds when it was written the first time.
    let partial = place.path(&format!(".trace.csv.{}.partial", recorder.id()));
    wait_until("no rows", || {
        std::fs::metadata(&partial).is_ok_and(|file| file.len() > 0)
    });

    drop(first); // killed
    let second = Running::start(&serve);
    wait_until("no server again", || second.says("serving on"));
    wait_until("not joined again", || {
        recorder.says("joined again; the trace has a gap")
    });
    let before = std::fs::metadata(&partial).map_or(0, |file| file.len());
    wait_until("no more rows", || {
        std::fs::metadata(&partial).is_ok_and(|file| file.len() > before)
    });

    assert!(recorder.end("-INT").status.success());
    let times = times(&place.path("trace.csv"));
    assert_eq!(times.first(), Some(&0.0));
    let gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(gaps.iter().all(|gap| *gap > 0.0), "time goes back");
    let longest = gaps.iter().copied().fold(0.0, f64::max);
    assert!(
        (0.02..PATIENCE.as_secs_f64()).contains(&longest),
        "the server was away for {longest} s"
    );
}

#[test]
fn a_recording_ends_with_the_server_that_stops_unless_told_to_stay() {
    let place = Workplace::new();
    let free = UdpSocket::bind(("127.0.0.1", 0))
        .and_then(|socket| socket.local_addr())
        .expect("no port");
    let (address, key) = (free.to_string(), place.text("cluster.key"));
    // Nobody is there yet: who stays waits.
    let record = |out: &str, more: &[&str]| {
        let out = place.text(out);
        let always = ["record", "--server", &address, "--key", &key, "--out", &out];
        Running::start(&[&always[..], more].concat())
    };
    let mut staying = record("staying.csv", &["--stay"]);
    let serve = place.serve("workbench.toml", "120", &["--quic", &address]);
    let server = Running::start(&serve);
    wait_until("no server", || server.says("serving on"));
    let leaving = record("leaving.csv", &[]);
    let partial =
        |name: &str, child: &Running| place.path(&format!(".{name}.{}.partial", child.id()));
    for (name, child) in [("staying.csv", &staying), ("leaving.csv", &leaving)] {
        let partial = partial(name, child);
        wait_until(name, || {
            std::fs::metadata(&partial).is_ok_and(|file| file.len() > 0)
        });
    }
    server.signal("-TERM");
    assert!(leaving.ended().status.success());
    assert!(times(&place.path("leaving.csv")).len() > 100);
    let _ = server.ended();
    assert!(staying.runs(), "it was told to stay");
    assert!(staying.end("-TERM").status.success());
    assert!(times(&place.path("staying.csv")).len() > 100);
}
