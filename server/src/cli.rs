//! The command line of `taut`: one sub-command per role; none prints what to start with.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::LazyLock;
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};
use taut_link::RejoinPolicy;
use taut_scene::{LengthUnit, MAX_HOLE_EDGES};

/// Version and commit.
const VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    " (",
    env!("TAUT_BUILD_COMMIT"),
    ")"
);
/// Whether a feature of this build is there, as a word in a list.
macro_rules! feature {
    ($name:literal) => {
        if cfg!(feature = $name) {
            concat!(" ", $name)
        } else {
            ""
        }
    };
}
/// Version, commit, features and target.
static LONG_VERSION: LazyLock<String> = LazyLock::new(|| {
    let features = [feature!("monitor"), feature!("render"), feature!("zenoh")].concat();
    format!(
        "{}\ncommit   {}\nfeatures {}\ntarget   {}",
        env!("CARGO_PKG_VERSION"),
        env!("TAUT_BUILD_COMMIT"),
        if features.is_empty() {
            "none"
        } else {
            features.trim()
        },
        env!("TAUT_BUILD_TARGET"),
    )
});

/// Columns and example of `taut replay`.
const REPLAY_HELP: &str = "Columns of the answer, one row per row of the trace; m, N, N m, s, world axes; empty where there is no value:
  t                      time of the row
  hx..hqz                pose of the device as used (position, quaternion w x y z)
  sx..sqz                pose of the god-object
  fx fy fz tx ty tz      force and torque at the reference point
  contacts active        rows in the constraint set, and of these in the active set
  gap_min                smallest distance between the bodies; empty where nothing is near
  kkt                    relative residual of the force's projection
  stale                  time since the constraint set was made
  update_us force_us     thread CPU times, with --timings

Example: taut replay --scene peg-in-a-hole --trace hand.csv --out answer.csv --set coupling.k_s=1.0";

/// What `taut` alone prints.
pub const FIRST_STEPS: &str = "taut: six-degree-of-freedom god-object haptics for a cluster of screens

  taut demo                          the whole workbench on this machine, with a simulated device and hand
  taut doctor                        what this machine lacks for real time and for rendering
  taut setup                         asks what your workbench is made of; then `taut deploy` for its machines
  taut serve --config workbench.toml the haptic PC; then `taut render` on each screen's PC

taut --help lists all commands, taut COMMAND --help shows each with an example.
";

/// Six-degree-of-freedom haptics for a cluster of screens.
#[derive(Debug, Parser)]
#[command(
    name = "taut",
    version = VERSION,
    long_version = LONG_VERSION.as_str(),
    about = "Six-degree-of-freedom god-object haptics for a cluster of screens",
    after_help = "Example: taut demo --duration 20"
)]
pub struct Cli {
    /// The role.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// The roles.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The whole workbench on this machine, with a simulated device and hand
    Demo(DemoArgs),
    /// The haptic PC: three loops, broadcast, monitoring
    Serve(ServeArgs),
    /// One node of the render cluster
    #[command(
        after_help = "Example: taut render --server haptic-pc:4857 --node front --key render-front.key"
    )]
    Render(crate::commands::arguments::RenderArgs),
    /// The device side, on this or another PC
    Bridge(taut_bridge::BridgeArgs),
    /// Plays a device that is not at hand: speaks its wire, with a simulated arm and hand
    SimulateDevice(taut_bridge::SimulateArgs),
    /// Runs the method offline on a device trace; the same input gives the same bytes
    Replay(ReplayArgs),
    /// Takes a live session's device trace, to be replayed
    Record(RecordArgs),
    /// Writes a recorded session as an MCAP file, for Foxglove and the tools of ROS 2
    Export(ExportArgs),
    /// Asks for force at the device of a session, or for none
    Arm(ArmArgs),
    /// Changes the scene of a running session, or says what of it can be changed
    Edit(crate::commands::edit::EditArgs),
    /// Says everything that is wrong with configurations, scenes, meshes and traces
    Check(CheckArgs),
    /// Makes a scene of parts from CAD programs, and mends their meshes within stated bounds
    Import(ImportArgs),
    /// Draws a scene into a PNG file, without a server
    Preview(PreviewArgs),
    /// Draws a calibration picture for each screen: grid in metres, names, corners, grey wedge, blend zones
    Calibrate(CalibrateArgs),
    /// Says what this machine lacks for real time and for rendering, or what a string-driven device can render
    Doctor(DoctorArgs),
    /// Says where the viewer's head is, from a tracker on this PC
    Track(TrackArgs),
    /// Gives a force from outside, for the hand to feel beside the contact's
    PushWrench(PushWrenchArgs),
    /// Makes the cluster key and credentials for nodes and roles, or says what a key file allows
    Keys(KeysArgs),
    /// Asks what a workbench is made of, and writes its file
    Setup(SetupArgs),
    /// Makes an archive for each machine of a workbench: its configuration, key, services, firewall, and a script that installs them
    Deploy(DeployArgs),
    /// Prints completions for a shell
    #[command(
        after_help = "Example: taut completions bash > /usr/share/bash-completion/completions/taut"
    )]
    Completions(CompletionsArgs),
    /// Writes the manual pages, one per command, into a directory
    #[command(after_help = "Example: taut man --out /usr/share/man/man1")]
    Man(ManArgs),
}

/// `taut demo`.
#[derive(Clone, Debug, Default, Args)]
#[command(after_help = taut_kinds::device_help() + "\nExample: taut demo --scene two-bunnies --duration 30 --headless --json")]
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
    /// Also write what the monitor shows to this file
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
    #[arg(long, value_name = "DIR")]
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
    /// Also write what the monitor shows to this file
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

/// `taut replay`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = REPLAY_HELP
)]
pub struct ReplayArgs {
    /// A shipped scene by its name, or a scene file
    #[arg(long, value_name = "F", required_unless_present = "recording")]
    pub scene: Option<String>,
    /// The device trace
    #[arg(long, value_name = "T", required_unless_present = "recording")]
    pub trace: Option<PathBuf>,
    /// Instead of scene and trace: a recorded session, computed again and compared bit by bit
    #[arg(
        long,
        value_name = "DIR",
        conflicts_with_all = ["scene", "trace", "god_object_rate", "budget_us", "solver", "overrides"]
    )]
    pub recording: Option<PathBuf>,
    /// Where the answer goes, a CSV file; a recorded session needs none
    #[arg(long, value_name = "O", required_unless_present = "recording")]
    pub out: Option<PathBuf>,
    /// Virtual rate of the god-object loop (default: once per row of the trace)
    #[arg(long, value_name = "HZ", value_parser = positive_rate)]
    pub god_object_rate: Option<f64>,
    /// Work per god-object update, in nominal microseconds: counted in iterations, so that it stays deterministic
    #[arg(long, value_name = "U", value_parser = clap::value_parser!(u64).range(1..))]
    pub budget_us: Option<u64>,
    /// Solver of the projections (default: the scene's)
    #[arg(long, value_enum)]
    pub solver: Option<SolverChoice>,
    /// The method
    #[arg(long, value_enum, default_value_t)]
    pub method: MethodChoice,
    /// Any key of the scene file, such as coupling.k_s=1.0; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Add the columns update_us and force_us, the only ones that differ from run to run
    #[arg(long)]
    pub timings: bool,
    /// Print the end report as JSON on standard output
    #[arg(long)]
    pub json: bool,
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
    /// Where the trace goes, a CSV file
    #[arg(long, value_name = "T")]
    pub out: PathBuf,
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

/// `taut export`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "What is damaged in the recording is left out, and said. An existing file is replaced.\n\nExample: taut demo --duration 20 --recording session && taut export session --out session.mcap"
)]
pub struct ExportArgs {
    /// The directory of the recording
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
    /// Where the messages go, an MCAP file
    #[arg(long, value_name = "FILE.mcap")]
    pub out: PathBuf,
    /// Print the report as JSON on standard output
    #[arg(long)]
    pub json: bool,
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

/// `taut check`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example: taut check workbench.toml scene.toml part.ply hand.csv")]
pub struct CheckArgs {
    /// Workbench files, scenes, meshes, traces
    #[arg(required = true, value_name = "F")]
    pub files: Vec<PathBuf>,
    /// Print the findings as JSON on standard output
    #[arg(long)]
    pub json: bool,
}

/// `taut import`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "The first part is in the hand, the others stand, each where its file puts it; a first part that touches the others begins above them.\n\nExamples:\n  taut import peg.stl hole.stl --unit mm --out peg-and-hole\n  taut import housing.obj --unit mm --obstacle --out housing && taut demo --scene housing/scene.toml"
)]
pub struct ImportArgs {
    /// Mesh files: .stl, .obj, .ply, .glb, .gltf
    #[arg(required = true, value_name = "PART")]
    pub parts: Vec<PathBuf>,
    /// The new folder for meshes and scene.toml; one that exists is refused
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Unit of parts whose format names none, STL, OBJ and PLY: m, dm, cm, mm, um, inch (default: m, for parts of a size to be held); glTF is in metres
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<LengthUnit>,
    /// Use as few triangles as keep within this distance of the part
    #[arg(long, value_name = "METRES", value_parser = positive_length)]
    pub simplify: Option<f64>,
    /// Close holes of at most this many edges (default: 16, if a hole is below 1 % of its surface)
    #[arg(long, value_name = "EDGES", value_parser = hole_edges)]
    pub close_holes: Option<usize>,
    /// Make open sheets solids of this thickness (default: sheets are refused)
    #[arg(long, value_name = "METRES", value_parser = positive_length)]
    pub thicken: Option<f64>,
    /// Name of the scene (default: the folder's)
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// Let all parts stand, with a small sphere in the hand
    #[arg(long)]
    pub obstacle: bool,
    /// Print the report as JSON on standard output
    #[arg(long)]
    pub json: bool,
}

/// Pixels of a preview that names no size.
pub const PREVIEW_SIZE: (u32, u32) = (1280, 960);
/// Most pixels of a preview's side: a poster.
const MOST_PIXELS: u32 = 8192;
/// Most pictures of a turn: ten to a degree.
const MOST_VIEWS: i64 = 3600;

/// `taut preview`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "The eye is before the scene, to its right and above, as near as shows all of it. Bodies are where they start. A half-space is drawn\nas a plate, and is not brought into view. An existing file is replaced.\n\nExamples:\n  taut preview peg-in-a-hole --out peg.png\n  taut preview my-scene.toml --out turn.png --orbit 36 --size 800x600\n  taut preview my-scene.toml --out film.png --film 6 --size 480x360"
)]
pub struct PreviewArgs {
    /// A shipped scene by its name, or a scene file
    #[arg(value_name = "SCENE")]
    pub scene: String,
    /// The picture, a PNG file
    #[arg(long, value_name = "FILE.png", value_parser = png_file)]
    pub out: PathBuf,
    /// Pixels across and down, up to 8192 each (default: 1280x960)
    #[arg(long, value_name = "WxH", value_parser = picture_size)]
    pub size: Option<(u32, u32)>,
    /// Draw so many pictures of a turn around the scene instead, FILE-01.png and so on
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_VIEWS))]
    pub orbit: Option<u32>,
    /// Write them into one file that browsers play, an animated PNG of one turn in S seconds (without --orbit: of 36 pictures)
    #[arg(long, value_name = "S", value_parser = film_seconds)]
    pub film: Option<f64>,
    /// Graphics adapter by number or part of its name (default: the best; `taut doctor` lists them)
    #[arg(long, value_name = "NAME|INDEX")]
    pub gpu: Option<String>,
}

/// `taut calibrate`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "The pictures go through the warp, blend mask and colours that the workbench file gives each screen, for the head that it declares.\nIn windows, Esc ends and F covers the monitor.\n\nExamples:\n  taut calibrate workbench.toml --out pictures\n  taut calibrate /etc/taut/workbench.toml --node front --fullscreen"
)]
pub struct CalibrateArgs {
    /// The workbench file; the files of its screens are beside it
    #[arg(value_name = "WORKBENCH")]
    pub workbench: PathBuf,
    /// The node whose screens are drawn (default: with --out all, in windows the only one)
    #[arg(long, value_name = "NAME")]
    pub node: Option<String>,
    /// Write NODE-SCREEN.png into this folder instead of opening windows
    #[arg(long, value_name = "DIR", conflicts_with_all = ["fullscreen", "monitor"])]
    pub out: Option<PathBuf>,
    /// Cover the monitors, whatever the workbench file says
    #[arg(long)]
    pub fullscreen: bool,
    /// Monitors of the windows in order, by name (DP-1) or number from 0, whatever the workbench file says
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub monitor: Vec<String>,
    /// Graphics adapter by number or part of its name (default: the best; `taut doctor` lists them)
    #[arg(long, value_name = "NAME|INDEX")]
    pub gpu: Option<String>,
}

/// `taut doctor`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  taut doctor --json\n  taut doctor --device g6x3r --out workspace.svg"
)]
pub struct DoctorArgs {
    /// Instead of this machine, examine a string-driven device: a shipped one (g6x3r, g6x4r, g6x5r, wb), or a geometry file
    #[arg(long, value_name = "NAME|FILE")]
    pub device: Option<String>,
    /// Where the picture of the device's workspace goes, an SVG file (default: NAME-workspace.svg)
    #[arg(long, value_name = "FILE.svg", requires = "device")]
    pub out: Option<PathBuf>,
    /// Print the findings as JSON on standard output
    #[arg(long)]
    pub json: bool,
}

/// `taut keys`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  taut keys --out cluster.key\n  taut keys --master cluster.key --config workbench.toml --out keys\n  taut keys --master cluster.key --role render --node front --issue 2 --out front.key\n  taut keys --show front.key"
)]
pub struct KeysArgs {
    /// The file to make (default: cluster.key), a directory with --config; an existing file is never overwritten
    #[arg(long, value_name = "FILE|DIR")]
    pub out: Option<PathBuf>,
    /// Make credentials from this cluster key
    #[arg(long, value_name = "FILE")]
    pub master: Option<PathBuf>,
    /// For every node of this workbench file, and for device, tracker, operator and observer
    #[arg(long, value_name = "F", requires = "master", conflicts_with = "role")]
    pub config: Option<PathBuf>,
    /// For one role: render, device, tracker, operator, observer, force
    #[arg(long, value_name = "ROLE", requires = "master")]
    pub role: Option<taut_link::Role>,
    /// For the node of this name only (default: *, any of the role)
    #[arg(long, value_name = "NAME", requires = "role")]
    pub node: Option<String>,
    /// Which issue: a later one stays good when an earlier one is revoked
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub issue: u16,
    /// Instead, say what this key file allows and its fingerprint
    #[arg(long, value_name = "FILE", conflicts_with_all = ["out", "master"])]
    pub show: Option<PathBuf>,
}

/// `taut setup`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  taut setup\n  taut setup --yes --out workbench.toml\n\nOne line answers one question; an empty one takes the default. Answers may come through a pipe."
)]
pub struct SetupArgs {
    /// The file to write; one that is there is refused
    #[arg(long, value_name = "FILE", default_value = "workbench.toml")]
    pub out: PathBuf,
    /// Take every default, and ask nothing
    #[arg(long)]
    pub yes: bool,
}

/// `taut deploy`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Example: taut deploy workbench.toml --master cluster.key --out deploy\n\nThe machines are those of [[machine]] in the workbench file. The same files make the same archives; one that is there and differs is not replaced without --force."
)]
pub struct DeployArgs {
    /// The workbench file
    #[arg(value_name = "WORKBENCH.toml")]
    pub config: PathBuf,
    /// The folder of the archives, made if it is not there
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The cluster key (default: `key_file` of the workbench file)
    #[arg(long, value_name = "FILE")]
    pub master: Option<PathBuf>,
    /// Which issue of the credentials: a later one stays good when an earlier one is revoked
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub issue: u16,
    /// Replace archives that are there and differ
    #[arg(long)]
    pub force: bool,
}

/// `taut completions`.
#[derive(Clone, Copy, Debug, Args)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// `taut man`.
#[derive(Clone, Debug, Args)]
pub struct ManArgs {
    /// The directory; files of the same name are replaced
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
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
    /// Readings per second
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
    /// The same wrench all the time: force x,y,z in N, torque x,y,z in N m (default: each line of standard input is one, sent once)
    #[arg(long, value_name = "FX,FY,FZ,TX,TY,TZ", value_parser = crate::commands::push_wrench::parse_wrench, allow_hyphen_values = true)]
    pub wrench: Option<[f64; 6]>,
    /// Name of this node, unique in the workbench
    #[arg(long, value_name = "NAME", default_value = "force")]
    pub node: String,
    /// Values per second, at most
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

/// Solver of the projections.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SolverChoice {
    /// Dual active set, warm-started: the fast one
    ActiveSet,
    /// Interior point: the accuracy reference
    Clarabel,
}

impl From<SolverChoice> for god_object::SolverKind {
    fn from(choice: SolverChoice) -> Self {
        match choice {
            SolverChoice::ActiveSet => Self::ActiveSet,
            SolverChoice::Clarabel => Self::Clarabel,
        }
    }
}

/// Method of haptic display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum MethodChoice {
    /// Six-degree-of-freedom god-object, Ortega et al. 2007
    #[default]
    GodObject,
}

/// Ports of a demo: control, poses, the monitor's stream and page.
const DEMO_PORTS: u16 = 4;
/// A day is longer than any session; NaN and infinity are no durations.
const MAX_SECONDS: f64 = 86_400.0;
/// No part for a hand needs more.
const MAX_LENGTH: f64 = 1.0;
/// No loop turns faster.
const MAX_RATE_HZ: f64 = 1e6;
/// No tracker is faster, and the server would take it for a flood.
const MAX_TRACKING_RATE_HZ: f64 = 1000.0;

/// The text of a device, as it is, if it names one.
fn device_text(text: &str) -> Result<String, taut_kinds::UnknownDevice> {
    text.parse::<taut_bridge::DeviceChoice>()
        .map(|_| text.to_owned())
}

/// The first of [`DEMO_PORTS`] ports in a row, or 0.
fn first_port(text: &str) -> Result<u16, String> {
    let largest = u16::MAX - (DEMO_PORTS - 1);
    match text.parse() {
        Ok(port) if port <= largest => Ok(port),
        _ => Err(format!(
            "give a port from 1 to {largest}, or 0 for free ones"
        )),
    }
}

fn positive_seconds(text: &str) -> Result<f64, String> {
    positive(text, MAX_SECONDS, "seconds")
}

fn positive_rate(text: &str) -> Result<f64, String> {
    positive(text, MAX_RATE_HZ, "Hz")
}

fn positive_length(text: &str) -> Result<f64, String> {
    positive(text, MAX_LENGTH, "metres")
}

fn hole_edges(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(edges) if edges <= MAX_HOLE_EDGES => Ok(edges),
        _ => Err(format!("give a number of edges up to {MAX_HOLE_EDGES}")),
    }
}

/// A name that says what is written.
fn png_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_png = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if is_png && path.file_stem().is_some() {
        Ok(path)
    } else {
        Err("name a file that ends in .png".to_owned())
    }
}

fn film_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s| (0.1..=60.0).contains(s));
    seconds.ok_or_else(|| "give seconds, from 0.1 to 60".to_owned())
}

fn picture_size(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| {
        text.parse()
            .ok()
            .filter(|side| (1..=MOST_PIXELS).contains(side))
    };
    let sides = text.split_once(['x', 'X']);
    sides
        .and_then(|(width, height)| Some((side(width)?, side(height)?)))
        .ok_or_else(|| {
            format!("give a width and a height from 1 to {MOST_PIXELS}, such as 1280x960")
        })
}

fn tracking_rate(text: &str) -> Result<f64, String> {
    positive(text, MAX_TRACKING_RATE_HZ, "Hz")
}

fn positive(text: &str, limit: f64, unit: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= limit => Ok(value),
        _ => Err(format!("give a number of {unit} above 0 and up to {limit}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent_and_every_command_shows_an_example() {
        let mut cli = Cli::command();
        cli.build();
        cli.clone().debug_assert();
        for command in cli
            .get_subcommands()
            .filter(|command| command.get_name() != "help")
        {
            let example = command.clone().render_help().to_string();
            assert!(
                example.contains("Example"),
                "{} has no example",
                command.get_name()
            );
        }
    }

    #[test]
    fn the_first_steps_are_commands_that_there_are() {
        assert!(Cli::try_parse_from(["taut"]).is_ok_and(|cli| cli.command.is_none()));
        let shown = FIRST_STEPS
            .lines()
            .filter(|line| line.starts_with("  taut "));
        let mut count = 0;
        for line in shown {
            let words = line.split_whitespace();
            // The command ends where its explanation begins.
            let takes = if line.contains("--config") { 4 } else { 2 };
            let command: Vec<&str> = words.take(takes).collect();
            assert!(Cli::try_parse_from(&command).is_ok(), "{command:?}");
            count += 1;
        }
        assert_eq!(count, 4);
    }

    #[test]
    fn the_version_says_commit_features_and_target() {
        for part in [
            "commit   ",
            "features ",
            "target   ",
            env!("CARGO_PKG_VERSION"),
        ] {
            assert!(LONG_VERSION.contains(part), "{}", *LONG_VERSION);
        }
    }

    #[test]
    fn a_demo_takes_four_ports_in_a_row_or_free_ones() {
        for (port, good) in [
            ("0", true),
            ("65532", true),
            ("65533", false),
            ("-1", false),
        ] {
            let parsed = Cli::try_parse_from(["taut", "demo", &format!("--port={port}")]);
            assert_eq!(parsed.is_ok(), good, "{port}");
        }
    }

    #[test]
    fn the_help_of_replay_explains_every_column() {
        let columns = taut_scene::REPLAY_COLUMNS.split(',');
        for column in columns.filter(|column| {
            ![
                "hy", "hz", "hqw", "hqx", "hqy", "sy", "sz", "sqw", "sqx", "sqy",
            ]
            .contains(column)
        }) {
            assert!(REPLAY_HELP.contains(column), "{column} is not explained");
        }
    }

    #[test]
    fn durations_and_rates_must_be_positive_numbers() {
        for bad in ["0", "-1", "nan", "inf", "x"] {
            assert!(
                Cli::try_parse_from(["taut", "demo", "--duration", bad]).is_err(),
                "{bad}"
            );
        }
        assert!(Cli::try_parse_from(["taut", "demo", "--duration", "0.5"]).is_ok());
    }
}
