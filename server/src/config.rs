//! From the workbench file to what a session is made of.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use taut_bridge::{InputChoice, SafetySettings};
use taut_link::ClusterKey;
use taut_recording::{FORMAT, Lost, Manifest, SceneOrigin, identity_of};
use taut_scene::{BuiltScene, HeadTracking, Monitoring, RealTimeMode, Scene, Viewer, Workbench};

use crate::content::content;
use crate::devices::{device, input, vrpn_source};
use crate::failure::Failure;
use crate::head::{HeadMotion, HeadSource, Sway, TrackerSource};
use crate::monitor::MonitorSettings;
use crate::realtime::RealtimePolicy;
use crate::setup::{LinkSettings, RealtimeSettings, RecordingSettings, SessionSetup};

/// Period of the haptics loop: the device's rate, 1 kHz.
const HAPTICS_PERIOD: Duration = Duration::from_millis(1);
/// God-object updates per second unless the workbench says otherwise: more than the device's rate brings nothing new.
const GOD_OBJECT_RATE_HZ: f64 = 1000.0;
/// Real-time priority of the broadcaster: below the coupling, above all normal work.
const BROADCAST_PRIORITY: u8 = 50;

/// Real-time priority of the network's threads, below the broadcaster: a bridge's samples must not wait for pictures.
const NETWORK_PRIORITY: u8 = 40;

/// What the command line says instead of the workbench file.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// A shipped scene's name, or a scene file.
    pub scene: Option<String>,
    /// Address of the control plane.
    pub quic: Option<SocketAddr>,
    /// Address of the state plane.
    pub udp: Option<SocketAddr>,
    /// Without monitor.
    pub no_monitor: bool,
    /// Where the monitor records.
    pub record: Option<PathBuf>,
    /// An input device instead of the workbench's.
    pub input: Option<InputChoice>,
    /// Where the session is recorded.
    pub recording: Option<PathBuf>,
}

/// Puts the session together. Files are read and checked, nothing is started.
pub fn session_setup(
    workbench: &Workbench,
    key: ClusterKey,
    overrides: &Overrides,
) -> Result<SessionSetup, Failure> {
    let scene = match &overrides.scene {
        Some(named) => Scene::named_or_file(named)?,
        None => workbench.load_scene()?,
    };
    let built = scene.build()?;
    if let Some(motion) = built.motions.first() {
        return Err(Failure::BadInput(format!(
            "the obstacle \"{}\" has a motion, which only `taut replay` can follow: a session's checker and screens know obstacles at rest only; leave out `motion`",
            built.world.obstacles[motion.obstacle].name
        )));
    }
    let workbench_from_scene = workbench.workbench_from_scene(&scene);
    let content = content(&built, workbench, &workbench_from_scene)?;
    let network = &workbench.network;
    let link = LinkSettings {
        quic: overrides
            .quic
            .unwrap_or(SocketAddr::new(network.bind, network.quic_port)),
        udp: overrides
            .udp
            .unwrap_or(SocketAddr::new(network.bind, network.udp_port)),
        key,
        max_clients: network.max_clients,
    };
    let safety = SafetySettings {
        max_force: built.settings.force_limit,
        max_torque: built.settings.torque_limit,
        ..SafetySettings::default()
    };
    let recording = overrides
        .recording
        .as_ref()
        .map(|directory| recording(directory.clone(), &scene, &built));
    Ok(SessionSetup {
        recording,
        device: match &overrides.input {
            Some(choice) => input(choice, &built, &workbench_from_scene)?,
            None => device(&workbench.device, &built, &workbench_from_scene)?,
        },
        settings: built.settings,
        start: built.start,
        world: Arc::new(built.world),
        safety,
        head: head(&workbench.viewer),
        content,
        link,
        realtime: realtime(workbench),
        monitor: monitor(&workbench.monitoring, overrides),
    })
}

fn recording(directory: PathBuf, scene: &Scene, built: &BuiltScene) -> RecordingSettings {
    let source = scene.source();
    RecordingSettings {
        directory,
        manifest: Manifest {
            format: FORMAT,
            program: format!("taut {}", env!("CARGO_PKG_VERSION")),
            scene: scene.name().to_owned(),
            origin: source.directory.map_or(SceneOrigin::Shipped, |directory| {
                // Where it is now counts; a directory that vanished meanwhile is told when it is looked into.
                SceneOrigin::Directory(std::path::absolute(&directory).unwrap_or(directory))
            }),
            overrides: source.overrides,
            identity: identity_of(&built.world, &built.settings, &built.start),
            complete: false,
            reason: Some("the session did not come to its end".to_owned()),
            lost: Lost::default(),
        },
        scene: source.text,
    }
}

fn head(viewer: &Viewer) -> HeadSource {
    HeadSource {
        rest: viewer.head,
        eye_separation: viewer.eye_separation,
        motion: match &viewer.tracking {
            HeadTracking::Fixed => HeadMotion::Still,
            HeadTracking::Sway { amplitude, period } => HeadMotion::Sway(Sway {
                amplitude: *amplitude,
                period: *period,
            }),
            HeadTracking::Vrpn(sensor) => HeadMotion::Tracker(Box::new(TrackerSource {
                source: vrpn_source(sensor),
                mapping: sensor.mapping,
            })),
        },
    }
}

fn realtime(workbench: &Workbench) -> RealtimeSettings {
    let wanted = &workbench.realtime;
    let god_object_rate = wanted.god_object_rate.unwrap_or(GOD_OBJECT_RATE_HZ);
    RealtimeSettings {
        policy: match wanted.mode {
            RealTimeMode::Enforce => RealtimePolicy::Enforce,
            RealTimeMode::Waive => RealtimePolicy::Waive,
        },
        haptics_period: HAPTICS_PERIOD,
        god_object_period: Duration::from_secs_f64(god_object_rate.recip()),
        broadcast_period: Duration::from_secs_f64(workbench.network.broadcast_rate.recip()),
        haptics_priority: wanted.haptics_priority,
        coupling_priority: wanted.coupling_priority,
        broadcast_priority: BROADCAST_PRIORITY,
        network_priority: NETWORK_PRIORITY,
        god_object_priority: wanted.god_object_priority,
        haptics_core: wanted.haptics_core,
        coupling_core: wanted.coupling_core,
        god_object_core: wanted.god_object_core,
        lock_memory: true,
    }
}

fn monitor(wanted: &Monitoring, overrides: &Overrides) -> Option<MonitorSettings> {
    let record = overrides.record.clone().or_else(|| wanted.record.clone());
    let serve = wanted.enabled && !overrides.no_monitor;
    (serve || overrides.record.is_some()).then_some(MonitorSettings {
        bind: wanted.bind,
        grpc_port: wanted.grpc_port,
        web_port: wanted.web_port,
        record,
        memory_limit_bytes: wanted.memory_limit,
        serve,
    })
}
