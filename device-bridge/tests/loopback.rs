//! A bridge and a server on this machine: poses one way, wrenches the other, and what happens when one is lost.

use std::process::{Command, Stdio};
use std::thread::{self, JoinHandle};

use crate::support::Workbench;
use taut_bridge::{BridgeArgs, BridgeError, BridgeReport, run};
use taut_link::create_key_file;

const REACH: &str = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.05,1,0,0,0\n0.7,0,0,-0.02,1,0,0,0\n";

/// A firm hand reaches through the wall and stays. Where the machine pauses a thread for longer than a watchdog waits, the force fades, as it must, and
/// comes back: so it is waited for.
#[test]
fn poses_arrive_and_the_wall_pushes_the_far_hand_back() {
    let mut workbench = Workbench::start();
    let path = workbench.file("reach.csv", REACH);
    let path = path.to_str().expect("a plain path");
    let args = workbench.args(&["--hand", "firm", "--path", path, "--duration", "120"]);
    let bridge = run_in_background(args);
    // Firm hand against the wall: 500 (0.02 - d) = 500 d, so 10 mm and 5 N. Where no force arrives it rests at 20 mm.
    workbench.wait_for_rest(-0.0105..-0.0095, 200);
    workbench.shut_down();
    let report = bridge.join().expect("no panic").expect("a whole run");
    let seen = workbench.finish();

    assert_eq!(report.ended, "the server stopped");
    assert_eq!((report.sessions, report.faulty_ticks), (1, 0));
    assert!(seen.good > 200, "{} readings", seen.good);
    assert!(seen.first_z.is_some_and(|z| z > 0.04), "{:?}", seen.first_z);
    assert!(report.ticks > 500 && report.wrenches > 100, "{report}");
    assert!(report.packets_sent > report.ticks / 2 && report.packets_received >= report.wrenches);
    assert!(report.period_us.is_some() && report.round_trip_us.is_some());
    assert!(
        report.max_force_n > 3.0 && report.max_force_n < 12.0,
        "{report}"
    );
    let json = serde_json::to_value(&report).expect("a report is JSON");
    assert!(json["period_us"]["p99"].is_u64() && json["energy_injected_j"].is_f64());
}

#[test]
fn a_trace_is_replayed_to_its_end() {
    let workbench = Workbench::start();
    // It stays at the end for longer than a busy machine pauses a thread.
    let trace = workbench.file("trace.csv", &format!("{REACH}2.7,0,0,-0.02,1,0,0,0\n"));
    let device = format!("trace:{}", trace.display());
    let report = run(&workbench.args(&["--device", &device, "--duration", "60"])).expect("a run");
    let seen = workbench.finish();
    assert_eq!(report.ended, "the trace ended");
    assert!(
        report.duration_s >= 2.69 && report.duration_s < 60.0,
        "{report}"
    );
    assert!(seen.lowest_z < -0.015, "{} m", seen.lowest_z);
}

fn run_in_background(args: BridgeArgs) -> JoinHandle<Result<BridgeReport, BridgeError>> {
    thread::Builder::new()
        .name("bridge".to_owned())
        .spawn(move || run(&args))
        .expect("a thread")
}

#[test]
fn a_server_that_stops_in_good_order_ends_the_bridge_without_an_error() {
    let mut workbench = Workbench::start();
    let bridge = run_in_background(workbench.args(&["--duration", "60"]));
    workbench.wait_for_inputs(50);
    workbench.shut_down();
    let report = bridge
        .join()
        .expect("no panic")
        .expect("the end of the session is no failure");
    assert_eq!(report.ended, "the server stopped");
    assert!(report.ticks > 50 && report.sessions == 1, "{report}");
    workbench.finish();
}

#[test]
fn a_server_that_stays_lost_ends_the_bridge_with_a_sentence_and_code_1() {
    let mut workbench = Workbench::start();
    let bridge = run_in_background(workbench.args(&["--duration", "60", "--give-up", "1"]));
    workbench.wait_for_inputs(50);
    workbench.vanish();
    let error = bridge
        .join()
        .expect("no panic")
        .expect_err("the server is gone");
    assert_eq!(error.exit_code(), 1);
    assert!(error.to_string().contains("was lost"), "{error}");
    let BridgeError::ServerLost { report, .. } = error else {
        panic!("expected ServerLost, got {error}");
    };
    assert!(report.ticks > 50);
    workbench.finish();
}

#[test]
fn a_bridge_told_to_stay_comes_back_to_a_new_server() {
    let mut workbench = Workbench::start();
    let args = workbench.args(&[]);
    let bridge = Command::new(env!("CARGO_BIN_EXE_taut-bridge"))
        .args([
            "--server",
            &args.server,
            "--duration",
            "60",
            "--stay",
            "--json",
        ])
        .env("TAUT_KEY_FILE", args.key.as_ref().expect("given"))
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary starts");
    workbench.wait_for_inputs(50);
    workbench.restart();
    workbench.wait_for_inputs(50);

    // And a signal ends it cleanly.
    let ended = Command::new("kill")
        .args(["-TERM", &bridge.id().to_string()])
        .status();
    assert!(ended.expect("kill runs").success());
    let output = bridge.wait_with_output().expect("the bridge ends");
    assert_eq!(output.status.code(), Some(0));
    let report: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("the report is JSON");
    assert_eq!(report["sessions"], 2, "{report}");
    assert_eq!(report["ended"], "stopped by a signal");
    assert!(
        report["realtime"]
            .as_array()
            .is_some_and(|grants| !grants.is_empty())
    );
    workbench.finish();
}

#[test]
fn a_wrong_key_and_bad_files_are_refused_with_code_2() {
    let workbench = Workbench::start();
    let refused = |more: &[&str], part: &str| {
        let error = run(&workbench.args(more)).expect_err("bad input");
        assert_eq!(error.exit_code(), 2, "{error}");
        assert!(error.to_string().contains(part), "{error}");
    };
    let other = workbench.folder.path().join("other");
    create_key_file(&other).expect("another key");
    let mut args = workbench.args(&[]);
    args.key = Some(other);
    let error = run(&args).expect_err("the wrong key");
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("fingerprint"), "{error}");

    refused(&["--path", "no/such/path.csv"], "no/such/path.csv");
    refused(&["--rate", "0"], "--rate is 0");
    refused(&["--duration", "NaN"], "--duration is NaN");
    refused(&["--give-up", "NaN"], "--give-up is NaN");
    let open = workbench.file("open.csv", REACH);
    let open = open.to_str().expect("a plain path");
    refused(&["--path", open, "--loop"], "repeat the first pose");
    workbench.finish();
}
