//! What a session is made of: bodies, device, addresses, rates. Plain data; [`crate::session`] brings it to life.

pub(crate) mod content;
pub mod devices;
mod fidelity;
mod monitoring;
mod refusals;
mod stability;
pub mod workbench;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use god_object::{Pose, Settings, World};
pub(in crate::session) use refusals::unencodable;
pub use refusals::{Refusal, refusals};
use taut_bridge::{
    Device, DeviceLimits, ExternalWrenchSettings, InputChoice, Placement, SafetySettings,
};
use taut_link::proto::barrier::MasterSettings;
use taut_link::{AlsoKey, ClusterKey, Content, JoinPolicy, MulticastOptions};
use taut_recording::Manifest;
use taut_scene::{
    BuiltHand, BuiltMotion, Carried, FidelityPlan, Prepared, Scene, Viewer, WrenchSource,
};

use crate::loops::checker::PenetrationChecker;
use crate::loops::realtime::RealtimePolicy;
use crate::loops::shell::Phases;
use crate::session::monitor::MonitorSettings;
use crate::session::observers::ObserverSettings;
use crate::session::operator::OperatorSetup;

/// Everything that a session is made of.
pub struct SessionSetup {
    /// As it was read.
    pub scene: Scene,
    /// What is to be known of scene and device together, a sentence each; logged already.
    pub warnings: Vec<String>,
    /// Bodies.
    pub world: Arc<World>,
    /// Its meshes, for a scene that differs in something else.
    pub(crate) prepared: Prepared,
    /// Made when the session begins, or before.
    pub(crate) checker: Option<PenetrationChecker>,
    /// How obstacles move; nothing for those that stand still. At most
    /// [`MAX_MOVING`](crate::shared::contact_snapshot::MAX_MOVING).
    pub motions: Vec<BuiltMotion>,
    /// What is drawn and goes where something else goes; with the motions at most as many.
    pub carried: Vec<Carried>,
    /// Of the method.
    pub settings: Settings,
    /// Where god-object and device start.
    pub start: Pose,
    /// What moves the god-object.
    pub device: DeviceSource,
    /// What it was opened by.
    pub(crate) device_origin: DeviceOrigin,
    /// Limits and times of the force.
    pub safety: SafetySettings,
    /// A force from outside, where the workbench takes one.
    pub external: Option<ExternalSetup>,
    /// The viewer.
    pub viewer: Viewer,
    /// What clients fetch at join.
    pub content: Content,
    /// Addresses, key and limits of the network.
    pub link: LinkSettings,
    /// Those who look on without taut's own client.
    pub observers: ObserverSettings,
    /// The operator's page; `None` does without.
    pub operator: Option<OperatorSetup>,
    /// Rates and scheduling.
    pub realtime: RealtimeSettings,
    /// Where the monitor is served; `None` does without.
    pub monitor: Option<MonitorSettings>,
    /// Where the session is recorded; `None` does without.
    pub recording: Option<RecordingSettings>,
    /// What fidelity the scene chose for itself, if it does.
    pub fidelity: Option<FidelityPlan>,
}

impl SessionSetup {
    /// Places in the world of the obstacles that move.
    pub fn moving(&self) -> impl Iterator<Item = usize> {
        self.motions.iter().map(|motion| motion.obstacle)
    }
}

/// Where a session is recorded, so that it can be computed again.
#[derive(Clone, Debug)]
pub struct RecordingSettings {
    /// New or empty.
    pub directory: PathBuf,
    /// What the recording says about itself.
    pub manifest: Manifest,
    /// Text of the scene.
    pub scene: Arc<str>,
}

/// A force from outside.
#[derive(Clone, Debug)]
pub struct ExternalSetup {
    /// What is let through.
    pub settings: ExternalWrenchSettings,
    /// Where it comes from.
    pub source: WrenchSource,
}

/// All that a device of this process depends on when it is opened: where this is the same, so is the device.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DeviceOrigin {
    pub(crate) wanted: taut_scene::Device,
    pub(crate) input: Option<InputChoice>,
    /// The hand's intention in the scene.
    pub(crate) hand: Option<BuiltHand>,
    /// What the files hold that the workbench names for it.
    pub(crate) files: Vec<Vec<u8>>,
    pub(crate) placement: Placement,
}

/// What moves the god-object.
pub enum DeviceSource {
    /// A device on this machine, in the haptics loop.
    Local(Box<dyn Device>),
    /// A device behind a bridge.
    Remote {
        /// What the device there can bear.
        limits: DeviceLimits,
        /// Silence after which it counts as lost.
        max_age: Duration,
    },
}

/// Addresses, key and limits of the network.
#[derive(Clone, Debug)]
pub struct LinkSettings {
    /// Of the control plane.
    pub quic: SocketAddr,
    /// Of the state plane.
    pub udp: SocketAddr,
    /// Port of the state plane that clients are told, where a router or relay forwards to `udp`; `None`: its own.
    pub announced_udp_port: Option<u16>,
    /// The cluster key.
    pub key: ClusterKey,
    /// Another one that counts for a while.
    pub also: Option<AlsoKey>,
    /// Where states for all go, if the workbench says so.
    pub multicast: Option<MulticastOptions>,
    /// Who is let in, of those who can prove something.
    pub policy: JoinPolicy,
    /// Most clients at a time.
    pub max_clients: usize,
    /// How the frames of the render nodes go together; `None`: each by itself.
    pub frames: Option<MasterSettings>,
    /// Silence after which a render node or a bridge counts as gone.
    pub node_timeout: Duration,
}

/// Rates and scheduling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RealtimeSettings {
    /// What a refusal by the system means.
    pub policy: RealtimePolicy,
    /// Period of the haptics loop.
    pub haptics_period: Duration,
    /// Shortest period of the god-object loop.
    pub god_object_period: Duration,
    /// Time between two states to a client.
    pub broadcast_period: Duration,
    /// Where in their periods the loops tick.
    pub phases: Phases,
    /// Real-time priority of the haptics loop.
    pub haptics_priority: u8,
    /// Real-time priority of the coupling; below that of the haptics loop.
    pub coupling_priority: u8,
    /// Real-time priority of the broadcaster; below that of the coupling.
    pub broadcast_priority: u8,
    /// Real-time priority of the thread that reads the device's own socket; above those of the loops. All other datagrams are read in the
    /// normal class.
    pub device_input_priority: u8,
    /// Real-time priority of the god-object loop; `None` is the normal class, ahead of others, because an update may take long.
    pub god_object_priority: Option<u8>,
    /// Core of the haptics loop; `None` is the system's choice.
    pub haptics_core: Option<usize>,
    /// Core of the coupling.
    pub coupling_core: Option<usize>,
    /// Core of the god-object loop.
    pub god_object_core: Option<usize>,
    /// Keep all memory in RAM.
    pub lock_memory: bool,
}

impl RealtimeSettings {
    /// Time between two forces or constraint sets to a bridge: a hand waits for no picture.
    pub fn bridge_period(&self) -> Duration {
        self.broadcast_period.min(self.haptics_period)
    }
}
