//! `taut record` beside servers that stop, are killed and come back.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use taut_bridge::signals::is_ignored;

use crate::support::{
    PATIENCE, Running, Workplace, free_address, refusal, taut, wait_until, workbench,
};

/// Times of the rows of a trace, s.
fn times(trace: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(trace).unwrap_or_default();
    let rows = text.lines().skip(1);
    rows.filter_map(|row| row.split(',').next()?.parse().ok())
        .collect()
}

/// Where this recorder writes until it is done.
fn partial(place: &Workplace, name: &str, recorder: u32) -> PathBuf {
    place.path(&format!(".{name}.{recorder}.partial"))
}

/// Waits for more than this in the file. Rows go through a buffer, so that there are some hundreds when it was written the first time.
fn wait_for_more(than: u64, partial: &Path) {
    wait_until("no rows", || {
        std::fs::metadata(partial).is_ok_and(|file| file.len() > than)
    });
}

#[test]
fn a_recording_goes_on_when_its_server_was_killed_and_comes_back() {
    let place = Workplace::new();
    let (address, out) = (free_address(), place.text("trace.csv"));
    let serve = place.serve("workbench.toml", "120", &["--quic", &address]);
    let first = Running::start(&serve);
    wait_until("no server", || first.says("serving on"));
    let key = place.text("cluster.key");
    let recorder = Running::start(&["record", "--server", &address, "--key", &key, "--out", &out]);
    let partial = partial(&place, "trace.csv", recorder.id());
    wait_for_more(0, &partial);

    drop(first); // killed
    let second = Running::start(&serve);
    wait_until("no server again", || second.says("serving on"));
    wait_until("not joined again", || {
        recorder.says("joined again; the trace has a gap")
    });
    let before = std::fs::metadata(&partial).map_or(0, |file| file.len());
    wait_for_more(before, &partial);

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
    let (address, key) = (free_address(), place.text("cluster.key"));
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
    for (name, child) in [("staying.csv", &staying), ("leaving.csv", &leaving)] {
        wait_for_more(0, &partial(&place, name, child.id()));
    }
    server.signal("-TERM");
    assert!(leaving.ended().status.success());
    assert!(times(&place.path("leaving.csv")).len() > 100);
    let _ = server.ended();
    assert!(staying.runs(), "it was told to stay");
    assert!(staying.end("-TERM").status.success());
    assert!(times(&place.path("staying.csv")).len() > 100);
}

#[test]
fn the_duration_of_a_recording_ends_where_the_device_is_silent_too() {
    let place = Workplace::new();
    let text = workbench();
    // A bridge that nobody runs.
    let remote = text.replacen("kind = \"simulated\"", "kind = \"remote\"", 1);
    assert_ne!(remote, text);
    let silent = remote
        .replacen("tremor = ", "# tremor = ", 1)
        .replacen("seed = ", "# seed = ", 1);
    place.write("workbench.toml", &silent);
    let (address, key) = (free_address(), place.text("cluster.key"));
    let out = place.text("trace.csv");
    let _server = Running::start(&place.serve("workbench.toml", "120", &["--quic", &address]));
    let record = ["record", "--server", &address, "--key", &key, "--out", &out];
    let mut recorder = Running::start(&[&record[..], &["--stay", "--duration", "0.1"]].concat());
    wait_until("the recording goes on", || !recorder.runs());
    assert_eq!(times(&place.path("trace.csv")).first(), Some(&0.0));
}

#[test]
fn a_trace_that_is_there_is_not_written_over() {
    let place = Workplace::new();
    let (address, key) = (free_address(), place.text("cluster.key"));
    let out = place.text("trace.csv");
    place.write("trace.csv", "precious");
    let record = ["record", "--server", &address, "--key", &key, "--out", &out];
    let record = [&record[..], &["--stay"]].concat();
    // Nobody is there, and nobody is waited for.
    let said = refusal(&taut(&record));
    assert!(said.contains("trace.csv is there already"), "{said}");

    let _server = Running::start(&place.serve("workbench.toml", "120", &["--quic", &address]));
    let numbered = [&record[..], &["--number"]].concat();
    let brief = taut(&[&numbered[..], &["--duration", "0.1"]].concat());
    assert!(brief.status.success(), "{brief:?}");
    let said = String::from_utf8_lossy(&brief.stdout);
    assert!(said.contains("trace-2.csv: "), "{said}");
    assert!(times(&place.path("trace-2.csv")).len() > 1);

    // A terminal that is gone ends it as Ctrl-C does.
    let recorder = Running::start(&numbered);
    wait_for_more(0, &partial(&place, "trace-3.csv", recorder.id()));
    let signal = if is_ignored(libc::SIGHUP) {
        "-INT"
    } else {
        "-HUP"
    };
    assert!(recorder.end(signal).status.success());
    assert!(times(&place.path("trace-3.csv")).len() > 1);
    assert!(std::fs::read(&out).is_ok_and(|bytes| bytes == b"precious"));
}

/// As on a full disk: no file of the recorder may be larger than some kilobytes.
#[test]
fn what_was_recorded_until_the_disk_was_full_is_kept_and_named() {
    let place = Workplace::new();
    let (address, key) = (free_address(), place.text("cluster.key"));
    let _server = Running::start(&place.serve("workbench.toml", "120", &["--quic", &address]));
    let script = "trap '' XFSZ; ulimit -f 16; exec \"$0\" \"$@\"";
    let out = place.text("trace.csv");
    let recorder = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_taut"), "record", "--stay"])
        .args(["--server", &address, "--key", &key, "--out", &out])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("a shell");
    let partial = partial(&place, "trace.csv", recorder.id());
    let said = refusal(&recorder.wait_with_output().expect("it ends"));
    let named = format!("what could be is in {}", partial.display());
    assert!(said.contains(&named), "{said}");
    assert!(times(&partial).len() > 10, "{said}");
    assert!(!place.path("trace.csv").exists());
}
