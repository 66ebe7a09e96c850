//! A bridge and a server on this machine: poses one way, wrenches the other, and what happens when one is lost.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use clap::Parser;
use nalgebra::Vector6;
use taut_bridge::{
    BridgeArgs, BridgeError, BridgeReport, DEFAULT_MAX_AGE, Device, DeviceLimits, RemoteDevice, run,
};
use taut_link::proto::mesh_blob::Positions;
use taut_link::proto::scene::BodyDescription;
use taut_link::proto::{MeshBlob, MeshHash, PoseF64, SceneDescription};
use taut_link::{Content, ServerLink, ServerOptions, create_key_file, read_key_file, serve};
use tempfile::TempDir;

/// Of the wall z < 0 that the server renders, in N/m.
const STIFFNESS: f64 = 500.0;

/// Time after which something is not slow but broken.
const PATIENCE: Duration = Duration::from_secs(30);

#[derive(Parser)]
struct Cli {
    #[command(flatten)]
    args: BridgeArgs,
}

fn content() -> Content {
    let corners = vec![
        [0.0; 3],
        [0.01, 0.0, 0.0],
        [0.0, 0.01, 0.0],
        [0.0, 0.0, 0.01],
    ];
    let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let mesh = MeshBlob::new(Positions::F64(corners), faces, None).expect("a tetrahedron");
    let hash = MeshHash::of(&mesh.encode().expect("encodes"));
    let start = PoseF64 {
        position: [0.0, 0.0, 0.05],
        ..PoseF64::IDENTITY
    };
    Content {
        description: SceneDescription::of_body(
            "wall",
            BodyDescription {
                name: "tip".to_owned(),
                mesh: hash,
                pose: start,
                colour: [1.0; 4],
            },
        ),
        meshes: vec![mesh],
    }
}

/// What the server's haptics loop saw.
#[derive(Default)]
struct Seen {
    good: u64,
    lowest_z: f64,
    first_z: Option<f64>,
    /// Heights of the hand, m, one per reading.
    heights: Vec<f64>,
}

impl Seen {
    /// The middle one of the heights in the last third of the readings, m.
    fn rest(&self) -> f64 {
        let mut last = self.heights[self.heights.len() * 2 / 3..].to_vec();
        last.sort_by(f64::total_cmp);
        last[last.len() / 2]
    }
}

/// A server with a haptics loop that renders the wall.
struct Workbench {
    folder: TempDir,
    runtime: tokio::runtime::Runtime,
    link: Option<ServerLink>,
    stop: Arc<AtomicBool>,
    haptics: Option<JoinHandle<Seen>>,
}

impl Workbench {
    fn start() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let key = create_key_file(&folder.path().join("key")).expect("a key");
        let runtime = tokio::runtime::Runtime::new().expect("a runtime");
        let link = runtime
            .block_on(serve(ServerOptions::loopback(key), content()))
            .expect("a server");
        let stop = Arc::new(AtomicBool::new(false));
        let haptics = Some(spawn_haptics(&link, Arc::clone(&stop)));
        Self {
            folder,
            runtime,
            link: Some(link),
            stop,
            haptics,
        }
    }

    fn args(&self, more: &[&str]) -> BridgeArgs {
        let address = self.link.as_ref().expect("running").quic_addr().to_string();
        let key = self.folder.path().join("key");
        let key = key.to_str().expect("a plain path");
        let fixed = [
            "bridge",
            "--server",
            &address,
            "--key",
            key,
            "--priority",
            "0",
        ];
        Cli::try_parse_from(fixed.iter().chain(more))
            .expect("valid")
            .args
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        let mut file = std::fs::File::create(&path).expect("a file");
        file.write_all(text.as_bytes()).expect("written");
        path
    }

    /// Another server with the same key at the same address, after this one has stopped.
    fn restart(&mut self) {
        let key = read_key_file(&self.folder.path().join("key")).expect("the key");
        let quic = self.link.as_ref().expect("running").quic_addr();
        self.shut_down();
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.haptics.take().expect("started").join();

        let options = ServerOptions {
            quic,
            ..ServerOptions::loopback(key)
        };
        let link = self
            .runtime
            .block_on(serve(options, content()))
            .expect("the port is free again");
        self.stop = Arc::new(AtomicBool::new(false));
        self.haptics = Some(spawn_haptics(&link, Arc::clone(&self.stop)));
        self.link = Some(link);
    }

    /// Waits until the server has taken `count` device readings.
    fn wait_for_inputs(&self, count: u64) {
        let link = self.link.as_ref().expect("running");
        let begun = Instant::now();
        while link.counters().inputs < count {
            assert!(begun.elapsed() < PATIENCE, "no device readings arrive");
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// Stops the server as on Ctrl-C.
    fn shut_down(&mut self) {
        if let Some(link) = self.link.take() {
            self.runtime.block_on(link.shutdown());
        }
    }

    /// The server is gone without a word, as when its cable is pulled.
    fn vanish(&mut self) {
        let link = self.link.take().expect("running");
        let empty = tokio::runtime::Builder::new_current_thread()
            .build()
            .expect("a runtime");
        std::mem::replace(&mut self.runtime, empty).shutdown_timeout(Duration::from_secs(1));
        drop(link); // nothing is left that could send its farewell
    }

    fn finish(mut self) -> Seen {
        self.stop.store(true, Ordering::Relaxed);
        let haptics = self.haptics.take().expect("started");
        let seen = haptics.join().expect("the haptics loop ends");
        self.shut_down();
        seen
    }
}

fn spawn_haptics(link: &ServerLink, stop: Arc<AtomicBool>) -> JoinHandle<Seen> {
    let inputs = link.device_inputs().expect("first to ask");
    let (clock, mut broadcaster) = (link.clock(), link.broadcaster());
    let (mut device, mut commands) =
        RemoteDevice::new(inputs, DeviceLimits::UNLIMITED, DEFAULT_MAX_AGE);
    let body = move || {
        let mut seen = Seen::default();
        while !stop.load(Ordering::Relaxed) {
            thread::sleep(Duration::from_millis(1));
            let now = Duration::from_nanos(clock.now_ns());
            let mut wrench = Vector6::zeros();
            if let Ok(sample) = device.read(now) {
                let z = sample.pose.translation.vector.z;
                seen.good += 1;
                seen.first_z.get_or_insert(z);
                seen.lowest_z = seen.lowest_z.min(z);
                seen.heights.push(z);
                wrench.z = STIFFNESS * (-z).max(0.0);
                device.comes_from(Some(sample.time));
            }
            device.write(now, &wrench);
            let _ = broadcaster.send_wrench(commands.read());
        }
        seen
    };
    thread::Builder::new()
        .name("haptics".to_owned())
        .spawn(body)
        .expect("a thread")
}

const REACH: &str = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.05,1,0,0,0\n0.7,0,0,-0.02,1,0,0,0\n";

#[test]
fn poses_arrive_and_the_wall_pushes_the_far_hand_back() {
    let workbench = Workbench::start();
    let path = workbench.file("reach.csv", REACH);
    let path = path.to_str().expect("a plain path");
    let args = workbench.args(&["--hand", "firm", "--path", path, "--duration", "2.5"]);
    let report = run(&args).expect("a whole run");
    let seen = workbench.finish();
    assert!(seen.good > 200, "{} readings", seen.good);
    assert!(seen.first_z.is_some_and(|z| z > 0.04), "{:?}", seen.first_z);
    // Firm hand against the wall: 500 (0.02 - d) = 500 d, so 10 mm and 5 N. Where no force arrives it rests at 20 mm.
    let rest = seen.rest();
    assert!(rest < -0.0095 && rest > -0.0105, "{rest} m, {report}");
    // On a machine so busy that commands stop for 20 ms the force fades. Let go at once, the hand (with the grip 0.8 kg, 12 N s/m)
    // swings past its intention by 0.37 of the 10 mm.
    assert!(seen.lowest_z > -0.0245, "{} m, {report}", seen.lowest_z);
    assert!(
        report.max_force_n > 3.0 && report.max_force_n < 12.0,
        "{report}"
    );

    assert_eq!((report.ended.as_str(), report.sessions), ("done", 1));
    assert!(report.ticks > 500 && report.wrenches > 100, "{report}");
    assert!(report.packets_sent > report.ticks / 2 && report.packets_received >= report.wrenches);
    assert!(report.period_us.is_some() && report.round_trip_us.is_some());
    assert_eq!(report.faulty_ticks, 0);
    let json = serde_json::to_value(&report).expect("a report is JSON");
    assert!(json["period_us"]["p99"].is_u64() && json["energy_injected_j"].is_f64());
}

#[test]
fn a_trace_is_replayed_to_its_end() {
    let workbench = Workbench::start();
    let trace = workbench.file("trace.csv", REACH);
    let device = format!("trace:{}", trace.display());
    let report = run(&workbench.args(&["--device", &device, "--duration", "20"])).expect("a run");
    let seen = workbench.finish();
    assert_eq!(report.ended, "the trace ended");
    assert!(
        report.duration_s >= 0.69 && report.duration_s < 10.0,
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
