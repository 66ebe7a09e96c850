//! A workbench in pieces on loopback: server, bridge, render node and recorder as processes, two more clients in this one.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use taut_link::{
    ClientLink, ClientOptions, LinkError, ReceivedState, Role, Transport, connect, create_key_file,
};
use taut_proto::PoseF32;
use taut_proto::control::RefusalCode;
use taut_scene::Scene;
use taut_tests::patience::wait_for;
use taut_tests::process::Process;
use taut_tests::workbench::{END_LIMIT, Server, TestWorkbench};
use tokio::runtime::Runtime;

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");
const SCENE: &str = "sphere-on-plane";
/// Longest wait for a client that joins, or for something that joined to happen.
const JOIN_LIMIT: Duration = Duration::from_secs(60);
/// Pictures after which a node has drawn for sure, and told the server of more than [`TOLD_FRAMES`].
const PICTURES: usize = 30;
/// Frames that the server must know of.
const TOLD_FRAMES: u64 = 10;
/// Longest silence that counts as undisturbed, where states come every millisecond: more than a busy machine starves a thread for, and less than
/// any time after which somebody is given up, so that who waited for one that is gone is told from who did not.
const UNDISTURBED: Duration = Duration::from_secs(3);
/// States that each client must get after something happened.
const GOES_ON: u64 = 200;

/// A client in this process: takes every state until it is told to stop.
struct Client {
    link: Arc<ClientLink>,
    stop: Arc<AtomicBool>,
    felt: Arc<AtomicBool>,
    taker: JoinHandle<Vec<ReceivedState>>,
}

impl Client {
    fn options(
        workbench: &TestWorkbench,
        server: &Server,
        node: &str,
        transport: Transport,
    ) -> ClientOptions {
        ClientOptions {
            transport,
            // A busy machine may starve a client for longer than a workbench would forgive.
            connect_timeout: JOIN_LIMIT,
            idle_timeout: Duration::from_secs(4),
            ..ClientOptions::new(server.quic.clone(), workbench.key(), Role::Render, node)
        }
    }

    fn join(runtime: &Runtime, options: ClientOptions) -> Self {
        let name = options.node.clone();
        let link = Arc::new(
            runtime
                .block_on(connect(options))
                .unwrap_or_else(|error| panic!("{error}")),
        );
        let stop = Arc::new(AtomicBool::new(false));
        let felt = Arc::new(AtomicBool::new(false));
        let (taken_from, stopped, feels) = (link.clone(), stop.clone(), felt.clone());
        let take = move || {
            let mut states = Vec::new();
            while !stopped.load(Ordering::Relaxed) {
                taken_from.drain_states(&mut states);
                feels.store(
                    states.last().is_some_and(|newest| force(newest) > 1.0),
                    Ordering::Relaxed,
                );
                std::thread::sleep(Duration::from_millis(5));
            }
            states
        };
        let taker = std::thread::Builder::new()
            .name(name)
            .spawn(take)
            .expect("a thread");
        Self {
            link,
            stop,
            felt,
            taker,
        }
    }

    /// Whether the newest state has a force of more than a newton.
    fn saw_force(&self) -> bool {
        self.felt.load(Ordering::Relaxed)
    }

    /// Waits for the states after something happened; how many there were before it.
    fn goes_on(&self, before: u64) {
        wait_for("states", JOIN_LIMIT, || {
            (self.link.counters().states >= before + GOES_ON).then_some(())
        });
    }

    fn leave(self) -> Vec<ReceivedState> {
        assert_eq!(self.link.is_closed(), None);
        self.stop.store(true, Ordering::Relaxed);
        self.taker.join().expect("the taker does not panic")
    }
}

fn god_objects(states: &[ReceivedState]) -> HashMap<u64, PoseF32> {
    states
        .iter()
        .map(|received| (received.state.tick, received.state.tools[0].god_object))
        .collect()
}

fn force(received: &ReceivedState) -> f32 {
    received.state.tools[0]
        .force
        .iter()
        .map(|f| f * f)
        .sum::<f32>()
        .sqrt()
}

/// Longest time without a state from this moment on.
fn longest_silence(states: &[ReceivedState], from: Instant) -> Duration {
    let moments = states.iter().map(|state| state.received);
    let came: Vec<Instant> = std::iter::once(from)
        .chain(moments.filter(|moment| *moment >= from))
        .collect();
    let gaps = came.windows(2).map(|two| two[1] - two[0]);
    gaps.max().unwrap_or(Duration::MAX)
}

/// A node that draws without a window, called "front".
fn draw(workbench: &TestWorkbench, server: &Server, options: &[&str]) -> Process {
    let options = [&["--headless"], options].concat();
    workbench.join("render", "front", server, &options)
}

/// A recorder into the workbench's directory.
fn record(workbench: &TestWorkbench, server: &Server) -> Process {
    let key = workbench.key_path();
    let out = workbench.directory().join("recorded.csv");
    let out = out.display().to_string();
    let from = ["record", "--server", &server.quic, "--key", &key];
    workbench.start("recorder", &[&from[..], &["--out", &out]].concat())
}

/// The client knows [`SCENE`], and gets each mesh by its hash.
fn assert_knows_scene(runtime: &Runtime, client: &Client) {
    let scene = Scene::named_or_file(SCENE)
        .and_then(|scene| scene.build())
        .unwrap_or_else(|error| panic!("{error}"));
    let description = client.link.description();
    assert_eq!(description.name, SCENE);
    let bodies = std::iter::once(&description.god_object).chain(&description.obstacles);
    assert_eq!(description.obstacles.len() + 1, scene.bodies.len());
    for (body, built) in bodies.zip(&scene.bodies) {
        let mesh = runtime
            .block_on(client.link.mesh(body.mesh))
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(body.name, built.name);
        assert_eq!(
            (mesh.positions_f64().len(), mesh.triangles().len()),
            (built.mesh.vertices.len(), built.mesh.triangles.len())
        );
    }
}

/// Kills the recorder without a goodbye; the clients go on, also when the server has given it up. When it was killed.
fn kill_beside(clients: &[Client], mut recorder: Process) -> Instant {
    assert!(recorder.is_running(), "the recorder ended by itself");
    let states = |client: &Client| client.link.counters().states;
    let counts: Vec<u64> = clients.iter().map(states).collect();
    recorder.kill();
    let killed = Instant::now();
    std::thread::sleep(UNDISTURBED + Duration::from_millis(500));
    for (client, before) in clients.iter().zip(counts) {
        client.goes_on(before);
    }
    killed
}

/// Ticks and times rise, and states came all the time `from` this moment on.
fn assert_undisturbed(name: &str, states: &[ReceivedState], from: Instant) {
    let mut pairs = states.windows(2).map(|two| (&two[0].state, &two[1].state));
    assert!(
        pairs.clone().all(|(a, b)| a.tick < b.tick),
        "{name} saw ticks out of order"
    );
    assert!(
        pairs.all(|(a, b)| a.sample_time_ns <= b.sample_time_ns),
        "{name} saw time run back"
    );
    let silence = longest_silence(states, from);
    println!(
        "{name}: {} states, longest silence {silence:?}",
        states.len()
    );
    assert!(
        silence < UNDISTURBED,
        "{name} heard nothing for {silence:?}"
    );
}

/// Who shares a tick with the reference shares its god-object.
fn assert_same_world(name: &str, states: &[ReceivedState], reference: &HashMap<u64, PoseF32>) {
    let mut common = 0;
    for (tick, pose) in god_objects(states) {
        if let Some(other) = reference.get(&tick) {
            assert_eq!(*other, pose, "{name} sees another world at tick {tick}");
            common += 1;
        }
    }
    assert!(common > 50, "{name} shares only {common} ticks");
}

/// The sphere moves, touches and pushes back.
fn assert_pushes(states: &[ReceivedState]) {
    assert!(
        states
            .windows(2)
            .any(|two| two[0].state.tools[0].god_object != two[1].state.tools[0].god_object),
        "nothing moves"
    );
    let strongest = states.iter().map(force).fold(0.0, f32::max);
    assert!(strongest > 1.0, "the largest force told is {strongest} N");
    assert!(
        states
            .iter()
            .any(|received| !received.state.contacts.is_empty() && force(received) > 1.0)
    );
}

fn assert_felt(bridge: Process) {
    let report = bridge.leave_json();
    assert!(
        report["max_force_n"].as_f64() > Some(1.0),
        "the device felt {} N",
        report["max_force_n"]
    );
    // The server offers the coupling to its bridge, so constraint sets arrive in place of wrenches.
    assert_eq!(report["coupling"], "edge");
    assert!(
        report["sets"].as_u64() > Some(50),
        "{} sets",
        report["sets"]
    );
}

/// The server has told of everybody who was there, and of the node's frames if one was `drawn`.
fn assert_told(report: &serde_json::Value, drawn: bool) {
    assert_eq!(report["penetrations"], 0);
    let node = |name: &str| {
        let mut all = report["clients"].as_array().into_iter().flatten();
        all.find(|client| client["node"] == name)
            .unwrap_or_else(|| panic!("no {name} in {}", report["clients"]))
    };
    for name in ["early", "late", "bridge"] {
        node(name);
    }
    assert_eq!(node("over-quic")["transport"], "quic");
    if drawn {
        let front = node("front");
        assert!(front["frames"].as_u64() >= Some(TOLD_FRAMES), "{front}");
        assert_eq!(front["state_hash_mismatches"], 0);
    }
    assert_eq!(report["observers"], 1);
}

#[test]
fn everybody_sees_the_same_world_and_nobody_is_disturbed_by_those_who_go() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    let adapter = workbench.adapter();
    let (mut server, bridge) = workbench.serve_with_bridge(SCENE, &["--give-up", "1"]);
    let runtime = Runtime::new().expect("a runtime");
    let join = |node, transport| {
        Client::join(
            &runtime,
            Client::options(&workbench, &server, node, transport),
        )
    };
    let early = join("early", Transport::Udp);
    let over_quic = join("over-quic", Transport::QuicDatagram);
    let recorder = record(&workbench, &server);
    let pictures = workbench.directory().join("pictures");
    let out = pictures.display().to_string();
    let options = ["--width", "320", "--height", "240", "--out", &out];
    let drawing = adapter.is_ok().then(|| draw(&workbench, &server, &options));

    early.goes_on(0);
    let late = join("late", Transport::Udp);
    assert_eq!(late.link.description(), early.link.description());
    assert_knows_scene(&runtime, &late);
    if drawing.is_some() {
        wait_for("pictures", JOIN_LIMIT, || {
            let drawn = std::fs::read_dir(&pictures).map_or(0, Iterator::count);
            (drawn >= PICTURES).then_some(())
        });
    }

    let clients = [early, over_quic, late];
    let killed = kill_beside(&clients, recorder);
    // The hand goes round again and again: whatever was missed of it comes.
    wait_for("a force", JOIN_LIMIT, || {
        clients[0].saw_force().then_some(())
    });
    assert!(server.process.is_running());

    let [early, over_quic, late] = clients.map(Client::leave);
    let reference = god_objects(&early);
    assert_undisturbed("early", &early, killed);
    for (name, states) in [("over-quic", &over_quic), ("late", &late)] {
        assert_undisturbed(name, states, killed);
        assert_same_world(name, states, &reference);
    }
    assert_pushes(&early);
    assert_felt(bridge);
    if let Some(drawing) = drawing {
        drawing.leave();
    } else {
        taut_test_kit::left_out("the render node, because there is no adapter");
    }
    assert_told(&server.stop(), adapter.is_ok());
}

#[test]
fn a_second_node_of_the_same_name_and_one_with_another_key_are_refused_in_one_sentence() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.set("scene", SCENE);
    let server = workbench.serve(&[]);
    let runtime = Runtime::new().expect("a runtime");
    let options = Client::options(&workbench, &server, "front", Transport::Udp);
    let first = Client::join(&runtime, options.clone());
    match runtime.block_on(connect(options)) {
        Err(LinkError::Refused { code, text, .. }) => {
            assert_eq!(code, RefusalCode::NameTaken);
            assert!(text.raw().contains("front"), "{text}");
        }
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("two nodes are called front"),
    }

    let other_key = workbench.directory().join("other.key");
    create_key_file(&other_key).unwrap_or_else(|error| panic!("{error}"));
    let other_key = other_key.display().to_string();
    for (role, arguments) in [
        ("bridge", vec!["--node", "b"]),
        ("record", vec!["--out", "trace.csv"]),
    ] {
        let always = [role, "--server", &server.quic, "--key", &other_key];
        let ended = workbench.run(role, &[&always[..], &arguments].concat());
        assert_eq!(ended.status.code(), Some(2), "{role}: {}", ended.stderr);
        let sentence = ended.one_sentence();
        assert!(
            sentence.contains("cluster key")
                && sentence.contains(&server.quic)
                && sentence.contains("--key"),
            "{sentence}"
        );
    }
    assert!(
        !workbench.directory().join("trace.csv").exists(),
        "a refused recorder left a file"
    );

    first.leave();
    server.stop();
}

#[test]
fn when_the_server_dies_the_bridge_and_the_render_node_say_so_and_end_when_they_gave_up() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.log = Some("warn,taut=info");
    let adapter = workbench.adapter();
    let (mut server, bridge) = workbench.serve_with_bridge(SCENE, &["--give-up", "1"]);
    let options = ["--width", "64", "--height", "64", "--give-up", "1"];
    let drawing = adapter.is_ok().then(|| draw(&workbench, &server, &options));
    if adapter.is_ok() {
        server.process.line_with(&["front joined"], 1);
    }
    let runtime = Runtime::new().expect("a runtime");
    let client = Client::join(
        &runtime,
        Client::options(&workbench, &server, "client", Transport::Udp),
    );
    wait_for("a force from the device's touch", JOIN_LIMIT, || {
        client.saw_force().then_some(())
    });
    server.process.kill();
    for process in std::iter::once(bridge).chain(drawing) {
        let ended = process.end(END_LIMIT);
        assert_eq!(ended.status.code(), Some(1), "{}", ended.stderr);
        let last = ended.stderr.lines().last().unwrap_or_default();
        assert!(
            last.contains(&server.quic) && last.contains("was lost"),
            "{}",
            ended.stderr
        );
    }
    wait_for("the client to learn of it", END_LIMIT, || {
        client.link.is_closed()
    });
}
