//! The command line of a render node, shared by `taut render` and `taut-render`.

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use taut_bridge::realtime::keep_cores_awake;
use taut_link::{ClientOptions, Role, Transport, read_join_key};
use taut_proto::scene::{Show, Stereo};

use crate::canvas::Canvas;
use crate::description::Overrides;
use crate::error::RenderError;
use crate::hand::Hand;
use crate::hold::Hold;
use crate::membership::MembershipArgs;
use crate::monitor::Places;
use crate::renderer::{Gpu, GpuChoice, SMOOTH};
use crate::session::Session;
use crate::stage::Stage;
use crate::statistics::{Ended, NO_WINDOW, RenderReport, Statistics};
use crate::timeline::Timeline;
use crate::{headless, window};

/// Frames per second without a window.
const HEADLESS_FPS: f64 = 20.0;

/// Frames per second in a window where the processor draws, which the haptic loops may need: the two nodes of the shipped workbench take about one
/// core together at this rate (`--example picture_rate`).
const SOFTWARE_FPS: f64 = 20.0;

/// Frames per second in a window, at most; the monitor may take fewer.
const WINDOW_FPS: f64 = 120.0;

/// Frames per second that the processor draws smoothly and writes to files.
const WRITTEN_FPS: f64 = 10.0;

/// Longest delay of the picture, in milliseconds: as far as states are kept at 1 kHz.
const MAX_DELAY_MS: f64 = 200.0;

/// From handing a picture over to its light, in milliseconds: half a frame of 60 Hz.
const DISPLAY_MS: f64 = 8.0;

/// Real-time priority of what stands between a RELEASE and the showing of a frame: below the loops of a server on the same machine.
const FRAME_PRIORITY: u8 = 40;

/// One node of the render cluster.
#[derive(Args, Clone, Debug)]
pub struct RenderArgs {
    /// Address of the server.
    #[arg(long, value_name = "HOST:PORT")]
    pub server: String,
    /// Name of this node in the server's workbench file.
    #[arg(long, value_name = "NAME")]
    pub node: String,
    /// File with this node's credential, made by `taut keys` on the haptic PC, or with the cluster key.
    #[arg(long, value_name = "FILE", env = "TAUT_KEY_FILE")]
    pub key: PathBuf,
    /// How states travel to this node.
    #[arg(long, value_enum, default_value_t = TransportArg::Udp)]
    pub transport: TransportArg,
    /// Draw off-screen instead of in windows.
    #[arg(long)]
    pub headless: bool,
    /// End after this many frames.
    #[arg(long, value_name = "N")]
    pub frames: Option<u64>,
    /// Hold the body with mouse and keys of the windows: this node is the device as well (the server's device must be
    /// remote).
    #[arg(long, conflicts_with = "headless")]
    pub hold: bool,
    /// Write every frame to PNG files in this folder (with --headless).
    #[arg(long, value_name = "DIR", requires = "headless")]
    pub out: Option<PathBuf>,
    /// End after this many seconds.
    #[arg(long, value_name = "SECONDS")]
    pub duration: Option<f64>,
    /// Most frames per second [default: 120 in windows; 20 off-screen or without a graphics card, 10 for pictures of --out
    /// without one].
    #[arg(long, value_name = "N")]
    pub fps: Option<f64>,
    /// Samples per pixel: 4 smooths edges of bodies and shadows, 1 is twice as fast in software [default: 4; 1 without a graphics card,
    /// but for pictures of --out].
    #[arg(long, value_name = "1|4", value_parser = samples())]
    pub samples: Option<u32>,
    /// Draw these too, whatever the server says.
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',')]
    pub show: Option<Vec<ShowArg>>,
    /// Show the two eyes in this way, whatever the server says.
    #[arg(long, value_name = "MODE", value_parser = stereo_modes())]
    pub stereo: Option<Stereo>,
    /// Width of a window in pixels, off-screen of one eye's view [default: the window of the workbench file; 480 off-screen without --out].
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=16384))]
    pub width: Option<u32>,
    /// Height of the same.
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=16384))]
    pub height: Option<u32>,
    /// Monitors of the windows in order, by name (DP-1) or number from 0, whatever the server says; further windows take
    /// the next.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub monitor: Vec<String>,
    /// Cover the monitors, whatever the server says.
    #[arg(long, conflicts_with = "headless")]
    pub fullscreen: bool,
    /// Graphics adapter by number or part of its name [default: the best; `taut doctor` lists them].
    #[arg(long, value_name = "NAME|INDEX")]
    pub gpu: Option<String>,
    /// Folder of the warp, surface and blend files that the workbench file names for screens [default: the folder of --key].
    #[arg(long, value_name = "DIR")]
    pub screens: Option<PathBuf>,
    /// Write text about the node over the pictures, whatever the server says.
    #[arg(long)]
    pub hud: bool,
    /// Time from handing a picture over to its light, for which a tracked head is predicted: display and half a frame; the
    /// same for nodes whose screens are shown together.
    #[arg(long, value_name = "MS", default_value_t = DISPLAY_MS)]
    pub display_ms: f64,
    /// Draw the world of this many milliseconds ago, so that late states can be interpolated.
    #[arg(long, value_name = "MS", default_value_t = 2.0)]
    pub delay_ms: f64,
    /// What to do when the server goes.
    #[command(flatten)]
    pub membership: MembershipArgs,
}

/// How states travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TransportArg {
    /// Sealed UDP: the fast way on a wired network.
    Udp,
    /// QUIC datagrams: one port, through firewalls.
    Quic,
}

impl TransportArg {
    fn name(self) -> &'static str {
        match self {
            Self::Udp => "udp",
            Self::Quic => "quic",
        }
    }
}

/// What can be drawn besides god-object and obstacles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ShowArg {
    /// The device pose, translucent.
    Ghost,
    /// Contact points.
    Contacts,
    /// The force on the hand.
    Force,
    /// Nothing.
    None,
}

/// Joins the server and draws until told, asked or forced to end.
///
/// Blocks, and in windows wants the main thread; must not be called from within an async runtime,
/// because it owns one.
pub fn run(args: RenderArgs) -> Result<RenderReport, RenderError> {
    let limits = Limits::of(&args)?;
    let choice = GpuChoice::of(args.gpu.as_deref());
    let policy = args.membership.policy()?;

    // Without an adapter there is no use in joining the server.
    let gpu = if args.headless {
        Some(Gpu::open_with(&choice)?.smoothed(args.samples, args.out.is_some()))
    } else {
        None
    };
    let options = client_options(&args)?;
    let Some((mut session, stage, show)) = Session::join(options, policy, overrides(&args))? else {
        return Ok(RenderReport::of_nothing(&args));
    };

    // Nodes show a frame together: one whose processors sleep deeply between two frames wakes up later than the others.
    let (grant, _awake) = keep_cores_awake();
    tracing::debug!("{grant}");
    let mut timeline = Timeline::new(limits.delay_ns);
    let mut statistics = Statistics::new();
    let ended = if let Some(gpu) = gpu {
        let drawn_with = DrawnWith {
            adapter: gpu.summary().to_string(),
            present_timing: NO_WINDOW.to_owned(),
        };
        let plan = headless_plan(&args, &limits, &gpu, show);
        Canvas::new(gpu, stage)
            .and_then(|mut canvas| {
                headless::run(
                    &mut session,
                    &mut canvas,
                    &mut timeline,
                    &mut statistics,
                    &plan,
                )
            })
            .map(|ended| (ended, drawn_with))
    } else {
        let hand = match hand(&args, &stage) {
            Ok(hand) => hand,
            Err(error) => {
                session.leave();
                return Err(error);
            }
        };
        let plan = window_plan(&args, &limits, choice, show);
        window::run(
            &mut session,
            stage,
            &mut timeline,
            &mut statistics,
            plan,
            hand,
        )
    };
    finish(&args, session, &mut statistics, ended)
}

/// What the command line says of time, within its ranges.
struct Limits {
    delay_ns: u64,
    display_ns: u64,
    /// Frames per second, if they are given.
    fps: Option<f64>,
    duration: Option<Duration>,
}

impl Limits {
    fn of(args: &RenderArgs) -> Result<Self, RenderError> {
        let longest = 1e9;
        let within_if_given = |option, value: Option<f64>, least, most| match value {
            Some(value) => within(option, value, least, most).map(Some),
            None => Ok(None),
        };
        Ok(Self {
            delay_ns: (1e6 * within("--delay-ms", args.delay_ms, 0.0, MAX_DELAY_MS)?) as u64,
            fps: within_if_given("--fps", args.fps, 0.01, 1000.0)?,
            duration: within_if_given("--duration", args.duration, 0.0, longest)?
                .map(Duration::from_secs_f64),
            display_ns: (1e6 * within("--display-ms", args.display_ms, 0.0, MAX_DELAY_MS)?) as u64,
        })
    }

    fn frame_time(&self, default_fps: f64) -> Duration {
        Duration::from_secs_f64(1.0 / self.fps.unwrap_or(default_fps))
    }
}

fn client_options(args: &RenderArgs) -> Result<ClientOptions, RenderError> {
    let key = read_join_key(&args.key)?;
    let mut options =
        ClientOptions::new(args.server.as_str(), key, Role::Render, args.node.as_str());
    options.transport = args.transport.into();
    options.mesh_cache = args.membership.cache()?;
    options.priority = Some(FRAME_PRIORITY); // drawing itself stays in the class of everybody
    options.pictures = true;
    Ok(options)
}

fn overrides(args: &RenderArgs) -> Overrides {
    Overrides {
        width: args.width,
        height: args.height,
        stereo: args.stereo,
        headless: args.headless,
        pictures: args.out.is_some(),
        show: args.show.as_deref().map(listed),
        hud: args.hud,
        screen_files: args.screens.clone().unwrap_or_else(|| {
            let beside = args.key.parent();
            beside.map(PathBuf::from).unwrap_or_default()
        }),
    }
}

fn headless_plan(args: &RenderArgs, limits: &Limits, gpu: &Gpu, show: Show) -> headless::Plan {
    let default_fps = match gpu.is_software() && args.out.is_some() {
        true => WRITTEN_FPS,
        false => HEADLESS_FPS,
    };
    headless::Plan {
        frames: args.frames,
        duration: limits.duration,
        frame_time: limits.frame_time(default_fps),
        out: args.out.clone().map(|folder| (folder, args.node.clone())),
        display_ns: limits.display_ns,
        show,
        node: args.node.clone(),
    }
}

fn window_plan(args: &RenderArgs, limits: &Limits, gpu: GpuChoice, show: Show) -> window::Plan {
    window::Plan {
        frames: args.frames,
        duration: limits.duration,
        frame_time: limits.frame_time(WINDOW_FPS),
        software_frame_time: limits.frame_time(SOFTWARE_FPS),
        asked: Places {
            fullscreen: args.fullscreen,
            monitors: args.monitor.clone(),
        },
        gpu,
        samples: args.samples,
        display_ns: limits.display_ns,
        show,
        node: args.node.clone(),
    }
}

/// The hand that the mouse holds the body with, where `--hold` asks for it.
fn hand(args: &RenderArgs, stage: &Stage) -> Result<Option<Hand>, RenderError> {
    if !args.hold {
        return Ok(None);
    }
    if let Some(screen) = stage.screens.iter().find(|screen| screen.is_warped()) {
        return Err(RenderError::Option {
            option: "--hold",
            rule: "left out where a screen is warped, since the mouse would point beside it"
                .to_owned(),
            value: format!("given with the screen \"{}\"", screen.name),
        });
    }
    Hand::join(args, Hold::new(stage)).map(Some)
}

/// Tells the server what was measured, leaves it, and says it to the user.
fn finish(
    args: &RenderArgs,
    session: Session,
    statistics: &mut Statistics,
    ended: Result<(Ended, DrawnWith), RenderError>,
) -> Result<RenderReport, RenderError> {
    if let Some(stats) = statistics.report(true) {
        session.report(stats);
    }
    let (packets_lost, packets_received) = session.packets();
    let (sessions, meshes) = (session.sessions(), session.meshes());
    let to_first_frame_ms = statistics.first_frame_after(session.began());
    session.leave();
    let (ended, drawn_with) = ended?;
    let (pose_age_ms, drawn_age_ms) = statistics.ages();
    Ok(RenderReport {
        node: args.node.clone(),
        transport: args.transport.name().to_owned(),
        adapter: drawn_with.adapter,
        present_timing: drawn_with.present_timing,
        light_ms: statistics.lights(),
        unlit: statistics.unlit,
        frames: statistics.frames,
        locked_frames: statistics.locked_frames,
        stale_frames: statistics.stale_frames,
        fps: statistics.fps(),
        pose_age_ms,
        drawn_age_ms,
        packets_lost,
        packets_received,
        sessions,
        longest_gap_ms: statistics.longest_gap_ms(),
        to_first_frame_ms,
        meshes,
        ended,
    })
}

/// What drew, for the report.
#[derive(Clone, Debug)]
pub(crate) struct DrawnWith {
    pub(crate) adapter: String,
    pub(crate) present_timing: String,
}

impl RenderReport {
    /// Of a node that was asked to end before there was a server.
    fn of_nothing(args: &RenderArgs) -> Self {
        Self {
            node: args.node.clone(),
            transport: args.transport.name().to_owned(),
            ..Self::default()
        }
    }
}

/// The value if it is a number in the range.
pub(crate) fn within(
    option: &'static str,
    value: f64,
    low: f64,
    high: f64,
) -> Result<f64, RenderError> {
    let fits = low <= value && value <= high; // false for NaN
    if fits {
        return Ok(value);
    }
    Err(RenderError::Option {
        option,
        rule: format!("a number from {low} to {high}"),
        value: value.to_string(),
    })
}

fn listed(list: &[ShowArg]) -> Show {
    Show {
        ghost: list.contains(&ShowArg::Ghost),
        contacts: list.contains(&ShowArg::Contacts),
        force: list.contains(&ShowArg::Force),
        ..Show::default()
    }
}

impl From<TransportArg> for Transport {
    fn from(arg: TransportArg) -> Self {
        match arg {
            TransportArg::Udp => Self::Udp,
            TransportArg::Quic => Self::QuicDatagram,
        }
    }
}

/// The stereo modes, by the names that workbench files give them.
fn stereo_modes() -> impl TypedValueParser<Value = Stereo> {
    let mode = |name: String| Stereo::NAMED.iter().find(|named| named.0 == name);
    PossibleValuesParser::new(Stereo::NAMED.map(|(name, _)| name))
        .map(move |name| mode(name).map_or_else(Stereo::default, |named| named.1))
}

fn samples() -> impl TypedValueParser<Value = u32> {
    PossibleValuesParser::new(["1", "4"]).map(|samples| if samples == "1" { 1 } else { SMOOTH })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: RenderArgs,
    }

    fn parse(rest: &[&str]) -> Result<RenderArgs, clap::Error> {
        let always = [
            "taut-render",
            "--server",
            "h:1",
            "--node",
            "n",
            "--key",
            "k",
        ];
        Line::try_parse_from(always.iter().chain(rest)).map(|line| line.args)
    }

    #[test]
    fn a_list_of_marks_is_taken_apart() {
        let args = parse(&["--show", "ghost,force"]).expect("valid");
        let show = listed(&args.show.expect("given"));
        assert_eq!((show.ghost, show.contacts, show.force), (true, false, true));
    }

    #[test]
    fn pictures_are_only_written_off_screen() {
        assert!(parse(&["--out", "pictures"]).is_err());
        assert!(parse(&["--headless", "--out", "pictures"]).is_ok());
    }

    #[test]
    fn numbers_that_make_no_sense_are_refused_by_the_option_s_name() {
        for (option, value) in [
            ("--fps", "0"),
            ("--fps", "NaN"),
            ("--delay-ms", "-1"),
            ("--duration", "inf"),
        ] {
            let args = parse(&[&format!("{option}={value}"), "--headless"]).expect("a number");
            let error = run(args).expect_err("out of range").to_string();
            assert!(error.starts_with(option), "{error}");
        }
    }
}
