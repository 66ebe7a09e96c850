//! A server on this machine that renders a wall, and a bridge's way to it.

#[cfg(unix)]
pub mod faulty;
pub mod floor;
#[cfg(unix)]
pub mod stage;

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use nalgebra::Vector6;
use taut_bridge::{BridgeArgs, DEFAULT_MAX_AGE, Device, DeviceLimits, RemoteDevice};
use taut_link::proto::mesh_blob::Positions;
use taut_link::proto::scene::BodyDescription;
use taut_link::proto::{MeshBlob, MeshHash, PoseF64, SceneDescription};
use taut_link::{Content, ServerLink, ServerOptions, create_key_file, read_key_file, serve};
use tempfile::TempDir;

/// Of the wall z < 0 that the server renders, in N/m.
pub const STIFFNESS: f64 = 500.0;

/// Only a hang takes this long.
pub const PATIENCE: Duration = Duration::from_secs(60);

pub const fn ms(time: u64) -> Duration {
    Duration::from_millis(time)
}

pub fn wait_until(what: &str, done: impl Fn() -> bool) {
    let begun = Instant::now();
    while !done() {
        assert!(begun.elapsed() < PATIENCE, "{what}");
        thread::sleep(ms(1));
    }
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
                name: "tip".into(),
                mesh: hash,
                pose: start,
                colour: [1.0; 4],
            },
        ),
        meshes: vec![mesh],
        textures: Vec::new(),
        panorama: None,
    }
}

/// What the server's haptics loop saw.
#[derive(Default)]
pub struct Seen {
    pub good: u64,
    pub lowest_z: f64,
    pub first_z: Option<f64>,
}

/// A server with a haptics loop that renders the wall.
pub struct Workbench {
    pub folder: TempDir,
    runtime: tokio::runtime::Runtime,
    pub link: Option<ServerLink>,
    stop: Arc<AtomicBool>,
    haptics: Option<JoinHandle<Seen>>,
    rest: Arc<Rest>,
}

/// How long the hand has stayed where it is.
#[derive(Default)]
struct Rest {
    /// Height from which it has moved by no more than [`Rest::STILL`], m, as bits.
    height: AtomicU64,
    /// Readings since.
    readings: AtomicU64,
}

impl Rest {
    /// m.
    const STILL: f64 = 1e-4;

    fn note(&self, z: f64) {
        let height = f64::from_bits(self.height.load(Ordering::Relaxed));
        if (z - height).abs() <= Self::STILL {
            self.readings.fetch_add(1, Ordering::Relaxed);
        } else {
            self.height.store(z.to_bits(), Ordering::Relaxed);
            self.readings.store(0, Ordering::Relaxed);
        }
    }
}

impl Workbench {
    pub fn start() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let key = create_key_file(&folder.path().join("key")).expect("a key");
        let runtime = tokio::runtime::Runtime::new().expect("a runtime");
        let link = runtime
            .block_on(serve(ServerOptions::loopback(key), content()))
            .expect("a server");
        let stop = Arc::new(AtomicBool::new(false));
        let rest = Arc::default();
        let haptics = Some(spawn_haptics(&link, Arc::clone(&stop), Arc::clone(&rest)));
        Self {
            folder,
            runtime,
            link: Some(link),
            stop,
            haptics,
            rest,
        }
    }

    pub fn args(&self, more: &[&str]) -> BridgeArgs {
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
        BridgeArgs::of_words(fixed.iter().chain(more)).expect("valid")
    }

    pub fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        let mut file = std::fs::File::create(&path).expect("a file");
        file.write_all(text.as_bytes()).expect("written");
        path
    }

    /// Another server with the same key at the same address, after this one has stopped.
    pub fn restart(&mut self) {
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
        let (stop, rest) = (Arc::clone(&self.stop), Arc::clone(&self.rest));
        self.haptics = Some(spawn_haptics(&link, stop, rest));
        self.link = Some(link);
    }

    /// Waits until the server has taken `count` device readings.
    pub fn wait_for_inputs(&self, count: u64) {
        let link = self.link.as_ref().expect("running");
        wait_until("no device readings arrive", || {
            link.counters().inputs >= count
        });
    }

    /// Waits until the hand has rested within `heights` (m) for `readings` in a row.
    pub fn wait_for_rest(&self, heights: std::ops::Range<f64>, readings: u64) {
        let begun = Instant::now();
        loop {
            let rested = self.rest.readings.load(Ordering::Relaxed);
            let height = f64::from_bits(self.rest.height.load(Ordering::Relaxed));
            if rested >= readings && heights.contains(&height) {
                return;
            }
            assert!(
                begun.elapsed() < PATIENCE,
                "the hand does not rest: {height} m for {rested} readings"
            );
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// Stops the server as on Ctrl-C.
    pub fn shut_down(&mut self) {
        if let Some(link) = self.link.take() {
            self.runtime.block_on(link.shutdown());
        }
    }

    /// The server is gone without a word, as when its cable is pulled.
    pub fn vanish(&mut self) {
        let link = self.link.take().expect("running");
        let empty = tokio::runtime::Builder::new_current_thread()
            .build()
            .expect("a runtime");
        std::mem::replace(&mut self.runtime, empty).shutdown_timeout(Duration::from_secs(1));
        drop(link); // nothing is left that could send its farewell
    }

    pub fn finish(mut self) -> Seen {
        self.stop.store(true, Ordering::Relaxed);
        let haptics = self.haptics.take().expect("started");
        let seen = haptics.join().expect("the haptics loop ends");
        self.shut_down();
        seen
    }
}

fn spawn_haptics(link: &ServerLink, stop: Arc<AtomicBool>, rest: Arc<Rest>) -> JoinHandle<Seen> {
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
                rest.note(z);
                wrench.z = STIFFNESS * (-z).max(0.0);
                device.comes_from(Some(sample.time), 0.0);
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
