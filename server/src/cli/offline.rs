//! The command lines of those that need no session: parts, scenes, replays, pictures, this machine.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use taut_scene::{ForFile, LengthUnit, UpAxis};

use super::values::{
    MOST_VIEWS, film_seconds, hole_edges, output, picture_size, png_file, positive_length,
    positive_rate,
};

/// Columns and example of `taut replay`.
pub(super) const REPLAY_HELP: &str = "Columns of the answer, one row per row of the trace; m, N, N m, s, world axes; empty where there is no value:
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
    #[arg(long, value_name = "O", required_unless_present = "recording", value_parser = output())]
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
    #[arg(long, value_name = "FILE.mcap", value_parser = output())]
    pub out: PathBuf,
    /// Print the report as JSON on standard output
    #[arg(long)]
    pub json: bool,
}

/// `taut check`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  taut check workbench.toml scene.toml part.ply hand.csv\n  taut check part.stl --unit mm"
)]
pub struct CheckArgs {
    /// Workbench files, scenes, meshes, traces
    #[arg(required = true, value_name = "F")]
    pub files: Vec<PathBuf>,
    /// Unit of meshes whose format names none, STL, OBJ and PLY: m, dm, cm, mm, um, inch (default: m); scenes say it themselves
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<LengthUnit>,
    /// Print the findings as JSON on standard output
    #[arg(long)]
    pub json: bool,
}

/// `taut import`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "The first part is in the hand, the others stand, each where its file puts it; a first part that touches the others begins above them.\nFiles that are written as BODY=FILE with the same BODY are one body of that name.\n\nExamples:\n  taut import peg.stl hole.stl --unit mm --out peg-and-hole\n  taut import peg.stl housing=base.stl housing=lid.obj --unit mm --unit lid.obj=inch --out fit\n  taut import housing.obj --unit mm --obstacle --out housing && taut demo --scene housing/scene.toml"
)]
pub struct ImportArgs {
    /// Mesh files: .stl, .obj, .ply, .glb, .gltf; files written as BODY=FILE are one body together
    #[arg(required = true, value_name = "PART")]
    pub parts: Vec<OsString>,
    /// The new folder for meshes and scene.toml; one that exists is refused
    #[arg(long, value_name = "FOLDER", value_parser = output())]
    pub out: PathBuf,
    /// Unit of parts whose format names none, STL, OBJ and PLY: m, dm, cm, mm, um, inch (default: m, for parts of a size to be held); glTF is in metres; repeated as FILE=UNIT, that of one file
    #[arg(long, value_name = "[FILE=]UNIT")]
    pub unit: Vec<ForFile<LengthUnit>>,
    /// Which way is up in the parts, y or z: with y, as glTF has it, all are turned so that it is +z of the scene (default: z); repeated as FILE=AXIS, that of one file
    #[arg(long, value_name = "[FILE=]AXIS")]
    pub up: Vec<ForFile<UpAxis>>,
    /// Use as few triangles as keep within this distance of the part
    #[arg(long, value_name = "METRES", value_parser = positive_length, allow_negative_numbers = true)]
    pub simplify: Option<f64>,
    /// Close holes of at most this many edges (default: 16, if a hole is below 1 % of its surface; none with --thicken)
    #[arg(long, value_name = "EDGES", value_parser = hole_edges, allow_negative_numbers = true)]
    pub close_holes: Option<usize>,
    /// Make open sheets and points without faces (.ply, .obj, .xyz, .asc, .pts, .csv, .txt, .pcd) solids of this thickness (default: they are refused)
    #[arg(long, value_name = "METRES", value_parser = positive_length, allow_negative_numbers = true)]
    pub thicken: Option<f64>,
    /// Take only this node, object or group of files that name any, and all that is part of it; may be repeated (default: all, as one body)
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Make each node, object or group a body of its own; with --only, of those (default: a file is one body)
    #[arg(long)]
    pub split: bool,
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
    #[arg(long, value_name = "DIR", conflicts_with_all = ["fullscreen", "monitor"], value_parser = output())]
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
    #[arg(long, value_name = "FILE.svg", requires = "device", value_parser = output())]
    pub out: Option<PathBuf>,
    /// Print the findings as JSON on standard output
    #[arg(long)]
    pub json: bool,
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
