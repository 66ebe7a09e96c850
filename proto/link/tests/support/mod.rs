//! A small scene, states, and a server on free ports of 127.0.0.1.

use std::{
    net::SocketAddr,
    thread::JoinHandle,
    time::{Duration, Instant},
};
use taut_link::{
    Broadcaster, ClientLink, ClientOptions, ClientStatus, ClusterKey, Content, LinkError,
    LinkEvent, ReceivedState, Role, ServerLink, ServerOptions, Transport, connect, serve,
};
use taut_proto::{
    HotState, InputSample, MeshBlob, MeshHash, PoseF32, PoseF64, SceneDescription,
    mesh_blob::Positions,
    scene::{BodyDescription, NodeDescription, ScreenDescription, Stereo, WindowDescription},
    state::{RunState, ToolState},
};
use taut_test_kit::relay::{Direction, Impairment, Relay, Treatment, Waiting};
use tokio::runtime::Runtime;

/// Only a hang takes this long; every wait ends as soon as its condition holds.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// States that may be on the way at once where a test counts losses: more than a socket's buffer holds would be lost by a starved
/// machine, and not by what is tested.
pub const MAX_ON_THE_WAY: u64 = 50;

/// Silence that a busy test machine may cause.
pub const FORGIVING: Duration = Duration::from_secs(4);

/// What there must be, or the test ends with the reason.
#[track_caller]
pub fn must<T, E: std::fmt::Display>(result: Result<T, E>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}

pub fn key(digit: char) -> ClusterKey {
    must(ClusterKey::parse(&digit.to_string().repeat(64)))
}

/// A strip of `count` triangles.
pub fn strip(count: u32) -> MeshBlob {
    let positions = (0..count + 2)
        .map(|i| [f64::from(i) * 1e-3, f64::from(i % 2) * 1e-3, 0.0])
        .collect();
    let triangles = (0..count).map(|i| [i, i + 1, i + 2]).collect();
    must(MeshBlob::new(Positions::F64(positions), triangles, None))
}

pub fn hash_of(mesh: &MeshBlob) -> MeshHash {
    match mesh.encode() {
        Ok(bytes) => MeshHash::of(&bytes),
        Err(error) => panic!("{error}"),
    }
}

pub fn content() -> Content {
    let meshes = vec![strip(12), strip(27_000)];
    let body = |name: &str, mesh: &MeshBlob| BodyDescription {
        name: name.into(),
        mesh: hash_of(mesh),
        pose: PoseF64::IDENTITY,
        colour: [1.0, 0.5, 0.1, 1.0],
    };
    let description = SceneDescription {
        revision: 7,
        obstacles: vec![body("box", &meshes[1])],
        reference_point: [0.0, 0.0, 0.01],
        screens: vec![ScreenDescription {
            name: "front".into(),
            lower_left: [-0.5, 0.5, 0.0],
            lower_right: [0.5, 0.5, 0.0],
            upper_left: [-0.5, 0.5, 1.0],
            output: Default::default(),
        }],
        nodes: vec![NodeDescription {
            name: "left".into(),
            screens: vec!["front".into()],
            stereo: Stereo::SideBySide,
            window: WindowDescription {
                width: 640,
                height: 480,
                fullscreen: false,
            },
            monitors: vec![],
        }],
        ..SceneDescription::of_body("test", body("peg", &meshes[0]))
    };
    Content {
        description,
        meshes,
        textures: Vec::new(),
        panorama: None,
    }
}

/// A server that forgives what a busy test machine does to its clients.
pub fn forgiving() -> ServerOptions {
    ServerOptions {
        idle_timeout: FORGIVING,
        node_timeout: FORGIVING,
        ..ServerOptions::loopback(key('a'))
    }
}

pub async fn server() -> ServerLink {
    server_with(forgiving()).await
}

pub async fn server_with(options: ServerOptions) -> ServerLink {
    must(serve(options, content()).await)
}

pub fn options(server: &ServerLink, role: Role, node: &str) -> ClientOptions {
    // A busy test machine may starve a client for longer than a workbench would forgive.
    ClientOptions {
        connect_timeout: PATIENCE,
        idle_timeout: FORGIVING,
        ..ClientOptions::new(server.quic_addr().to_string(), key('a'), role, node)
    }
}

pub async fn client(server: &ServerLink, role: Role, node: &str) -> ClientLink {
    must(connect(options(server, role, node)).await)
}

/// A render node, with this transport.
pub async fn node_over(transport: Transport, server: &ServerLink, node: &str) -> ClientLink {
    let options = ClientOptions {
        transport,
        ..options(server, Role::Render, node)
    };
    must(connect(options).await)
}

/// State of `tick`, 1 kHz, whose numbers tell the tick.
pub fn state(tick: u64) -> HotState {
    let mut state = HotState {
        tick,
        sample_time_ns: tick * 1_000_000,
        scene_revision: 7,
        run: RunState::Running,
        ..HotState::empty()
    };
    state.tools.push(ToolState {
        god_object: PoseF32 {
            position: [tick as f32 * 1e-6, 0.0, 0.1],
            ..PoseF32::IDENTITY
        },
        force: [0.0, 1.5, tick as f32 * 1e-3],
        ..ToolState::default()
    });
    state
}

pub fn input(index: u64) -> InputSample {
    InputSample {
        sample_time_ns: index * 1_000_000,
        clock_uncertainty_ns: 0,
        index,
        pose: PoseF64 {
            position: [index as f64 * 1e-3, 0.0, 0.0],
            ..PoseF64::IDENTITY
        },
        velocity: [0.0; 6],
        buttons: 1,
        flags: 0,
        rendered: [0.0; 6],
        set_made_ns: 0,
    }
}

/// The clients' side of a relay, before the server's port is known.
pub fn relay_port() -> Waiting {
    must(Waiting::bind())
}

/// A relay that treats every client so, both ways.
pub fn start_relay(port: Waiting, server: SocketAddr, impairment: Impairment, seed: u64) -> Relay {
    must(port.start(server, vec![Treatment::both_ways(impairment)], seed))
}

/// A server whose hot plane is behind a relay.
pub async fn behind_relay(impairment: Impairment, seed: u64) -> (ServerLink, Relay) {
    let port = relay_port();
    let server = server_with(ServerOptions {
        announced_udp_port: Some(port.address().port()),
        ..forgiving()
    })
    .await;
    let relay = start_relay(port, server.udp_addr(), impairment, seed);
    (server, relay)
}

/// The server's datagrams that did not arrive as they were sent.
pub fn lost_down(relay: &Relay) -> u64 {
    let counts = relay.counts(Direction::Down);
    counts.all_lost() + counts.flipped
}

/// Sends states of growing tick until `done`, one per millisecond; gives up after [`PATIENCE`]. Returns the next tick.
pub async fn broadcast_until(
    broadcaster: &mut Broadcaster,
    first: u64,
    mut done: impl FnMut() -> bool,
) -> u64 {
    let start = Instant::now();
    let mut tick = first;
    while !done() {
        assert!(
            start.elapsed() < PATIENCE,
            "what was waited for did not happen by tick {tick}"
        );
        broadcaster.send(&state(tick));
        tick += 1;
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    tick
}

/// Sends states until `client` has `count` of them; the next tick.
pub async fn take_states(
    server: &ServerLink,
    client: &ClientLink,
    first: u64,
    count: usize,
) -> u64 {
    let mut states = Vec::new();
    let next = broadcast_until(&mut server.broadcaster(), first, || {
        client.drain_states(&mut states);
        states.len() >= count
    })
    .await;
    assert_in_order(&states);
    next
}

/// As [`broadcast_until`], but a state is sent only while fewer than [`MAX_ON_THE_WAY`] states are neither in `settled` nor lost on purpose.
/// `settled` says how many states have arrived so far, or were lost where the test wants it.
pub async fn broadcast_in_step_until(
    broadcaster: &mut Broadcaster,
    first: u64,
    mut settled: impl FnMut() -> u64,
    mut done: impl FnMut() -> bool,
) -> u64 {
    let (start, settled_before) = (Instant::now(), settled());
    let mut tick = first;
    while !done() {
        assert!(
            start.elapsed() < PATIENCE,
            "what was waited for did not happen by tick {tick}"
        );
        if tick - first < settled() - settled_before + MAX_ON_THE_WAY {
            broadcaster.send(&state(tick));
            tick += 1;
        }
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    tick
}

pub async fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < PATIENCE, "{what}: did not happen in time");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// Waits until the server knows where every client's datagrams come from.
pub async fn all_have_paths(server: &ServerLink) {
    let has_path = |client: &ClientStatus| client.udp_address.is_some();
    wait_until("their paths", || server.clients().iter().all(has_path)).await;
}

/// Sends readings until the server has one: what the full buffer of a socket did not take is followed by the next, as a device's are.
pub async fn a_reading_arrives(device: &ClientLink, server: &ServerLink) {
    let mut index = 0;
    wait_until("a reading of the device", || {
        index += 1;
        device.send_input(&input(index));
        server.counters().inputs > 0
    })
    .await;
}

pub fn drain(client: &ClientLink) -> Vec<ReceivedState> {
    let mut states = Vec::new();
    client.drain_states(&mut states);
    states
}

pub async fn event(
    server: &ServerLink,
    what: &str,
    mut wanted: impl FnMut(&LinkEvent) -> bool,
) -> LinkEvent {
    let start = Instant::now();
    loop {
        while let Some(event) = server.try_event() {
            if wanted(&event) {
                return event;
            }
        }
        assert!(start.elapsed() < PATIENCE, "{what}: no such event");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

pub fn assert_in_order(states: &[ReceivedState]) {
    for pair in states.windows(2) {
        assert!(pair[0].state.tick < pair[1].state.tick);
    }
    for received in states {
        assert_eq!(received.state, state(received.state.tick));
        assert_eq!(Ok(received.state_hash), received.state.hash());
    }
}

/// Why a client is not let in.
pub async fn error_of(options: ClientOptions) -> LinkError {
    match connect(options).await {
        Err(error) => error,
        Ok(_) => panic!("let in"),
    }
}

/// Why it is not served.
pub async fn not_served(options: ServerOptions, content: Content) -> LinkError {
    match serve(options, content).await {
        Err(error) => error,
        Ok(_) => panic!("served"),
    }
}

/// A runtime that a test can end before the others.
pub fn runtime() -> Runtime {
    must(
        tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build(),
    )
}

pub fn thread(name: &str, body: impl FnOnce() + Send + 'static) -> JoinHandle<()> {
    must(
        std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(body),
    )
}
