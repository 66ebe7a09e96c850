//! A small server and clients of it, for measuring.

use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::time::{Duration, Instant};

use taut_link::{
    ClientLink, ClientOptions, ClusterKey, Content, LinkError, Role, ServerLink, ServerOptions,
    connect, serve,
};
use taut_proto::{
    HotState, InputSample, MeshBlob, MeshHash, PoseF32, PoseF64, SceneDescription,
    mesh_blob::Positions,
    scene::BodyDescription,
    state::{BodyState, ContactState, MAX_BODIES, MAX_CONTACTS, RunState, ToolState},
};
use tokio::runtime::Runtime;

use crate::relay::{Relay, Treatment, Waiting};

/// Silence and joining time that a busy machine is forgiven.
const FORGIVING: Duration = Duration::from_secs(10);

/// Why something could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The system gives no random bytes for a key.
    #[error(transparent)]
    Key(#[from] taut_proto::key::KeyError),
    /// The relay failed.
    #[error(transparent)]
    Relay(#[from] crate::relay::RelayError),
    /// The system failed.
    #[error(transparent)]
    System(#[from] std::io::Error),
    /// Something that was waited for did not happen, or a program is not there.
    #[error("{0}")]
    Missing(String),
}

impl BenchError {
    /// For what has no kind of its own.
    pub(crate) fn missing(what: impl std::fmt::Display) -> BenchError {
        BenchError::Missing(what.to_string())
    }
}

/// A server on free ports of 127.0.0.1 that forgives a busy machine.
pub fn server_options(key: &ClusterKey) -> ServerOptions {
    ServerOptions {
        idle_timeout: FORGIVING,
        node_timeout: FORGIVING,
        ..ServerOptions::loopback(key.clone())
    }
}

/// A client of `server` that forgives a busy machine.
pub fn client_options(
    server: &ServerLink,
    key: &ClusterKey,
    role: Role,
    node: &str,
) -> ClientOptions {
    ClientOptions {
        idle_timeout: FORGIVING,
        connect_timeout: FORGIVING,
        ..ClientOptions::new(server.quic_addr().to_string(), key.clone(), role, node)
    }
}

/// A client of `server` that has joined.
pub(crate) fn enter(
    runtime: &Runtime,
    server: &ServerLink,
    key: &ClusterKey,
    role: Role,
    node: &str,
) -> Result<ClientLink, LinkError> {
    runtime.block_on(connect(client_options(server, key, role, node)))
}

/// A server of one triangle behind a relay: clients are told to send their datagrams to the relay.
pub fn serve_behind(
    runtime: &Runtime,
    mut options: ServerOptions,
    treatments: Vec<Treatment>,
    seed: u64,
) -> Result<(ServerLink, Relay), BenchError> {
    let waiting = Waiting::bind()?;
    options.announced_udp_port = Some(waiting.address().port());
    let server = runtime.block_on(serve(options, small_content()))?;
    let relay = waiting.start(server.udp_addr(), treatments, seed)?;
    Ok((server, relay))
}

/// A device's reading of this number, at rest and without force.
pub fn reading(index: u64) -> InputSample {
    InputSample {
        sample_time_ns: 0,
        clock_uncertainty_ns: 0,
        index,
        pose: PoseF64::IDENTITY,
        velocity: [0.0; 6],
        buttons: 0,
        flags: 0,
        rendered: [0.0; 6],
        set_made_ns: 0,
    }
}

/// A scene of one triangle.
pub fn small_content() -> Content {
    content_with(1)
}

/// A scene of one mesh with this many triangles, 36 bytes each in single precision.
pub fn content_with(triangles: u32) -> Content {
    let positions = (0..triangles + 2)
        .map(|i| [i as f32 * 1e-3, (i % 2) as f32 * 1e-3, 0.0])
        .collect();
    let triangles = (0..triangles).map(|i| [i, i + 1, i + 2]).collect();
    let mesh = MeshBlob::new(Positions::F32(positions), triangles, None)
        .unwrap_or_else(|error| panic!("{error}"));
    let bytes = mesh.encode().unwrap_or_else(|error| panic!("{error}"));
    let body = BodyDescription {
        name: "body".into(),
        mesh: MeshHash::of(&bytes),
        pose: PoseF64::IDENTITY,
        colour: [1.0, 0.5, 0.1, 1.0],
    };
    Content {
        description: SceneDescription::of_body("bench", body),
        meshes: vec![mesh],
        textures: Vec::new(),
        panorama: None,
    }
}

/// A state of `tick`, sampled at `sample_time_ns`; `full` has everything that a state may hold but the events, else one tool.
pub fn state(tick: u64, sample_time_ns: u64, full: bool) -> HotState {
    let mut state = HotState {
        tick,
        sample_time_ns,
        scene_revision: 1,
        run: RunState::Running,
        ..HotState::empty()
    };
    let tool = ToolState {
        god_object: PoseF32 {
            position: [tick as f32 * 1e-6, 0.0, 0.1],
            ..PoseF32::IDENTITY
        },
        force: [0.0, 1.5, tick as f32 * 1e-3],
        ..ToolState::default()
    };
    state.tools.push(tool);
    if full {
        state.tools.push(tool);
        let bodies = 0..MAX_BODIES as u16;
        state.bodies = bodies
            .map(|id| BodyState {
                id,
                flags: 0,
                pose: PoseF32::IDENTITY,
            })
            .collect();
        let contacts = 0..MAX_CONTACTS as u16;
        state.contacts = contacts
            .map(|id| ContactState {
                pair: [0, id],
                point: [0.1; 3],
                normal: [0.0, 0.0, 1.0],
                force: 1.0,
                gap: 1e-3,
            })
            .collect();
    }
    state
}

/// A group that nobody else speaks to, and a port of `interface` that is free.
pub(crate) fn free_group(interface: Ipv4Addr) -> Result<SocketAddrV4, BenchError> {
    let port = UdpSocket::bind((interface, 0))?.local_addr()?.port();
    let [high, low] = port.to_be_bytes();
    Ok(SocketAddrV4::new(Ipv4Addr::new(239, 255, high, low), port))
}

/// Clients whose datagrams have opened a path.
pub(crate) fn paths(server: &ServerLink) -> usize {
    let clients = server.clients().into_iter();
    clients
        .filter(|client| client.udp_address.is_some())
        .count()
}

/// Waits for a condition.
pub fn wait_until(what: &str, mut done: impl FnMut() -> bool) -> Result<(), BenchError> {
    let start = Instant::now();
    while !done() {
        if start.elapsed() > Duration::from_secs(60) {
            return Err(BenchError::Missing(format!("{what}: not within 60 s")));
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    Ok(())
}
