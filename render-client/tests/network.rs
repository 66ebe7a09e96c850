//! A node in a session with a real server on this machine: joins, fetches, draws, reports, ends.
//! Left out, said aloud, without a graphics adapter.

use crate::support;

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};
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
use taut_proto::{HotState, MeshBlob, MeshHash, Panorama, PoseF32, PoseF64, SceneDescription};
use taut_render::cli::{RenderArgs, TransportArg};
use taut_render::renderer::{Gpu, shapes};
use taut_render::stage::TriangleMesh;
use taut_render::statistics::Ended;
use taut_render::{MembershipArgs, RenderError, RenderReport};

/// A server that sends 500 states per second until it is stopped.
struct Server {
    runtime: tokio::runtime::Runtime,
    link: ServerLink,
    address: String,
    folder: tempfile::TempDir,
    stop: Arc<AtomicBool>,
    sender: Option<JoinHandle<()>>,
    leader: Option<JoinHandle<()>>,
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

fn content() -> Content {
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
        panorama: None,
    }
}

impl Server {
    fn start() -> Self {
        Self::start_with(None)
    }

    /// With a barrier of frames, if `frames` says how they go.
    fn start_with(frames: Option<MasterSettings>) -> Self {
        Self::serving(frames, content())
    }

    fn serving(frames: Option<MasterSettings>, content: Content) -> Self {
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

    fn args(&self, node: &str) -> RenderArgs {
        RenderArgs {
            server: self.address.clone(),
            node: node.to_owned(),
            key: self.folder.path().join("key"),
            transport: TransportArg::Udp,
            headless: true,
            hold: false,
            frames: None,
            out: None,
            duration: Some(20.0), // so that a failure ends
            fps: Some(20.0),
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

    fn pictures(&self) -> PathBuf {
        self.folder.path().join("pictures")
    }

    fn stop(mut self) {
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
fn start(args: RenderArgs) -> JoinHandle<Result<RenderReport, RenderError>> {
    let run = move || taut_render::run(args);
    std::thread::Builder::new()
        .name("node".to_owned())
        .spawn(run)
        .expect("a thread")
}

/// Whether pictures can be drawn here; says so if not.
fn can_draw() -> bool {
    match Gpu::open() {
        Ok(_) => true,
        Err(error) => {
            taut_test_kit::left_out(error);
            false
        }
    }
}

fn wait_for(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < Duration::from_secs(60), "never: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_node_draws_what_it_is_told_over_either_transport_and_reports_it() {
    if !can_draw() {
        return;
    }
    for transport in [TransportArg::Udp, TransportArg::Quic] {
        let server = Server::start();
        let mut args = server.args("both");
        args.transport = transport;
        args.frames = Some(5);
        args.out = Some(server.pictures());
        let report = taut_render::run(args).expect("draws");
        assert_eq!((report.frames, report.ended), (5, Ended::Frames));
        assert_eq!(report.pose_age_ms.count, 5);
        assert!(report.drawn_age_ms.p50 >= report.pose_age_ms.p50);
        assert!(
            report.pose_age_ms.p50 >= 2.0,
            "the delay is part of the age"
        );
        assert!(report.packets_received > 0);

        for screen in ["wall", "table"] {
            for frame in 1..=5 {
                let path = server
                    .pictures()
                    .join(format!("both-{screen}-{frame:05}.png"));
                let picture = image::open(&path).expect("a picture").to_rgba8();
                assert_eq!(picture.dimensions(), (120, 80));
            }
        }
        // The peg points at the viewer: orange on the table's screen.
        let path = server.pictures().join("both-table-00005.png");
        let picture = image::open(path).expect("a picture").to_rgba8();
        let orange = picture
            .pixels()
            .filter(|p| p.0[0] > 90 && p.0[0] / 2 > p.0[2])
            .count();
        assert!(orange > 30, "{orange} orange pixels");
        server.stop();
    }
}

#[test]
fn a_node_draws_in_the_light_that_the_server_names() {
    if !can_draw() {
        return;
    }
    let redness = |light: Option<Panorama>| {
        let mut content = content();
        let hash = |light: &Panorama| MeshHash::of(&light.encode());
        content.description.environment = light.as_ref().map(hash);
        content.panorama = light;
        let server = Server::serving(None, content);
        let mut args = server.args("both");
        (args.frames, args.out) = (Some(1), Some(server.pictures()));
        taut_render::run(args).expect("draws");
        let path = server.pictures().join("both-table-00001.png");
        let picture = image::open(path).expect("a picture").to_rgba8();
        let sum = |part: usize| -> f64 { picture.pixels().map(|p| f64::from(p.0[part])).sum() };
        server.stop();
        sum(0) / sum(2)
    };
    let (studio, red) = (
        redness(None),
        redness(Some(Panorama::from_fn(|_, _| [1.0, 0.1, 0.02]))),
    );
    assert!(red > 1.3 * studio, "{red} {studio}");
}

#[test]
fn a_node_with_two_pictures_per_screen_names_them_by_eye() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let mut args = server.args("pair");
    args.frames = Some(1);
    args.out = Some(server.pictures());
    taut_render::run(args).expect("draws");
    for eye in ["left", "right"] {
        assert!(
            server
                .pictures()
                .join(format!("pair-wall-{eye}-00001.png"))
                .is_file()
        );
    }
    server.stop();
}

#[test]
fn a_node_ends_in_good_order_when_the_server_says_that_it_stops() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let node = start(server.args("both"));
    wait_for("a report of frames", || {
        let clients = server.link.clients();
        clients
            .iter()
            .any(|c| c.stats.as_ref().is_some_and(|stats| stats.frames > 0))
    });
    let mismatches: u64 = server
        .link
        .clients()
        .iter()
        .map(|c| c.state_hash_mismatches)
        .sum();
    let matches: u64 = server
        .link
        .clients()
        .iter()
        .map(|c| c.state_hash_matches)
        .sum();
    assert_eq!(mismatches, 0);
    assert!(matches > 0, "the states drawn are those that were sent");
    server.stop();
    let report = node.join().expect("no panic").expect("a good end");
    assert_eq!(report.ended, Ended::ServerStopped);
}

/// One node with two screens, one with two pictures of a screen: each is one member, and all frames show what was released for them.
#[test]
fn nodes_show_the_frames_that_the_barrier_releases() {
    if !can_draw() {
        return;
    }
    for swap in [Swap::Immediate, Swap::Scheduled] {
        let server = Server::start_with(Some(MasterSettings {
            swap,
            period_ns: 16_666_667,
            slowest_ns: 1_000_000_000,
        }));
        let nodes = ["both", "pair"].map(|node| {
            start(RenderArgs {
                fps: Some(8.0), // what software can do beside other tests: everybody's rate, because the slowest's is
                ..server.args(node)
            })
        });
        let frames = || server.link.frame_report().unwrap_or_default();
        wait_for("frames that both nodes showed in time", || {
            frames().skew.count >= 3
        });
        let measured = frames();
        assert_eq!(measured.counts.mismatches, 0, "{measured:?}");
        assert!(measured.counts.compared >= 6, "{measured:?}");
        assert_eq!(measured.nodes.len(), 2, "{measured:?}");
        server.stop();
        for node in nodes {
            let report = node.join().expect("no panic").expect("a good end");
            assert_eq!(report.ended, Ended::ServerStopped);
            assert!(report.locked_frames >= 3, "{report:?}");
            assert!(report.locked_frames <= report.frames);
        }
    }
}

/// Two screens at the same place: whatever moves between two frames, a node's pictures of one frame are the same to the last pixel.
#[test]
fn a_node_with_two_screens_shows_one_instant_on_both_with_a_barrier_and_without() {
    if !can_draw() {
        return;
    }
    let barrier = MasterSettings {
        swap: Swap::Immediate,
        period_ns: 16_666_667,
        slowest_ns: 1_000_000_000,
    };
    for frames in [Some(barrier), None] {
        let is_locked = frames.is_some();
        let server = Server::start_with(frames);
        let mut args = server.args("twice");
        args.fps = Some(8.0);
        args.frames = Some(12);
        args.out = Some(server.pictures());
        let report = taut_render::run(args).expect("draws");
        assert_eq!(report.locked_frames > 0, is_locked, "{report:?}");
        let mut distinct = std::collections::HashSet::new();
        for frame in 1..=12 {
            let [table, again] = ["table", "again"].map(|screen| {
                let file = format!("twice-{screen}-{frame:05}.png");
                let path = server.pictures().join(file);
                image::open(path).expect("a picture").to_rgba8().into_raw()
            });
            assert!(table == again, "frame {frame}");
            distinct.insert(table);
        }
        assert!(distinct.len() > 3, "the body moves: {}", distinct.len());
        server.stop();
    }
}

#[test]
fn a_server_that_stays_lost_is_an_error_that_names_it() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let address = server.address.clone();
    let mut args = server.args("both");
    args.membership.give_up = Some(1.0);
    let node = start(args);
    wait_for("a client", || !server.link.clients().is_empty());
    // All its threads stop at once, as if its machine had lost power.
    let Server {
        runtime,
        link,
        stop,
        ..
    } = server;
    stop.store(true, Ordering::Relaxed);
    runtime.shutdown_background();
    std::mem::forget(link);
    let error = node.join().expect("no panic").expect_err("lost");
    assert!(matches!(error, RenderError::ServerLost { .. }), "{error}");
    assert!(error.to_string().contains(&address));
    assert_eq!(error.exit_code(), 1);
}

#[test]
fn an_unknown_node_or_screen_is_bad_input_that_names_the_known_ones() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let error = taut_render::run(server.args("celing")).expect_err("unknown");
    assert!(error.to_string().contains("both, pair, lost"), "{error}");
    assert_eq!(error.exit_code(), 2);
    let error = taut_render::run(server.args("lost")).expect_err("no such screen");
    assert!(error.to_string().contains("ceiling"), "{error}");
    assert_eq!(error.exit_code(), 2);
    server.stop();
}

/// The program `taut-render` for a node of `server`.
fn program(server: &Server, node: &str, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut-render"));
    command.args([
        "--server",
        &server.address,
        "--node",
        node,
        "--duration",
        "20",
    ]);
    command
        .arg("--key")
        .arg(server.folder.path().join("key"))
        .args(more);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// A display to open windows on.
enum Display {
    /// That of the session.
    Session,
    /// One in memory, until it is dropped.
    InMemory {
        server: std::process::Child,
        name: String,
    },
}

impl Display {
    /// The session's display, or else one of Xvfb's; `None` where there is neither.
    fn any() -> Option<Self> {
        if std::env::var_os("DISPLAY").is_some() || std::env::var_os("WAYLAND_DISPLAY").is_some() {
            return Some(Self::Session);
        }
        let mut server = Command::new("Xvfb")
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1280x800x24",
                "-nolisten",
                "tcp",
            ])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let mut number = String::new();
        let output = server.stdout.as_mut().expect("a pipe");
        BufReader::new(output)
            .read_line(&mut number)
            .expect("a number");
        let name = format!(":{}", number.trim());
        Some(Self::InMemory { server, name })
    }

    fn give_to(&self, command: &mut Command) {
        if let Self::InMemory { name, .. } = self {
            command.env("DISPLAY", name);
        }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        if let Self::InMemory { server, .. } = self {
            server.kill().expect("it runs");
            server.wait().expect("it ends");
        }
    }
}

#[test]
fn the_program_draws_in_windows_where_there_is_a_display() {
    let Some(display) = Display::any() else {
        taut_test_kit::left_out("no display, and no Xvfb to make one");
        return;
    };
    if !can_draw() {
        return;
    }
    let server = Server::start();
    for (node, stereo) in [
        ("both", "mono"),
        ("pair", "two-windows"),
        ("both", "anaglyph"),
    ] {
        let more = [
            "--frames", "4", "--stereo", stereo, "--width", "300", "--show", "ghost",
        ];
        let mut command = program(&server, node, &more);
        display.give_to(&mut command);
        let output = command.output().expect("runs");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{text}");
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(said.contains("4 frames"), "{said}");
    }
    server.stop();
}

/// A Wayland compositor without a screen, until it is dropped.
struct Compositor {
    server: std::process::Child,
    folder: tempfile::TempDir,
}

impl Compositor {
    /// `None` where weston is not installed.
    fn start() -> Option<Self> {
        let folder = tempfile::tempdir().expect("a folder");
        let server = Command::new("weston")
            .args([
                "--backend=headless-backend.so",
                "--socket=light",
                "--no-config",
            ])
            .args(["--width=800", "--height=600", "--idle-time=0"])
            .env("XDG_RUNTIME_DIR", folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let compositor = Self { server, folder };
        let socket = compositor.folder.path().join("light");
        wait_for("the compositor's socket", || socket.exists());
        Some(compositor)
    }
}

impl Drop for Compositor {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_compositor_tells_when_the_pictures_of_a_node_lit_up() {
    let Some(compositor) = Compositor::start() else {
        taut_test_kit::left_out("no weston");
        return;
    };
    if !can_draw() {
        return;
    }
    let server = Server::start();
    for (node, frames) in [("both", "12"), ("pair", "12")] {
        let mut command = program(&server, node, &["--frames", frames, "--width", "200"]);
        command
            .env_remove("DISPLAY")
            .env("XDG_RUNTIME_DIR", compositor.folder.path())
            .env("WAYLAND_DISPLAY", "light");
        let output = command.output().expect("runs");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{text}");
        let said = String::from_utf8_lossy(&output.stdout);
        // weston's headless backend ticks by a timer, and says so.
        for part in [
            "told by the compositor (clock Monotonic",
            "timer",
            "; light ",
        ] {
            assert!(said.contains(part), "{part} in {said}");
        }
    }
    server.stop();
}

#[test]
fn without_a_display_the_program_says_so_and_names_the_way_out() {
    let server = Server::start();
    let mut command = program(&server, "both", &[]);
    command
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET");
    let output = command.output().expect("runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.contains("no display") && text.contains("--headless"),
        "{text}"
    );
    server.stop();
}

#[test]
fn without_a_graphics_driver_the_program_says_what_to_install() {
    let server = Server::start();
    let mut command = program(&server, "both", &["--headless"]);
    command
        .env("VK_DRIVER_FILES", "/dev/null")
        .env("VK_ICD_FILENAMES", "/dev/null");
    let output = command
        .env("WGPU_BACKEND", "vulkan")
        .output()
        .expect("runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("mesa-vulkan-drivers"), "{text}");
    server.stop();
}

#[cfg(unix)]
#[test]
fn a_node_that_is_asked_to_end_leaves_in_good_order() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let child = program(&server, "both", &["--headless", "--width", "60"])
        .spawn()
        .expect("runs");
    wait_for("a report of frames", || {
        let clients = server.link.clients();
        clients
            .iter()
            .any(|c| c.stats.as_ref().is_some_and(|stats| stats.frames > 0))
    });
    let asked = Command::new("kill")
        .args(["-TERM", &child.id().to_string()])
        .status();
    assert!(asked.is_ok_and(|status| status.success()));
    let output = child.wait_with_output().expect("ends");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    wait_for("the server knows", || server.link.clients().is_empty());
    server.stop();
}
