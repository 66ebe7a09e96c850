//! A real server on this machine for nodes to join, with a scene and states.

use crate::support;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use taut_link::{Content, ServerLink, ServerOptions, create_key_file, serve};
use taut_proto::barrier::{MasterSettings, Swap};
use taut_proto::mesh_blob::Positions;
use taut_proto::scene::{
    BodyDescription, NodeDescription, ScreenDescription, Stereo, WindowDescription,
};
use taut_proto::state::ToolState;
use taut_proto::{HotState, MeshBlob, MeshHash, PoseF32, PoseF64, SceneDescription};
use taut_render::cli::{RenderArgs, TransportArg};
use taut_render::renderer::{Gpu, shapes};
use taut_render::stage::TriangleMesh;
use taut_render::{MembershipArgs, RenderError, RenderReport};

/// A server that sends 500 states per second until it is stopped.
pub struct Server {
    pub runtime: tokio::runtime::Runtime,
    pub link: ServerLink,
    pub address: String,
    pub folder: tempfile::TempDir,
    pub stop: Arc<AtomicBool>,
    sender: Option<JoinHandle<()>>,
    leader: Option<JoinHandle<()>>,
}

/// 60 frames a second; a node may take a second for one.
pub fn barrier(swap: Swap) -> MasterSettings {
    MasterSettings {
        swap,
        period_ns: 16_666_667,
        slowest_ns: 1_000_000_000,
    }
}

fn blob(mesh: &TriangleMesh) -> MeshBlob {
    let positions = Positions::F32(mesh.vertices.clone());
    MeshBlob::new(positions, mesh.triangles.clone(), None).expect("a sound mesh")
}

fn pose(position: [f64; 3]) -> PoseF64 {
    PoseF64 {
        position,
        rotation: [1.0, 0.0, 0.0, 0.0],
    }
}

pub fn content() -> Content {
    let meshes = [
        shapes::cylinder(0.01, 0.03, 72),
        support::box_with_hole(0.03, 0.0102, 72),
    ];
    let meshes = meshes.map(|mesh| blob(&mesh));
    let hash = |mesh: &MeshBlob| MeshHash::of(&mesh.encode().expect("small"));
    let body = |name: &str, mesh, [red, green, blue]: [f32; 3]| BodyDescription {
        name: name.into(),
        mesh: hash(mesh),
        pose: pose([0.0; 3]),
        colour: [red, green, blue, 1.0],
    };
    let screen = |name: &str, lower_left, lower_right, upper_left| ScreenDescription {
        name: name.into(),
        lower_left,
        lower_right,
        upper_left,
        output: Default::default(),
    };
    let node = |name: &str, screens: &[&str], stereo| NodeDescription {
        name: name.into(),
        screens: screens.iter().map(|s| (*s).into()).collect(),
        stereo,
        monitors: Vec::new(),
        window: WindowDescription {
            width: 640,
            height: 480,
            fullscreen: false,
        },
    };
    let description = SceneDescription {
        obstacles: vec![body("box", &meshes[1], support::GREY_BLUE)],
        scene_origin: pose([0.0, -0.28, 0.22]),
        display_scale: 7.0,
        screens: vec![
            screen("wall", [-0.9, 0.0, 0.0], [0.9, 0.0, 0.0], [-0.9, 0.0, 1.2]),
            screen(
                "again",
                [-0.9, -1.2, 0.0],
                [0.9, -1.2, 0.0],
                [-0.9, 0.0, 0.0],
            ),
            screen(
                "table",
                [-0.9, -1.2, 0.0],
                [0.9, -1.2, 0.0],
                [-0.9, 0.0, 0.0],
            ),
        ],
        nodes: vec![
            node("both", &["wall", "table"], Stereo::Mono),
            node("pair", &["wall"], Stereo::TwoWindows),
            node("lost", &["ceiling"], Stereo::Mono),
            node("twice", &["table", "again"], Stereo::Mono),
        ],
        viewer: pose([0.12, -1.1, 0.85]),
        eye_separation: 0.065,
        ..SceneDescription::of_body("peg", body("peg", &meshes[0], support::ORANGE))
    };
    Content {
        description,
        meshes: meshes.to_vec(),
        textures: Vec::new(),
        panorama: None,
    }
}

impl Server {
    pub fn start() -> Self {
        Self::start_with(None)
    }

    /// With a barrier of frames, if `frames` says how they go.
    pub fn start_with(frames: Option<MasterSettings>) -> Self {
        Self::serving(frames, content())
    }

    pub fn serving(frames: Option<MasterSettings>, content: Content) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let key = create_key_file(&folder.path().join("key")).expect("a key");
        let runtime = tokio::runtime::Runtime::new().expect("a runtime");
        let options = ServerOptions {
            frames,
            ..ServerOptions::loopback(key)
        };
        let link = runtime.block_on(serve(options, content)).expect("serves");
        let stop = Arc::new(AtomicBool::new(false));
        let (mut broadcaster, clock) = (link.broadcaster(), link.clock());
        let stopped = Arc::clone(&stop);
        let send = move || {
            for tick in 1.. {
                if stopped.load(Ordering::Relaxed) {
                    return;
                }
                let mut state = HotState::empty();
                state.tick = tick;
                state.sample_time_ns = clock.now_ns();
                let mut tool = ToolState::default();
                tool.god_object = PoseF32 {
                    position: [0.0, -0.05 + 1e-5 * (tick % 1000) as f32, 0.0],
                    ..PoseF32::IDENTITY
                };
                tool.device = tool.god_object;
                state.tools.push(tool);
                broadcaster.send(&state);
                std::thread::sleep(Duration::from_millis(2));
            }
        };
        let sender = std::thread::Builder::new()
            .name("sender".to_owned())
            .spawn(send);
        let leader = link.frame_master().map(|mut master| {
            let stopped = Arc::clone(&stop);
            let lead = move || master.run(&|| stopped.load(Ordering::Relaxed));
            let leader = std::thread::Builder::new().name("frames".to_owned());
            leader.spawn(lead).expect("a thread")
        });
        Self {
            address: link.quic_addr().to_string(),
            runtime,
            link,
            folder,
            stop,
            sender: Some(sender.expect("a thread")),
            leader,
        }
    }

    pub fn args(&self, node: &str) -> RenderArgs {
        RenderArgs {
            server: self.address.clone(),
            node: node.to_owned(),
            key: self.folder.path().join("key"),
            transport: TransportArg::Udp,
            headless: true,
            hold: false,
            frames: None,
            out: None,
            duration: Some(120.0), // so that a failure ends: longer than anything is waited for
            fps: Some(20.0),
            samples: None,
            show: None,
            stereo: None,
            width: Some(120),
            height: None,
            monitor: Vec::new(),
            fullscreen: false,
            gpu: None,
            hud: false,
            screens: None,
            display_ms: 8.0,
            delay_ms: 2.0,
            membership: MembershipArgs {
                no_mesh_cache: true,
                ..MembershipArgs::default()
            },
        }
    }

    /// Frames that this node has reported.
    pub fn frames(&self, node: &str) -> u64 {
        let clients = self.link.clients();
        let status = clients.iter().find(|status| status.node == node);
        let stats = status.and_then(|status| status.stats.as_ref());
        stats.map_or(0, |stats| stats.frames)
    }

    pub fn pictures(&self) -> PathBuf {
        self.folder.path().join("pictures")
    }

    /// One that a node has written there.
    pub fn picture(&self, file: &str) -> image::RgbaImage {
        let picture = image::open(self.pictures().join(file));
        picture
            .unwrap_or_else(|error| panic!("{file}: {error}"))
            .to_rgba8()
    }

    pub fn stop(mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(sender) = self.sender.take() {
            sender.join().expect("the sender ends");
        }
        if let Some(leader) = self.leader.take() {
            leader.join().expect("the leader ends");
        }
        self.runtime.block_on(self.link.shutdown());
    }
}

/// Runs a node on a thread of its own.
pub fn start(args: RenderArgs) -> JoinHandle<Result<RenderReport, RenderError>> {
    let run = move || taut_render::run(args);
    std::thread::Builder::new()
        .name("node".to_owned())
        .spawn(run)
        .expect("a thread")
}

/// Whether pictures can be drawn here; says so if not.
pub fn can_draw() -> bool {
    match Gpu::open() {
        Ok(_) => true,
        Err(error) => {
            taut_test_kit::left_out(error);
            false
        }
    }
}

pub fn wait_for(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < Duration::from_secs(60), "never: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}
