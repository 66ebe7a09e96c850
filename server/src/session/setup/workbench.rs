//! From the workbench file to what a session is made of.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use god_object::Pose;
use taut_bridge::{
    ContactBound, DeviceChoice, ExternalWrenchSettings, InputChoice, MAX_EDGE_DELAY, Passivity,
    PassivitySettings, Rearm, SafetySettings, ValidationSettings, WrenchAxes,
};
use taut_link::{AlsoKey, ClusterKey, MulticastOptions, read_key_file};
use taut_recording::{FORMAT, Lost, Manifest, SceneOrigin, identity_of};
use taut_scene::{
    BuiltScene, Device, Prepared, RealTimeMode, Scene, TransportKind, Workbench, WrenchFrame,
};

use crate::loops::realtime::RealtimePolicy;
use crate::loops::shell::Phases;
use crate::session::frames;
use crate::session::observers::ObserverSettings;
use crate::session::operator::OperatorSetup;
use crate::session::setup::content::content;
use crate::session::setup::devices::chosen_device;
use crate::session::setup::monitoring::monitor;
use crate::session::setup::refusals::{few_motions, no_token_is_the_key, warned_of};
use crate::session::setup::stability::stiffnesses;
use crate::session::setup::{
    ExternalSetup, LinkSettings, RealtimeSettings, RecordingSettings, SessionSetup,
};
use crate::shared::failure::Failure;

/// Period of the haptics loop: the device's rate, 1 kHz.
const HAPTICS_PERIOD: Duration = Duration::from_millis(1);
/// God-object updates per second unless the workbench says otherwise: more than the device's rate brings nothing new.
const GOD_OBJECT_RATE_HZ: f64 = 1000.0;
/// Real-time priority of the broadcaster: below the coupling, above all normal work.
const BROADCAST_PRIORITY: u8 = 50;

/// The thread that reads the device's own socket is so much above the haptics loop, which reads what it brings.
const DEVICE_INPUT_ABOVE_HAPTICS: u8 = 5;
/// The highest real-time priority.
const MAX_PRIORITY: u8 = 99;

/// What the command line says instead of the workbench file.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// A shipped scene's name, or a scene file.
    pub scene: Option<String>,
    /// A scene that was changed since it was read, whatever is named.
    pub edited: Option<Scene>,
    /// Meshes that are there already.
    pub prepared: Option<Prepared>,
    /// Address of the control plane.
    pub quic: Option<SocketAddr>,
    /// Address of the state plane.
    pub udp: Option<SocketAddr>,
    /// Start although the scene is stiffer than the device bears.
    pub allow_unstable: bool,
    /// Without monitor.
    pub no_monitor: bool,
    /// Where the monitor records.
    pub record: Option<PathBuf>,
    /// An input device instead of the workbench's.
    pub input: Option<InputChoice>,
    /// Where the session is recorded.
    pub recording: Option<PathBuf>,
}

impl Overrides {
    fn scene_of(&self, workbench: &Workbench) -> Result<Scene, Failure> {
        Ok(match (&self.edited, &self.scene) {
            (Some(edited), _) => edited.clone(),
            (None, Some(named)) => Scene::named_or_file(named)?,
            (None, None) => workbench.load_scene()?,
        })
    }
}

/// Puts the session together. Files are read and checked, nothing is started.
pub fn session_setup(
    workbench: &Workbench,
    key: ClusterKey,
    overrides: &Overrides,
) -> Result<SessionSetup, Failure> {
    let scene = overrides.scene_of(workbench)?;
    let built = scene.build_from(overrides.prepared.as_ref())?;
    few_motions(&built)?;
    no_token_is_the_key(workbench, &key)?;
    let choice = driver(workbench, overrides)?;
    let warnings = warned_of(&built, workbench, choice.as_ref(), overrides)?;
    let workbench_from_scene = workbench.workbench_from_scene(&scene);
    let content = content(&built, workbench, &workbench_from_scene)?;
    let link = link(workbench, key, overrides)?;
    let safety = safety(
        workbench,
        choice.as_ref(),
        &built.settings,
        &built.world.body,
    );
    let recording = overrides
        .recording
        .as_ref()
        .map(|directory| recording(directory.clone(), &scene, &built));
    let mut realtime = realtime(workbench);
    let mut fidelity = built.fidelity.clone();
    if let Some(plan) = &mut fidelity {
        let rate_is_set = workbench.realtime.god_object_rate.is_some();
        let at_bridge = choice.is_none() && workbench.device == Device::Remote;
        crate::session::setup::fidelity::apply(plan, &mut realtime, rate_is_set, at_bridge);
    }
    let (device, device_origin) = chosen_device(
        &workbench.device,
        choice.as_ref(),
        &built,
        &workbench_from_scene,
        realtime.haptics_priority,
    )?;
    let world = Arc::new(built.world);
    let prepared = Prepared::new(world.clone(), built.sources);
    Ok(SessionSetup {
        scene,
        prepared,
        checker: None,
        warnings,
        fidelity,
        recording,
        device,
        device_origin,
        motions: built.motions,
        carried: built.carried,
        settings: built.settings,
        start: built.start,
        world,
        safety,
        external: external(workbench, overrides, &workbench_from_scene)?,
        viewer: workbench.viewer.clone(),
        content,
        link,
        observers: ObserverSettings::of(workbench)?,
        operator: OperatorSetup::of(workbench)?,
        realtime,
        monitor: monitor(&workbench.monitoring, overrides)?,
    })
}

/// Addresses and conditions of the network.
fn link(
    workbench: &Workbench,
    key: ClusterKey,
    overrides: &Overrides,
) -> Result<LinkSettings, Failure> {
    let network = &workbench.network;
    Ok(LinkSettings {
        quic: overrides
            .quic
            .unwrap_or(SocketAddr::new(network.bind, network.quic_port)),
        udp: overrides
            .udp
            .unwrap_or(SocketAddr::new(network.bind, network.udp_port)),
        announced_udp_port: None,
        key,
        also: also_key(network)?,
        multicast: (network.transport == TransportKind::Multicast).then_some(MulticastOptions {
            group: network.multicast_group,
            announced: None,
            interface: network.multicast_interface,
        }),
        policy: network.admission.clone(),
        max_clients: network.max_clients,
        frames: frames::settings(&workbench.frames),
        node_timeout: Duration::from_secs_f64(network.node_timeout),
    })
}

/// A force from outside, with the port's own ramps.
pub(super) fn external(
    workbench: &Workbench,
    overrides: &Overrides,
    workbench_from_scene: &Pose,
) -> Result<Option<ExternalSetup>, Failure> {
    let wanted = &workbench.wrench_in;
    if !wanted.enabled {
        return Ok(None);
    }
    let is_local = overrides.input.is_some() || workbench.device != Device::Remote;
    if is_local && workbench.safety.passivity != taut_scene::Passivity::Control {
        return Err(Failure::bad_input(
            "[wrench_in] with a device of the server needs safety.passivity = \"control\": who sends a force could give the hand energy without end otherwise",
        ));
    }
    let seconds = |ms: f64| Duration::from_secs_f64(ms * 1e-3);
    let axes = match wanted.frame {
        WrenchFrame::Workbench => WrenchAxes::Fixed(workbench_from_scene.rotation.inverse()),
        WrenchFrame::Body => WrenchAxes::Body,
    };
    Ok(Some(ExternalSetup {
        settings: ExternalWrenchSettings {
            axes,
            max_force: wanted.max_force,
            max_torque: wanted.max_torque,
            hold: seconds(wanted.hold_ms()),
            ramp_out: seconds(wanted.fade_ms()),
            ramp_in: Duration::from_secs_f64(workbench.safety.ramp_in),
        },
        source: wanted.source.clone(),
    }))
}

/// The device that a driver of this process opens: the command line's, else the file's.
pub(super) fn driver(
    workbench: &Workbench,
    overrides: &Overrides,
) -> Result<Option<InputChoice>, Failure> {
    if overrides.input.is_some() {
        return Ok(overrides.input.clone());
    }
    let Device::Driver(chosen) = &workbench.device else {
        return Ok(None);
    };
    match DeviceChoice::of(chosen).map_err(Failure::bad_input)? {
        Some(DeviceChoice::Input(input)) => Ok(Some(input)),
        _ => Ok(None),
    }
}

/// The second cluster key, while its time is not over.
fn also_key(network: &taut_scene::Network) -> Result<Option<AlsoKey>, Failure> {
    let Some(also) = &network.also_key else {
        return Ok(None);
    };
    let also = AlsoKey {
        key: read_key_file(&also.file)?,
        until: also.until,
    };
    if !also.counts() {
        tracing::warn!(
            "the time of `also_key` in [network] is over: it opens nothing; take it out"
        );
        return Ok(None);
    }
    Ok(Some(also))
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
                // A file without a folder is in this one.
                let directory = Path::new(".").join(directory);
                // Where it is now counts; a directory that vanished meanwhile is told when it is looked into.
                SceneOrigin::Directory(std::path::absolute(&directory).unwrap_or(directory))
            }),
            overrides: source.overrides,
            identity: identity_of(&built.world, &built.settings, &built.start),
            complete: false,
            reason: Some("the session did not come to its end".to_owned()),
            lost: Lost::default(),
            records: None,
        },
        scene: source.text,
    }
}

/// The stiffest contact of the scene: what the port lets the device's motion explain.
fn contact_bound(scene: &god_object::Settings, body: &god_object::Body) -> ContactBound {
    let [along, about] = stiffnesses(scene, body);
    ContactBound {
        stiffness: along,
        radius_of_gyration: (about / along).sqrt(),
    }
}

/// What the device port keeps to: the workbench's limits, and the scene's where those are smaller.
fn safety(
    workbench: &Workbench,
    choice: Option<&InputChoice>,
    scene: &god_object::Settings,
    body: &god_object::Body,
) -> SafetySettings {
    let wanted = &workbench.safety;
    // Without a driver it is simulated, recorded, or behind a bridge.
    let nobody_is_hurt = choice.is_none_or(|choice| choice.force_device().is_none());
    let rearm = match wanted.rearm {
        Some(taut_scene::Rearm::Automatic) => Rearm::Automatic,
        Some(taut_scene::Rearm::Manual) => Rearm::Manual,
        // Behind a bridge the bridge decides.
        None if nobody_is_hurt => Rearm::Automatic,
        None => Rearm::Manual,
    };
    // What comes over a network is stamped there and may be late; the device drops what is too late, which for a bridge that couples
    // by itself is later.
    let time_slack = match workbench.device {
        Device::Remote => MAX_EDGE_DELAY,
        _ => Duration::ZERO,
    };
    let default = ValidationSettings::default();
    let within = |wanted: Option<f64>, scene: f64| wanted.map_or(scene, |wanted| wanted.min(scene));
    SafetySettings {
        max_force: within(wanted.max_force, scene.force_limit),
        max_torque: within(wanted.max_torque, scene.torque_limit),
        force_rate: wanted.force_slew * 1e3,
        torque_rate: wanted.torque_slew * 1e3,
        contact: contact_bound(scene, body),
        ramp_in: Duration::from_secs_f64(wanted.ramp_in),
        period: HAPTICS_PERIOD,
        rearm,
        dead_man: wanted.dead_man,
        arm_button: wanted.arm_button,
        validation: ValidationSettings {
            max_speed: wanted.max_speed,
            max_turn_rate: wanted.max_turn_rate,
            max_age: default.max_age + time_slack,
            time_slack,
            ..default
        },
        passivity: PassivitySettings {
            mode: match wanted.passivity {
                taut_scene::Passivity::Observe => Passivity::Observe,
                taut_scene::Passivity::Control => Passivity::Control,
            },
            ..PassivitySettings::default()
        },
        ..SafetySettings::default()
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
        phases: Phases::default(),
        haptics_priority: wanted.haptics_priority,
        coupling_priority: wanted.coupling_priority,
        broadcast_priority: BROADCAST_PRIORITY,
        device_input_priority: wanted
            .haptics_priority
            .saturating_add(DEVICE_INPUT_ABOVE_HAPTICS)
            .min(MAX_PRIORITY),
        god_object_priority: wanted.god_object_priority,
        haptics_core: wanted.haptics_core,
        coupling_core: wanted.coupling_core,
        god_object_core: wanted.god_object_core,
        lock_memory: true,
    }
}
