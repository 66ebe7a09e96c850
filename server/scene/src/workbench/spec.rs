//! A workbench as it was written, checked value by value. SI units, workbench frame: right-handed, z up.

use std::net::{IpAddr, Ipv4Addr, SocketAddrV4};
use std::path::PathBuf;
use std::time::SystemTime;

use god_object::Pose;
use nalgebra::Point3;
use taut_kinds::Chosen;
use taut_plant::HandPreset;
use taut_proto::JoinPolicy;
pub use taut_proto::scene::{Show, Stereo};

use super::output::ScreenOutput;

/// A flat screen by three of its corners, m, workbench frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Screen {
    /// Unique.
    pub name: String,
    /// As the viewer sees it.
    pub lower_left: Point3<f64>,
    /// As the viewer sees it.
    pub lower_right: Point3<f64>,
    /// As the viewer sees it.
    pub upper_left: Point3<f64>,
    /// What is done to its picture.
    pub output: ScreenOutput,
}

/// A node's windows: one per screen, or two with a window per eye.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Window {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Without frame, over the whole output.
    pub fullscreen: bool,
    /// The output of each window in order: its name such as DP-1, or its number from 0. Windows past the end take the
    /// outputs that follow.
    pub monitors: Vec<String>,
}

/// One render client.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Unique; what `taut render --node` takes.
    pub name: String,
    /// Names of the screens that it draws, at least one.
    pub screens: Vec<String>,
    /// How two eyes are shown.
    pub stereo: Stereo,
    /// One per screen.
    pub window: Window,
}

/// A machine of the workbench, for `taut deploy`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Machine {
    /// Unique; a file's name.
    pub name: String,
    /// By which the others reach it; no two have the same.
    pub address: IpAddr,
    /// Whether it runs `taut serve`; exactly one does.
    pub server: bool,
    /// Nodes that it draws. Each is on one machine.
    pub nodes: Vec<String>,
    /// What `taut bridge --device` takes, if the device is here.
    pub device: Option<String>,
    /// What `taut track --source` takes, if the head's tracker is here.
    pub tracker: Option<String>,
}

/// Where the viewer's head comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum HeadTracking {
    /// It stays where the file says.
    Fixed,
    /// It sways from side to side, as people do who stand and look.
    Sway {
        /// m.
        amplitude: f64,
        /// s.
        period: f64,
    },
    /// A VRPN tracker says where it is: the keys of the device of that kind.
    Vrpn(Box<Chosen>),
    /// `taut track`, somewhere on the network, says where it is.
    Remote,
}

/// The viewer.
#[derive(Clone, Debug, PartialEq)]
pub struct Viewer {
    /// Distance between the pupils, m.
    pub eye_separation: f64,
    /// Between the eyes: x to the right ear, y up, -z ahead.
    pub head: Pose,
    /// Whether it moves.
    pub tracking: HeadTracking,
    /// Near clip plane, m.
    pub near: f64,
    /// Far clip plane, m.
    pub far: f64,
    /// Factor on `eye_separation` with which pictures are drawn.
    pub separation_scale: f64,
    /// Most that anything may stand out from a screen, as an angle between the eyes, rad; 0 is no limit.
    pub nearest_disparity: f64,
}

/// The haptic device.
#[derive(Clone, Debug, PartialEq)]
pub enum Device {
    /// A simulated device in a simulated hand.
    Simulated {
        /// The hand; `None` is the scene's.
        hand: Option<HandPreset>,
        /// Via points; `None` is the scene's.
        path: Option<PathBuf>,
        /// Tremor, m rms.
        tremor: f64,
        /// Of the tremor.
        seed: u64,
        /// Made of strings: a shipped geometry's name, or a geometry file. `None` is a device without any.
        strings: Option<String>,
    },
    /// A recorded trace; forces go nowhere.
    Trace {
        /// CSV.
        path: PathBuf,
        /// Begin again at the end.
        repeat: bool,
    },
    /// Any other that a driver of the server's own process opens.
    Driver(Box<Chosen>),
    /// `taut bridge`, or the mouse of a render window, over the network.
    Remote,
}

/// How poses travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TransportKind {
    /// UDP datagrams.
    #[default]
    Udp,
    /// QUIC datagrams: one port, for networks that let no other through.
    QuicDatagram,
    /// One UDP datagram for all who hear the group, unicast for the others.
    Multicast,
}

/// Addresses, ports and rates.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// Interface to listen on.
    pub bind: IpAddr,
    /// UDP port of QUIC; 0 takes a free one.
    pub quic_port: u16,
    /// UDP port of the pose stream; 0 takes a free one.
    pub udp_port: u16,
    /// What render nodes use.
    pub transport: TransportKind,
    /// Group and port of multicast.
    pub multicast_group: SocketAddrV4,
    /// Interface that multicast leaves from: `bind`, if that is one, unless the file says otherwise.
    pub multicast_interface: Ipv4Addr,
    /// The cluster key; `None` leaves it to `--key` or TAUT_KEY_FILE.
    pub key_file: Option<PathBuf>,
    /// A second cluster key that counts for a while.
    pub also_key: Option<AlsoKeyFile>,
    /// Poses per second to each render node.
    pub broadcast_rate: f64,
    /// Most clients at a time.
    pub max_clients: usize,
    /// Who may join, of those who can prove something.
    pub admission: JoinPolicy,
    /// Silence after which a render node or a bridge counts as gone, s.
    pub node_timeout: f64,
}

/// A second cluster key, old or next.
#[derive(Clone, Debug, PartialEq)]
pub struct AlsoKeyFile {
    /// Its file.
    pub file: PathBuf,
    /// Until when it counts.
    pub until: SystemTime,
}

/// The rerun stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Monitoring {
    /// Whether there is any.
    pub enabled: bool,
    /// Interface of both ports.
    pub bind: IpAddr,
    /// TCP port of the stream; 0 takes a free one.
    pub grpc_port: u16,
    /// TCP port of the web viewer; 0 takes a free one.
    pub web_port: u16,
    /// Also write an .rrd file here, or under the next free name: none is written over.
    pub record: Option<PathBuf>,
    /// Most memory that the hosted stream keeps, bytes.
    pub memory_limit: u64,
}

impl Default for Monitoring {
    fn default() -> Self {
        Self {
            enabled: true,
            bind: IpAddr::V4(Ipv4Addr::LOCALHOST),
            grpc_port: 9876,
            web_port: 9090,
            record: None,
            memory_limit: 256 << 20,
        }
    }
}

/// What to do where the system refuses real-time scheduling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RealTimeMode {
    /// Do not start without.
    Enforce,
    /// Go on, and say so.
    #[default]
    Waive,
}

/// Scheduling of the loops. A core that is `None` is the system's choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RealTime {
    /// Where the system refuses.
    pub mode: RealTimeMode,
    /// SCHED_FIFO, 1 to 99.
    pub haptics_priority: u8,
    /// SCHED_FIFO, 1 to 99.
    pub coupling_priority: u8,
    /// SCHED_FIFO, 1 to 99; `None` is normal scheduling.
    pub god_object_priority: Option<u8>,
    /// Core of the haptics loop.
    pub haptics_core: Option<usize>,
    /// Core of the coupling loop.
    pub coupling_core: Option<usize>,
    /// Core of the god-object loop.
    pub god_object_core: Option<usize>,
    /// Most god-object updates per second; `None` is as many as there can be.
    pub god_object_rate: Option<f64>,
}

impl Default for RealTime {
    fn default() -> Self {
        Self {
            mode: RealTimeMode::Waive,
            haptics_priority: 80,
            coupling_priority: 70,
            god_object_priority: None,
            haptics_core: None,
            coupling_core: None,
            god_object_core: None,
            god_object_rate: None,
        }
    }
}

/// Who arms the force at the start and after a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rearm {
    /// The program, once device and forces are in order.
    Automatic,
    /// A person.
    Manual,
}

/// What is done about energy that comes out of the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Passivity {
    /// It is measured.
    #[default]
    Observe,
    /// It is damped away.
    Control,
}

/// What no force may pass. `None` leaves it to the scene or the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Safety {
    /// Largest norm of the force, N.
    pub max_force: Option<f64>,
    /// Largest norm of the torque, N m.
    pub max_torque: Option<f64>,
    /// Fastest change of the force, N/ms.
    pub force_slew: f64,
    /// Fastest change of the torque, N m/ms.
    pub torque_slew: f64,
    /// From no force to all of it on arming, s.
    pub ramp_in: f64,
    /// A device that is faster has jumped, m/s.
    pub max_speed: f64,
    /// A device that turns faster has jumped, rad/s.
    pub max_turn_rate: f64,
    /// Who arms; `None` is by device.
    pub rearm: Option<Rearm>,
    /// Number of the button that must be held.
    pub dead_man: Option<u8>,
    /// Number of the button whose press arms.
    pub arm_button: Option<u8>,
    /// Energy.
    pub passivity: Passivity,
}

impl Safety {
    /// Time in which a force fades once its inputs are lost, ms: fixed, because what is promised of faults rests on it.
    pub const FADE_MS: f64 = 95.0;
}

impl Default for Safety {
    fn default() -> Self {
        Self {
            max_force: None,
            max_torque: None,
            force_slew: 0.5,
            torque_slew: 0.05,
            ramp_in: 0.5,
            max_speed: 3.0,
            max_turn_rate: 30.0,
            rearm: None,
            dead_man: None,
            arm_button: None,
            passivity: Passivity::Observe,
        }
    }
}
