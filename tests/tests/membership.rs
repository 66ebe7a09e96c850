//! Nodes and servers as processes on loopback that are killed, stopped and started again, while the others go on.
//!
//! Times are printed as measured, with the load of the machine in them; what is asserted is what must hold on any machine.

use std::time::{Duration, Instant};

use taut_link::{ClientLink, Role};
use taut_network_tests::bench::reading;
use taut_proto::InputSample;
use taut_tests::patience::wait_for;
use taut_tests::process::Process;
use taut_tests::workbench::{END_LIMIT, Server, TestWorkbench};
use tokio::runtime::Runtime;

use crate::support::{SMALL, draws};

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");
const SCENE: &str = "sphere-on-plane";
/// Longest wait for a node that joins: a debug build on a busy machine.
const JOIN_LIMIT: Duration = Duration::from_secs(60);
/// Longest gap between two frames of an undisturbed node: the processor draws ten a second, other nodes and tests have it too.
const UNDISTURBED_MS: f64 = 3000.0;
/// Silence after which the workbench gives a node up: above what a busy machine starves one for, and above [`UNDISTURBED_MS`], so that who
/// waited for a dead node is told from who did not.
const NODE_TIMEOUT_S: f64 = 4.0;
/// The watchdog's promise: no force that is older, as long as the loop is on time.
const ZERO_FORCE_MS: f64 = 120.0;

/// Datagrams that a client sends with the keys of an epoch that is over.
const OLD_DATAGRAMS: u64 = 50;

/// The number before `unit` in a report's sentence.
fn number_before(report: &str, unit: &str) -> f64 {
    let (before, _) = report
        .split_once(unit)
        .unwrap_or_else(|| panic!("no \"{unit}\" in: {report}"));
    let word = before.split_whitespace().last().unwrap_or_default();
    word.parse()
        .unwrap_or_else(|_| panic!("no number before \"{unit}\" in: {report}"))
}

/// The number after `words` in a report's sentence.
fn number_after(report: &str, words: &str) -> f64 {
    let (_, after) = report
        .split_once(words)
        .unwrap_or_else(|| panic!("no \"{words}\" in: {report}"));
    let word = after.split_whitespace().next().unwrap_or_default();
    word.trim_end_matches([',', ';', '.'])
        .parse()
        .unwrap_or_else(|_| panic!("no number after \"{words}\" in: {report}"))
}

/// A workbench whose server logs who comes and goes.
fn telling_workbench() -> TestWorkbench {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.log = Some("warn,taut=info");
    workbench
}

fn node(workbench: &TestWorkbench, name: &str, server: &Server, more: &[&str]) -> Process {
    workbench.join("render", name, server, &[&SMALL, more].concat())
}

#[test]
fn a_node_that_is_killed_or_stopped_is_evicted_and_comes_back_while_another_goes_on_drawing() {
    let mut workbench = telling_workbench();
    if !draws(&workbench) {
        return;
    }
    workbench.set("scene", SCENE);
    workbench.set("network.node_timeout", NODE_TIMEOUT_S);
    let mut server = workbench.serve(&[]);
    let steady = node(&workbench, "table", &server, &[]);
    let mut victim = node(&workbench, "front", &server, &[]);
    server.process.line_with(&["table joined"], 1);
    server.process.line_with(&["front joined"], 1);
    std::thread::sleep(Duration::from_secs(1));

    let killed = Instant::now();
    victim.kill();
    let line = server
        .process
        .line_with(&["front", "left: it was silent"], 1);
    println!(
        "killed: evicted after {} ms of silence, told {:?} after the kill",
        number_before(&line, " ms"),
        killed.elapsed()
    );
    assert!(
        number_before(&line, " ms") >= 1e3 * NODE_TIMEOUT_S,
        "{line}"
    );

    // Its name is free: the same node again.
    let victim = node(&workbench, "front", &server, &[]);
    server.process.line_with(&["front joined"], 2);
    std::thread::sleep(Duration::from_secs(1));
    victim.pause();
    let paused = Instant::now();
    let line = server
        .process
        .line_with(&["front", "left: it was silent"], 2);
    println!(
        "stopped: evicted after {} ms of silence, told {:?} after the stop",
        number_before(&line, " ms"),
        paused.elapsed()
    );
    std::thread::sleep(Duration::from_millis(300));
    victim.resume();
    let resumed = Instant::now();
    server.process.line_with(&["front joined"], 3);
    println!(
        "joined again, told {:?} after it went on",
        resumed.elapsed()
    );
    std::thread::sleep(Duration::from_secs(1));

    let report = victim.leave();
    assert_eq!(number_after(&report, "sessions: "), 2.0, "{report}");
    let report = steady.leave();
    let gap = number_before(&report, " ms; meshes");
    println!("the other node's longest gap between two frames: {gap} ms");
    assert!(gap < UNDISTURBED_MS, "{report}");
    assert_eq!(number_after(&report, "sessions: "), 1.0, "{report}");
    let report = server.stop();
    assert_eq!(report["penetrations"], 0);
    // All that in step: the barrier was on, and let the dead go as well.
    let frames = &report["frames"];
    assert!(frames["released"].as_u64() > Some(0), "{frames}");
    assert_eq!(frames["mismatches"], 0, "{frames}");
}

/// Waits until a state says that the hand feels more than a newton.
fn wait_for_force(runtime: &Runtime, workbench: &TestWorkbench, server: &Server) {
    let link = workbench.connect(runtime, server, Role::Observer, "watcher");
    let link = link.unwrap_or_else(|error| panic!("{error}"));
    let mut states = Vec::new();
    wait_for("a force", JOIN_LIMIT, || {
        states.clear();
        link.drain_states(&mut states);
        let newest = states.last()?.state.tools.first()?;
        let force = newest.force.iter().map(|f| f * f).sum::<f32>().sqrt();
        (force > 1.0).then_some(())
    });
    runtime.block_on(link.close());
}

/// Sends with the keys of an epoch that is over.
fn send_old(link: &ClientLink) {
    let before = link.counters();
    for index in 1..=OLD_DATAGRAMS {
        link.send_input(&InputSample {
            sample_time_ns: index,
            ..reading(index)
        });
    }
    // It says hello now and then, too.
    assert!(link.counters().packets_sent >= before.packets_sent + OLD_DATAGRAMS);
}

/// The hand felt both servers, and no force that was too old.
fn assert_felt_no_old_force(bridge: Process) {
    let report = bridge.leave_json();
    assert_eq!(report["sessions"], 2, "{report}");
    assert!(report["max_force_n"].as_f64() > Some(1.0), "{report}");
    // The promise holds for a loop that is on time; by how much this one ever was late is in the same report.
    let age = report["max_force_age_ms"].as_f64().expect("a number");
    let late = report["period_us"]["max"].as_f64().expect("a number") * 1e-3;
    println!(
        "the oldest force was {age:.1} ms older than its command; longest period of the loop {late:.1} ms"
    );
    assert!(age > 0.0 && age <= ZERO_FORCE_MS + late + 1.0, "{report}");
}

#[test]
fn a_killed_servers_force_is_gone_and_everybody_joins_the_next_one() {
    let mut workbench = telling_workbench();
    let drawing = draws(&workbench);
    let (mut server, bridge) = workbench.serve_with_bridge(SCENE, &[]);
    let front = drawing.then(|| node(&workbench, "front", &server, &[]));
    let runtime = Runtime::new().expect("a runtime");
    wait_for_force(&runtime, &workbench, &server);
    // A client of the old epoch, that keeps its keys.
    let old = workbench.connect(&runtime, &server, Role::Observer, "of-the-old-epoch");
    let old = old.unwrap_or_else(|error| panic!("{error}"));
    wait_for("a state", JOIN_LIMIT, || {
        (old.counters().states > 0).then_some(())
    });

    server.process.kill();
    std::thread::sleep(Duration::from_secs(2));
    let mut again = workbench.serve_again(&server.quic, &server.udp);
    let serving = Instant::now();
    again.process.line_with(&["bridge joined"], 1);
    println!(
        "the bridge joined, told {:?} after the start",
        serving.elapsed()
    );
    if drawing {
        again.process.line_with(&["front joined"], 1);
        println!(
            "the node joined, told {:?} after the start",
            serving.elapsed()
        );
    }
    // The force comes back by itself: a simulated hand is nobody who could be hurt.
    wait_for_force(&runtime, &workbench, &again);
    // The sockets of the old one are open still: what it sends reaches the port of the next server.
    send_old(&old);
    assert_felt_no_old_force(bridge);
    if let Some(front) = front {
        let report = front.leave();
        assert_eq!(number_after(&report, "sessions: "), 2.0, "{report}");
        print!("{report}");
    }
    let report = again.stop();
    assert!(
        report["packets_refused"].as_u64() >= Some(OLD_DATAGRAMS),
        "datagrams of the old epoch: {report}"
    );
    drop(old);
}

#[test]
fn a_server_that_stops_ends_its_nodes_unless_they_are_to_stay() {
    let mut workbench = telling_workbench();
    let drawing = draws(&workbench);
    let (mut server, bridge) = workbench.serve_with_bridge(SCENE, &["--stay"]);
    server.process.line_with(&["bridge joined"], 1);
    let nodes = drawing.then(|| {
        let ends = node(&workbench, "front", &server, &[]);
        let stays = node(&workbench, "table", &server, &["--stay"]);
        server.process.line_with(&["front joined"], 1);
        server.process.line_with(&["table joined"], 1);
        (ends, stays)
    });
    let (quic, udp) = (server.quic.clone(), server.udp.clone());
    server.stop();
    let mut again = workbench.serve_again(&quic, &udp);
    again.process.line_with(&["bridge joined"], 1);
    if let Some((ends, stays)) = nodes {
        let ended = ends.end(END_LIMIT);
        assert!(ended.status.success(), "{}: {}", ended.status, ended.stderr);
        assert_eq!(number_after(&ended.stdout, "sessions: "), 1.0);
        again.process.line_with(&["table joined"], 1);
        let report = stays.leave();
        assert_eq!(number_after(&report, "sessions: "), 2.0, "{report}");
    }
    assert_eq!(bridge.leave_json()["sessions"], 2);
    again.stop();
}

#[test]
fn a_node_that_starts_again_fetches_no_mesh_and_one_that_comes_to_another_scene_draws_that() {
    let mut workbench = telling_workbench();
    if !draws(&workbench) {
        return;
    }
    workbench.set("scene", SCENE);
    let mut server = workbench.serve(&[]);
    let cache = workbench.directory().join("meshes").display().to_string();
    let with_cache = ["--frames", "2", "--mesh-cache", &cache];
    let run = |name: &str| {
        let ended = node(&workbench, name, &server, &with_cache).end(JOIN_LIMIT);
        assert!(ended.status.success(), "{}: {}", ended.status, ended.stderr);
        let counts = |report: &str| {
            (
                number_before(report, " bytes fetched"),
                number_before(report, " from the cache"),
            )
        };
        counts(&ended.stdout)
    };
    let (fetched, cached) = run("front");
    assert!(fetched > 0.0 && cached == 0.0, "{fetched}, {cached}");
    // The other node of the same machine needs the same meshes.
    assert_eq!(run("table"), (0.0, fetched));
    assert_eq!(run("front"), (0.0, fetched));

    // A server with another scene in the place of the first: the node follows.
    let pictures = workbench.directory().join("pictures");
    let drawn = || std::fs::read_dir(&pictures).map_or(0, Iterator::count);
    let out = pictures.display().to_string();
    let more = ["--mesh-cache", cache.as_str(), "--out", out.as_str()];
    let follows = node(&workbench, "front", &server, &more);
    wait_for("a picture", JOIN_LIMIT, || (drawn() > 0).then_some(()));
    server.process.kill();
    workbench.set("scene", "peg-in-a-hole");
    let mut again = workbench.serve_again(&server.quic, &server.udp);
    again.process.line_with(&["front joined"], 1);
    let before = drawn();
    wait_for("pictures of the other scene", JOIN_LIMIT, || {
        (drawn() > before + 2).then_some(())
    });
    let report = follows.leave();
    assert_eq!(number_after(&report, "sessions: "), 2.0, "{report}");
    assert!(
        number_before(&report, " bytes fetched") > 0.0,
        "the meshes of the other scene: {report}"
    );
    let picture = |number: usize| {
        let name = format!("front-front-{number:05}.png");
        std::fs::read(pictures.join(name)).unwrap_or_else(|error| panic!("{error}"))
    };
    assert!(picture(1) != picture(drawn()), "it is another scene");
    let report = again.stop();
    let clients = report["clients"].as_array().expect("a list");
    let front = clients.iter().find(|client| client["node"] == "front");
    let front = front.expect("it was there");
    assert_eq!(front["state_hash_mismatches"], 0);
}
