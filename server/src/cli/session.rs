//! The command lines of those that run or join a session.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use taut_link::RejoinPolicy;

use super::values::{device_text, first_port, output, positive_seconds, tracking_rate};

/// `taut demo`.
#[derive(Clone, Debug, Default, Args)]
#[command(after_help = taut_kinds::device_help() + "\nExample: taut demo --scene moving-plate --duration 30 --headless --json")]
pub struct DemoArgs {
    /// A shipped scene by its name, or a scene file
    #[arg(long, value_name = "NAME|FILE")]
    pub scene: Option<String>,
    /// End after this many seconds (default: at Ctrl-C)
    #[arg(long, value_name = "S", value_parser = positive_seconds)]
    pub duration: Option<f64>,
    /// Draw off-screen even where there is a display
    #[arg(long)]
    pub headless: bool,
    /// How poses reach the render clients
    #[arg(long, value_enum, default_value_t)]
    pub transport: TransportChoice,
    /// What moves the god-object: `simulated`, `haply`, `mouse`, `space-mouse`, `vrpn:TRACKER@HOST`, `trace:FILE`; options below
    /// (default: the scene's simulated hand)
    #[arg(long, value_name = "D", value_parser = device_text)]
    pub device: Option<String>,
    /// Put the device in a process of its own
    #[arg(long)]
    pub bridge: bool,
    /// Also write what the monitor shows to this new file
    #[arg(long, value_name = "FILE.rrd")]
    pub record: Option<PathBuf>,
    /// Record the session into this new directory, to be computed again by `taut replay --recording`
    #[arg(long, value_name = "DIR")]
    pub recording: Option<PathBuf>,
    /// Do without the monitor and its web viewer
    #[arg(long)]
    pub no_monitor: bool,
    /// Let each headless render client write this many pictures
    #[arg(long, value_name = "N", requires = "out")]
    pub frames: Option<u32>,
    /// Where the render clients write their pictures
    #[arg(long, value_name = "DIR", value_parser = output())]
    pub out: Option<PathBuf>,
    /// Start although the scene is stiffer than the device bears
    #[arg(long)]
    pub allow_unstable: bool,
    /// First of four ports: control, poses, the monitor's stream and page; 0 takes any that are free (default: 4857, 4858, 9876 and 9090; one
    /// that is in use is replaced by a free one)
    #[arg(long, value_name = "N", value_parser = first_port)]
    pub port: Option<u16>,
    /// Add a histogram of the haptics loop's periods to the end report
    #[arg(long, conflicts_with = "json")]
    pub histogram: bool,
    /// Print the end report as JSON on standard output
    #[arg(long)]
    pub json: bool,
}

/// `taut serve`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example: taut serve --config workbench.toml --key cluster.key")]
pub struct ServeArgs {
    /// The workbench file
    #[arg(long, value_name = "F")]
    pub config: PathBuf,
    /// The cluster key; else TAUT_KEY_FILE or the workbench file names it
    #[arg(long, value_name = "FILE")]
    pub key: Option<PathBuf>,
    /// Instead of the workbench file's scene: a shipped scene by its name, or a scene file
    #[arg(long, value_name = "NAME|FILE")]
    pub scene: Option<String>,
    /// Instead of the workbench file's address of the control plane
    #[arg(long, value_name = "HOST:PORT")]
    pub quic: Option<SocketAddr>,
    /// Instead of the workbench file's address of the state plane
    #[arg(long, value_name = "HOST:PORT")]
    pub udp: Option<SocketAddr>,
    /// Begin anew when a file of the scene changes, or when the workbench file names another scene: the force fades, everybody follows
    #[arg(long, conflicts_with_all = ["record", "recording"])]
    pub follow_scene: bool,
    /// End after this many seconds (default: at Ctrl-C)
    #[arg(long, value_name = "S", value_parser = positive_seconds)]
    pub duration: Option<f64>,
    /// Also write what the monitor shows to this new file
    #[arg(long, value_name = "FILE.rrd")]
    pub record: Option<PathBuf>,
    /// Record the session into this new directory, to be computed again by `taut replay --recording`
    #[arg(long, value_name = "DIR")]
    pub recording: Option<PathBuf>,
    /// Do without the monitor, whatever the workbench file says
    #[arg(long)]
    pub no_monitor: bool,
    /// Start although the scene is stiffer than the device bears
    #[arg(long)]
    pub allow_unstable: bool,
    /// Add a histogram of the haptics loop's periods to the end report
    #[arg(long, conflicts_with = "json")]
    pub histogram: bool,
    /// Print the end report as JSON on standard output
    #[arg(long)]
    pub json: bool,
    /// Append a line of JSON with everything measured so far to this file, again and again; - is standard output
    #[arg(long, value_name = "FILE|-")]
    pub metrics_json: Option<PathBuf>,
    /// Time between two such lines
    #[arg(long, value_name = "S", value_parser = positive_seconds, default_value_t = 10.0, requires = "metrics_json")]
    pub metrics_period: f64,
}

/// `taut record`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Example: taut record --server haptic-pc:4857 --key observer.key --out hand.csv --duration 60"
)]
pub struct RecordArgs {
    /// The haptic PC
    #[arg(long, value_name = "H:P")]
    pub server: String,
    /// Where the trace goes, a new CSV file
    #[arg(long, value_name = "T", value_parser = output())]
    pub out: PathBuf,
    /// Where that file is there already, write T-2, T-3, ... beside it
    #[arg(long)]
    pub number: bool,
    /// An observer's or operator's credential, or the cluster key; else TAUT_KEY_FILE names it
    #[arg(long, value_name = "FILE")]
    pub key: Option<PathBuf>,
    /// How states come here
    #[arg(long, value_enum, default_value_t)]
    pub transport: TransportChoice,
    /// End after this many seconds (default: at Ctrl-C, or when the server stops)
    #[arg(long, value_name = "S", value_parser = positive_seconds)]
    pub duration: Option<f64>,
    /// Without a server
    #[command(flatten)]
    pub membership: MembershipArgs,
}

/// What a client does without a server.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct MembershipArgs {
    /// Stay when the server stops, and wait for one that is not there yet
    #[arg(long)]
    pub stay: bool,
    /// End when there was no server for this many seconds (default: a server that is lost is waited for)
    #[arg(long, value_name = "S", value_parser = positive_seconds)]
    pub give_up: Option<f64>,
}

impl MembershipArgs {
    /// As the link takes it.
    pub fn policy(self) -> RejoinPolicy {
        RejoinPolicy {
            stay: self.stay,
            give_up: self.give_up.map(Duration::from_secs_f64),
            ..RejoinPolicy::default()
        }
    }
}

/// `taut arm`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example: taut arm --server haptic-pc:4857 --key operator.key")]
pub struct ArmArgs {
    /// The haptic PC
    #[arg(long, value_name = "H:P")]
    pub server: String,
    /// An operator's credential, or the cluster key; else TAUT_KEY_FILE names it
    #[arg(long, value_name = "FILE")]
    pub key: Option<PathBuf>,
    /// No force instead: it fades, and stays away until somebody arms
    #[arg(long)]
    pub off: bool,
}

/// `taut track`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  taut track --server haptic-pc:4857 --key tracker.key --source vrpn:Head@localhost\n  taut track --server haptic-pc:4857 --key tracker.key --source trace:head.csv"
)]
pub struct TrackArgs {
    /// The haptic PC
    #[arg(long, value_name = "H:P")]
    pub server: String,
    /// The tracker's credential, or the cluster key; else TAUT_KEY_FILE names it
    #[arg(long, value_name = "FILE")]
    pub key: Option<PathBuf>,
    /// Where the head's poses come from: `still`, `trace:FILE` (workbench frame), `vrpn:TRACKER@HOST` with the options of `taut bridge`
    #[arg(long, value_name = "SOURCE")]
    pub source: crate::commands::arguments::HeadFrom,
    /// Name of this node, unique in the workbench
    #[arg(long, value_name = "NAME", default_value = "tracker")]
    pub node: String,
    /// Readings per second, 1 to 1000
    #[arg(long, value_name = "HZ", default_value_t = 120.0, value_parser = tracking_rate)]
    pub rate: f64,
    /// How readings travel
    #[arg(long, value_enum, default_value_t)]
    pub transport: TransportChoice,
    /// End after this many seconds (default: at Ctrl-C, or when the server stops)
    #[arg(long, value_name = "S", value_parser = positive_seconds)]
    pub duration: Option<f64>,
    /// Without a server
    #[command(flatten)]
    pub membership: MembershipArgs,
}

/// `taut push-wrench`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  taut push-wrench --server haptic-pc:4857 --key force.key --wrench 0,0,1,0,0,0 --duration 5\n  robot-sensor | taut push-wrench --server haptic-pc:4857 --key force.key"
)]
pub struct PushWrenchArgs {
    /// The haptic PC
    #[arg(long, value_name = "H:P")]
    pub server: String,
    /// The force source's credential, or the cluster key; else TAUT_KEY_FILE names it
    #[arg(long, value_name = "FILE")]
    pub key: Option<PathBuf>,
    /// The same wrench all the time: force x,y,z in N, torque x,y,z in N m (default: lines of standard input, of which the newest in each period is sent, once)
    #[arg(long, value_name = "FX,FY,FZ,TX,TY,TZ", value_parser = crate::commands::push_wrench::parse_wrench, allow_hyphen_values = true)]
    pub wrench: Option<[f64; 6]>,
    /// Name of this node, unique in the workbench
    #[arg(long, value_name = "NAME", default_value = "force")]
    pub node: String,
    /// Values per second, at most: 1 to 1000
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, value_parser = tracking_rate)]
    pub rate: f64,
    /// How values travel
    #[arg(long, value_enum, default_value_t)]
    pub transport: TransportChoice,
    /// End after this many seconds (default: at Ctrl-C, at the end of the input, or when the server stops)
    #[arg(long, value_name = "S", value_parser = positive_seconds)]
    pub duration: Option<f64>,
    /// Without a server
    #[command(flatten)]
    pub membership: MembershipArgs,
}

/// How poses reach a client.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum TransportChoice {
    /// Sealed UDP: the fast way on a wired network
    #[default]
    Udp,
    /// QUIC datagrams: one port, through firewalls
    Quic,
}

impl TransportChoice {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Udp => "udp",
            Self::Quic => "quic",
        }
    }
}

impl From<TransportChoice> for taut_link::Transport {
    fn from(choice: TransportChoice) -> Self {
        match choice {
            TransportChoice::Udp => Self::Udp,
            TransportChoice::Quic => Self::QuicDatagram,
        }
    }
}
