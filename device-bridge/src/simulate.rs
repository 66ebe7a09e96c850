//! `simulate-device`: a process that speaks a device's wire and closes the loop with a simulated arm and hand, for drivers and for whoever
//! has no device at hand.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
#[cfg(unix)]
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use serde::Serialize;
use taut_plant::{Hand, MinJerkPath, Tremor};

use crate::console;
use crate::devices::HandPreset;
use crate::haply::{HaplyService, SimulatedInverse, SimulatedSettings};
use crate::realtime::monotonic_now;
use crate::signals::EndFlag;
use crate::trace_file::{TraceFileError, read_path};

/// How often the end is looked for.
const LOOK: Duration = Duration::from_millis(20);

/// Play a device: speak its wire, with a simulated arm in a simulated hand.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: taut simulate-device haply --hand firm")]
pub struct SimulateArgs {
    /// Which device.
    #[command(subcommand)]
    device: Played,

    /// End after this many seconds (default: at Ctrl-C).
    #[arg(long, value_name = "S", global = true)]
    duration: Option<f64>,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum Played {
    /// Haply's Inverse service with one arm and a wireless VerseGrip
    Haply(PlayedHaply),
    /// SPIDAR's UART motor boards with strings and grip, on a pseudo-terminal
    #[cfg(unix)]
    Spidar(PlayedSpidar),
    /// A Polhem arm's text board, on a pseudo-terminal
    #[cfg(unix)]
    Polhem(PlayedPolhem),
    /// A WoodenHaptics arm's HID board, on a socket
    #[cfg(unix)]
    Wooden(PlayedWooden),
}

#[derive(Clone, Debug, clap::Args)]
struct PlayedHaply {
    /// Where the service listens; port 0 takes a free one.
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:10001")]
    bind: SocketAddr,

    /// Without a grip: the orientation is not measured.
    #[arg(long)]
    no_grip: bool,

    #[command(flatten)]
    hand: PlayedHand,
}

#[cfg(unix)]
#[derive(Clone, Debug, clap::Args)]
struct PlayedSpidar {
    /// A name for the pseudo-terminal; without it the system's own, which is printed.
    #[arg(long, value_name = "FILE")]
    link: Option<PathBuf>,

    /// Geometry of the strings: a shipped one or a file.
    #[arg(long, value_name = "NAME|FILE", default_value = "g6x4r")]
    geometry: String,

    /// One board of eight motors instead of two of four.
    #[arg(long)]
    one_board: bool,

    #[command(flatten)]
    hand: PlayedHand,
}

#[cfg(unix)]
#[derive(Clone, Debug, clap::Args)]
struct PlayedPolhem {
    /// A name for the pseudo-terminal; without it the system's own, which is printed.
    #[arg(long, value_name = "FILE")]
    link: Option<PathBuf>,

    #[command(flatten)]
    hand: PlayedHand,
}

#[cfg(unix)]
#[derive(Clone, Debug, clap::Args)]
struct PlayedWooden {
    /// Name of the socket.
    #[arg(long, value_name = "FILE", default_value = "/tmp/taut-wooden")]
    socket: PathBuf,

    /// Which arm, as in `--device wooden,model=NAME`.
    #[arg(long, value_name = "NAME", default_value = "woodenhaptics-2019")]
    model: String,

    #[command(flatten)]
    hand: PlayedHand,
}

/// Who holds it.
#[derive(Clone, Debug, clap::Args)]
struct PlayedHand {
    /// Hand that holds it: released, light, firm or arm.
    #[arg(long, value_name = "HAND", default_value_t)]
    hand: HandPreset,

    /// Intention of the hand: via points in the format of a trace, in the device's axes. Without it, its own way of touching.
    #[arg(long, value_name = "FILE")]
    path: Option<PathBuf>,

    /// Seed of the hand's tremor.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

impl PlayedHand {
    /// The hand, where it goes, and its tremor.
    fn held(&self) -> Result<(Hand, Option<MinJerkPath>, Option<Tremor>), TraceFileError> {
        let path = self.path.as_ref().map(|file| read_path(file, true));
        let tremor = Tremor::new(Tremor::TYPICAL_RMS, self.seed);
        Ok((self.hand.into(), path.transpose()?, Some(tremor)))
    }
}

#[derive(Debug, thiserror::Error)]
enum SimulateError {
    #[error(
        "cannot listen at {address}: {cause}; give another by --bind, or end what listens there"
    )]
    Bind {
        address: SocketAddr,
        cause: std::io::Error,
    },
    #[error(transparent)]
    File(#[from] TraceFileError),
    #[cfg(unix)]
    #[error(transparent)]
    Geometry(#[from] crate::simulated_strings::StringsError),
    #[cfg(unix)]
    #[error(transparent)]
    Boards(#[from] crate::spidar_uart::BoardsError),
    #[cfg(unix)]
    #[error("no pseudo-terminal can be had: {0}; name a file that can be made by --link")]
    Terminal(std::io::Error),
    #[cfg(unix)]
    #[error("{path}: {cause}; name a file that can be made by --socket", path = path.display())]
    Socket {
        path: PathBuf,
        cause: std::io::Error,
    },
    #[cfg(unix)]
    #[error("there is no model `{0}`; `taut bridge --device wooden,model=?` names them")]
    Model(String),
    #[error("--duration is {0}, which is out of range; use 0 to 1e9 s")]
    Duration(f64),
    #[error("signals cannot be listened to ({0}); end other programs or raise the limits")]
    Signals(std::io::Error),
    #[error("standard output cannot be written: {0}")]
    Output(std::io::Error),
}

/// What a played device tells at its end.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
enum PlayedReport {
    Haply {
        sessions: u64,
        messages: u64,
        largest_force_n: f64,
    },
    #[cfg(unix)]
    Spidar { cycles: u64, digits: [i16; 8] },
    #[cfg(unix)]
    Wooden { reports: u64, largest_force_n: f64 },
    #[cfg(unix)]
    Polhem { lines: u64, largest_force_n: f64 },
}

/// Plays a device as a process: where it can be found as the first line on standard output, a report in JSON as the last. Returns the exit
/// code: 0 done, 2 bad input.
#[must_use]
pub fn execute_simulation(args: &SimulateArgs) -> ExitCode {
    match play(args) {
        Ok(report) => {
            let text = serde_json::to_string(&report);
            let is_written = text.is_ok_and(console::report);
            ExitCode::from(u8::from(!is_written))
        }
        Err(error) => {
            taut_log::say(&format!("taut: {error}"));
            ExitCode::from(2)
        }
    }
}

fn play(args: &SimulateArgs) -> Result<PlayedReport, SimulateError> {
    let deadline = match args.duration {
        None => None,
        Some(seconds) if (0.0..=1e9).contains(&seconds) => {
            Some(monotonic_now() + Duration::from_secs_f64(seconds))
        }
        Some(seconds) => return Err(SimulateError::Duration(seconds)),
    };
    let end = EndFlag::listen().map_err(SimulateError::Signals)?;
    let over = || end.is_asked() || deadline.is_some_and(|deadline| monotonic_now() >= deadline);
    match &args.device {
        Played::Haply(haply) => play_haply(haply, over),
        #[cfg(unix)]
        Played::Spidar(spidar) => play_spidar(spidar, over),
        #[cfg(unix)]
        Played::Polhem(polhem) => play_polhem(polhem, over),
        #[cfg(unix)]
        Played::Wooden(wooden) => play_wooden(wooden, over),
    }
}

/// Says where the device is, and lets it play until it is over.
fn play_until(over: impl Fn() -> bool, place: String) -> Result<(), SimulateError> {
    console::print(place).map_err(SimulateError::Output)?;
    while !over() {
        thread::sleep(LOOK);
    }
    Ok(())
}

fn play_haply(args: &PlayedHaply, over: impl Fn() -> bool) -> Result<PlayedReport, SimulateError> {
    let (hand, path, tremor) = args.hand.held()?;
    let settings = SimulatedSettings {
        hand,
        path,
        tremor,
        with_grip: !args.no_grip,
    };
    let service = HaplyService::start(args.bind, SimulatedInverse::new(&settings));
    let service = service.map_err(|cause| SimulateError::Bind {
        address: args.bind,
        cause,
    })?;
    play_until(
        over,
        format!(
            "a simulated Inverse service listens at {}; read it by: taut bridge --device haply={}",
            service.address(),
            service.address()
        ),
    )?;
    let totals = service.totals();
    Ok(PlayedReport::Haply {
        sessions: totals.sessions,
        messages: totals.messages,
        largest_force_n: totals.largest_force,
    })
}

#[cfg(unix)]
fn play_spidar(
    args: &PlayedSpidar,
    over: impl Fn() -> bool,
) -> Result<PlayedReport, SimulateError> {
    use crate::pseudo_terminal::PseudoTerminal;
    use crate::spidar_uart::SimulatedBoards;

    let geometry = crate::simulated_strings::string_geometry(&args.geometry)?;
    let (hand, path, tremor) = args.hand.held()?;
    let boards = SimulatedBoards::new(&geometry, hand, path, tremor, args.one_board, [0; 8])?;
    let terminal = PseudoTerminal::start(Arc::new(Mutex::new(boards)), args.link.as_deref());
    let terminal = terminal.map_err(SimulateError::Terminal)?;
    let path = terminal.place();
    play_until(
        over,
        format!(
            "simulated motor boards are at {path}; read them by: taut bridge --device spidar:{path}"
        ),
    )?;
    let boards = terminal.device();
    Ok(PlayedReport::Spidar {
        cycles: boards.cycles(),
        digits: *boards.digits(),
    })
}

#[cfg(unix)]
fn play_polhem(
    args: &PlayedPolhem,
    over: impl Fn() -> bool,
) -> Result<PlayedReport, SimulateError> {
    use crate::polhem::SimulatedPolhem;
    use crate::pseudo_terminal::PseudoTerminal;

    let (hand, path, tremor) = args.hand.held()?;
    let arm = SimulatedPolhem::new(hand, path, tremor);
    let terminal = PseudoTerminal::start(Arc::new(Mutex::new(arm)), args.link.as_deref());
    let terminal = terminal.map_err(SimulateError::Terminal)?;
    let path = terminal.place();
    play_until(
        over,
        format!(
            "a simulated Polhem board is at {path}; read it by: taut bridge --device polhem:{path}"
        ),
    )?;
    let arm = terminal.device();
    Ok(PlayedReport::Polhem {
        lines: arm.lines(),
        largest_force_n: arm.held().largest_force(),
    })
}

#[cfg(unix)]
fn play_wooden(
    args: &PlayedWooden,
    over: impl Fn() -> bool,
) -> Result<PlayedReport, SimulateError> {
    use crate::wooden::{SimulatedWooden, WoodenModel, WoodenService};

    let model = WoodenModel::named(&args.model);
    let model = model.ok_or_else(|| SimulateError::Model(args.model.clone()))?;
    let (hand, path, tremor) = args.hand.held()?;
    let arm = SimulatedWooden::new(model, hand, path, tremor);
    let service = WoodenService::start(Arc::new(Mutex::new(arm)), &args.socket);
    let service = service.map_err(|cause| SimulateError::Socket {
        path: args.socket.clone(),
        cause,
    })?;
    let (path, name) = (args.socket.display(), model.name);
    play_until(
        over,
        format!(
            "a simulated {name} is at {path}; read it by: taut bridge --device wooden={path},model={name}"
        ),
    )?;
    let arm = service.arm();
    Ok(PlayedReport::Wooden {
        reports: arm.reports(),
        largest_force_n: arm.held().largest_force(),
    })
}
