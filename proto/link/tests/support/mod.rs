//! A small scene, states, and a server on free ports of 127.0.0.1.

mod raw;
mod states;
mod threads;

pub use raw::*;
pub use states::*;
use std::{
    net::SocketAddr,
    time::{Duration, Instant},
};
use taut_link::{
    ClientLink, ClientOptions, ClientStatus, ClusterKey, Content, LinkError, LinkEvent, Role,
    ServerLink, ServerOptions, Transport, connect, serve,
};
use taut_proto::{
    HotState, InputSample, MeshBlob, MeshHash, PoseF64, SceneDescription,
    control::RefusalCode,
    mesh_blob::Positions,
    scene::{BodyDescription, NodeDescription, ScreenDescription, Stereo, WindowDescription},
};
use taut_test_kit::relay::{Direction, Impairment, Relay, Treatment, Waiting};
pub use threads::*;

/// Only a hang takes this long; every wait ends as soon as its condition holds.
pub const PATIENCE: Duration = Duration::from_secs(60);

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

pub async fn join(options: ClientOptions) -> ClientLink {
    must(connect(options).await)
}

pub async fn client(server: &ServerLink, role: Role, node: &str) -> ClientLink {
    join(options(server, role, node)).await
}

/// A render node, with this transport.
pub async fn node_over(transport: Transport, server: &ServerLink, node: &str) -> ClientLink {
    join(ClientOptions {
        transport,
        ..options(server, Role::Render, node)
    })
    .await
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

/// Asks until there is an answer.
pub async fn wait_for<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(start.elapsed() < PATIENCE, "{what}: did not happen in time");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

pub async fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    wait_for(what, || done().then_some(())).await;
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

pub async fn event(
    server: &ServerLink,
    what: &str,
    mut wanted: impl FnMut(&LinkEvent) -> bool,
) -> LinkEvent {
    wait_for(what, || {
        std::iter::from_fn(|| server.try_event()).find(&mut wanted)
    })
    .await
}

/// Why a client is not let in.
pub async fn error_of(options: ClientOptions) -> LinkError {
    match connect(options).await {
        Err(error) => error,
        Ok(_) => panic!("let in"),
    }
}

/// With which code and words a client is refused.
pub async fn refusal_of(options: ClientOptions) -> (RefusalCode, String) {
    match error_of(options).await {
        LinkError::Refused { code, text, .. } => (code, text.raw().to_owned()),
        other => panic!("{other}"),
    }
}

/// Why it is not served.
pub async fn not_served(options: ServerOptions, content: Content) -> LinkError {
    match serve(options, content).await {
        Err(error) => error,
        Ok(_) => panic!("served"),
    }
}
