//! `taut demo` as a newcomer runs it: everything up, a report, and nothing left behind.

use std::time::Duration;

use serde_json::Value;
use taut_tests::patience::wait_for;
use taut_tests::process::Process;
use taut_tests::workbench::{END_LIMIT, START_LIMIT, TestWorkbench};

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");
/// How long the demo runs, s: longer again where the machine was too slow for as many pictures.
const DURATIONS_S: [u64; 3] = [12, 40, 120];
/// Pictures of a node that are enough.
const ENOUGH_FRAMES: u64 = 10;
/// Only a node that waits for something has poses that are older, ms.
const OLDEST_POSE_MS: f64 = 2000.0;
/// Share by which the periods of the haptics loop, those that it was late for and skipped included, may be off its rate.
const RATE_TOLERANCE: f64 = 0.02;

#[test]
fn the_demo_brings_everything_up_and_reports_it() {
    let workbench = TestWorkbench::new(PROGRAM);
    let adapter = workbench.adapter();
    let drew = |report: &Value| {
        let clients = report["clients"].as_array().expect("a list");
        let drew = |client: &Value| {
            client["frames"].as_u64() >= Some(ENOUGH_FRAMES)
                && client["swap_skew_us"]["count"].as_u64() > Some(0)
        };
        clients.len() == 2 && clients.iter().all(drew)
    };
    let enough = DURATIONS_S
        .iter()
        .any(|duration_s| drew(&run(&workbench, &adapter, *duration_s)) || adapter.is_err());
    assert!(enough, "not both nodes drew in step");
}

fn demo(workbench: &TestWorkbench, arguments: &str) -> Process {
    let words = std::iter::once("demo").chain(arguments.split(' '));
    workbench.start("demo", &words.collect::<Vec<_>>())
}

/// A demo of so many seconds; what must hold of its report on any machine.
fn run(workbench: &TestWorkbench, adapter: &Result<(), String>, duration_s: u64) -> Value {
    let demo = demo(
        workbench,
        &format!("--duration {duration_s} --headless --json"),
    );
    let ended = demo.end(START_LIMIT + Duration::from_secs(duration_s) + END_LIMIT);
    assert!(ended.status.success(), "{}", ended.status);
    let report = ended.json();

    let hz = report["haptics_hz"].as_f64().expect("a number");
    println!(
        "haptics {hz:.1} Hz, {} deadlines missed, realtime {}",
        report["deadline_misses"], report["realtime"]
    );
    // Where the machine lets it run late, the loop skips whole periods and counts them: together they are the rate, on any machine.
    let [ticks, missed, seconds] = [
        &report["haptics_period_us"]["count"],
        &report["deadline_misses"],
        &report["duration_s"],
    ]
    .map(|number| number.as_f64().expect("a number"));
    let due = 1000.0 * seconds;
    assert!(
        ticks <= (1.0 + RATE_TOLERANCE) * due && ticks + missed >= (1.0 - RATE_TOLERANCE) * due,
        "{ticks} ticks and {missed} missed of {due}"
    );
    assert!(
        report["duration_s"]
            .as_f64()
            .is_some_and(|s| s >= duration_s as f64)
    );
    assert!(
        report["penetration_checks"].as_u64() > Some(0),
        "{} poses checked",
        report["penetration_checks"]
    );
    assert_eq!(report["penetrations"], 0);
    assert!(
        report["contacts"]["max"].as_f64() > Some(0.0),
        "the hand never touched anything"
    );
    assert_eq!(report["observers"], 0);

    let clients = report["clients"].as_array().expect("a list");
    if let Err(reason) = adapter {
        println!("no adapter here, and the demo says so");
        assert!(ended.stderr.contains("no graphics adapter"), "{reason}");
        return report;
    }
    let nodes: Vec<&Value> = clients.iter().map(|client| &client["node"]).collect();
    assert_eq!(nodes.len(), 2, "{nodes:?}");
    for client in clients {
        println!("{client}");
        assert_eq!(client["state_hash_mismatches"], 0);
        assert_eq!(client["transport"], "udp");
        let age = client["pose_age_ms"]["p50"].as_f64().expect("a number");
        assert!(age <= OLDEST_POSE_MS, "poses {age} ms old");
        let drawn = client["drawn_age_ms"]["p50"].as_f64().expect("a number");
        assert!(drawn >= age, "drawn after {drawn} ms, taken after {age} ms");
    }
    // Both nodes drew what was released for each frame.
    let frames = &report["frames"];
    println!("{frames}");
    assert_eq!(frames["mismatches"], 0);
    assert!(
        report["packets_sent"].as_u64() > Some(1000),
        "{} packets",
        report["packets_sent"]
    );
    report
}

#[test]
fn ctrl_c_ends_the_demo_and_its_children() {
    let workbench = TestWorkbench::new(PROGRAM);
    let arguments = "--headless --json --bridge --transport quic --scene sphere-on-plane";
    let mut demo = demo(&workbench, arguments);
    demo.line_after("serving on ");
    assert!(demo.is_running());
    demo.interrupt();
    // `end` also fails when a child outlives the demo.
    let ended = demo.end(END_LIMIT);
    assert!(ended.status.success(), "{}", ended.status);
    assert!(ended.json()["haptics_hz"].is_number());
}

#[test]
fn a_demo_that_is_killed_takes_its_children_along() {
    let workbench = TestWorkbench::new(PROGRAM);
    let arguments = "--headless --no-monitor --bridge --scene sphere-on-plane";
    let mut demo = demo(&workbench, arguments);
    demo.line_after("serving on ");
    wait_for("children of the demo", START_LIMIT, || {
        (children(demo.id()) > 0).then_some(())
    });
    demo.kill();
    wait_for("the end of the demo's children", END_LIMIT, || {
        (!demo.group_lives()).then_some(())
    });
}

#[test]
fn a_scene_that_is_refused_gets_one_sentence_even_where_ports_are_taken() {
    let workbench = TestWorkbench::new(PROGRAM);
    // Taken here or by somebody else already: either way the demo would need another one.
    let _taken = std::net::UdpSocket::bind(("127.0.0.1", taut_link::DEFAULT_QUIC_PORT));
    let ended = workbench.run("demo", &["demo", "--headless", "--scene", "no-such-scene"]);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    let sentence = ended.one_sentence();
    assert!(sentence.contains("no-such-scene"), "{sentence}");
}

/// How many processes the process of this number started and has not lost yet.
fn children(parent: u32) -> usize {
    let tasks = std::fs::read_dir(format!("/proc/{parent}/task"))
        .into_iter()
        .flatten()
        .flatten();
    let listed =
        tasks.filter_map(|task| std::fs::read_to_string(task.path().join("children")).ok());
    listed.map(|list| list.split_whitespace().count()).sum()
}
