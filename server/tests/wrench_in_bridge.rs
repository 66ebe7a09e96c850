//! A force from outside for a device behind a bridge: source, server and bridge, with a network between that delays.

use std::process::Child;
use std::time::{Duration, Instant};

use taut::session::Session;
use taut::session::setup::workbench::{Overrides, session_setup};
use taut_bridge::BridgeReport;
use taut_link::create_key_file;
use taut_test_kit::relay::Impairment;

use crate::support::{PATIENCE, no_monitor, shipped_workbench, start_behind_relay, start_bridge};
use crate::wrench_in::{STILL, felt, sender};

/// What the hand of a bridge felt along x, N, tick by tick, of a source of 1 N that is killed once it was felt for a second; source and bridge are `delay_us`
/// away from the server, each.
fn run(coupling: &str, passivity: &str, delay_us: u64) -> (Vec<f64>, BridgeReport) {
    let folder = tempfile::tempdir().expect("a folder");
    let (key_path, path) = (folder.path().join("key"), folder.path().join("still.csv"));
    let key = create_key_file(&key_path).expect("a key");
    std::fs::write(&path, STILL).expect("a file");
    let wanted = [
        "scene=\"sphere-on-plane\"",
        "device={kind=\"remote\"}",
        "wrench_in.enabled=true",
        // A busy machine pauses a process for longer than a network does; nobody is there to arm again.
        "safety.rearm=\"automatic\"",
        "network.node_timeout=20.0",
    ];
    let overrides = Overrides {
        recording: Some(folder.path().join("session")),
        ..no_monitor()
    };
    let setup = session_setup(&shipped_workbench(&wanted), key, &overrides).expect("a session");
    let impairment = Impairment {
        delay: Duration::from_micros(delay_us),
        ..Impairment::default()
    };
    let (session, _relay) = start_behind_relay(setup, impairment);
    let server = session.quic_address().expect("listens").to_string();
    let more = [
        "--coupling",
        coupling,
        "--passivity",
        passivity,
        "--give-up",
        "20",
    ];
    let bridge = start_bridge(&server, &key_path, &path, &more);
    let source = sender(&server, &key_path, &["--wrench", "1,0,0,0,0,0"]);
    feel_and_kill(&session, source, passivity == "control");
    let (_, failure) = session.stop();
    assert!(failure.is_none());
    let report = bridge.join().expect("no panic").expect("a whole run");
    let felt = felt(folder.path());
    (felt.into_iter().map(|one| one.force).collect(), report)
}

/// Kills the source after a second of its force, which is `felt` if the bridge keeps the energy, and waits for another second.
fn feel_and_kill(session: &Session, mut source: Child, felt: bool) {
    let begun = Instant::now();
    let report = || {
        std::thread::sleep(Duration::from_millis(20));
        let report = session.metrics().session;
        assert!(begun.elapsed() < PATIENCE, "it is not felt: {report:?}");
        report
    };
    while report().external_wrench.is_none_or(|of| of.taken < 1000) {}
    if felt {
        while report().largest_force_n < 0.1 {}
    }
    let ticks = report().haptics_period_us.count;
    while report().haptics_period_us.count < ticks + 1000 {}
    assert!(source.kill().is_ok() && source.wait().is_ok());
    let ticks = report().haptics_period_us.count;
    while report().haptics_period_us.count < ticks + 1000 {}
}

/// The largest, and that of the last 100 ticks.
fn most(felt: &[f64]) -> (f64, f64) {
    let largest = |of: &[f64]| of.iter().fold(0.0_f64, |most, force| most.max(force.abs()));
    (largest(felt), largest(&felt[felt.len() - 100..]))
}

#[test]
fn a_force_reaches_the_hand_of_a_bridge_is_as_old_as_its_way_and_gone_with_its_source() {
    // At the server and at the edge; 12 ms from the source and 12 ms to the bridge count twice, as nobody knows which way took
    // how long: (115 - 48) / 95 of it at most.
    for (coupling, delay_us, most_felt) in
        [("server", 0, 1.0), ("edge", 0, 1.0), ("edge", 12_000, 0.70)]
    {
        let (felt, report) = run(coupling, "control", delay_us);
        let (largest, last) = most(&felt);
        let what = format!("{coupling}, {delay_us} us: {largest} N; {report}");
        // The port's damping of a hand that yields, or swings back on a busy machine, is in it, too.
        let bounds = 0.3 * most_felt..most_felt + 0.25;
        assert!(bounds.contains(&largest), "{what}");
        // Zero, but for that of a hand that still swings after missed ticks.
        let damped = if report.missed_periods > 0 { 0.1 } else { 0.0 };
        assert!(last <= damped, "{last} N at the end; {what}");
        assert!(report.external_wrenches > 100, "{what}");
        assert!(report.max_external_age_ms < 115.0, "{what}");
        if delay_us > 0 {
            assert!(report.max_external_age_ms > 48.0, "{what}");
        }
    }
}

#[test]
fn a_bridge_that_does_not_keep_the_energy_feels_nothing_of_it() {
    let (felt, report) = run("server", "observe", 0);
    assert_eq!(most(&felt), (0.0, 0.0));
    assert_eq!(report.external_wrenches, 0);
}
