//! Why a bridge did not run, or did not run to its end.

use taut_link::LinkError;
use taut_link::proto::SceneDescription;

use crate::choice::InputError;
use crate::cli::BridgeArgs;
use crate::edge::OfferError;
use crate::own_thread::ThreadError;
use crate::report::BridgeReport;
use crate::simulated_strings::StringsError;
use crate::trace_file::TraceFileError;

/// Why a bridge did not run, or did not run to its end.
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// No key file was named.
    #[error(
        "no credential is named: give the device's, which `taut keys` made on the haptic PC, by --key FILE or TAUT_KEY_FILE"
    )]
    NoKey,
    /// A number on the command line is out of range.
    #[error("{option} is {value}, which is out of range; use {range}")]
    OutOfRange {
        /// The option.
        option: &'static str,
        /// What was given.
        value: f64,
        /// What may be given.
        range: &'static str,
    },
    /// A trace or path file is wrong, or cannot be followed.
    #[error(transparent)]
    File(#[from] TraceFileError),
    /// An input device cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A simulated string-driven device cannot be made.
    #[error(transparent)]
    Strings(#[from] StringsError),
    /// The mouse is none of a bridge's.
    #[error("the mouse belongs to a render window: use `taut render --hold` instead of a bridge")]
    Mouse,
    /// The server cannot be joined.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Nobody would hear the user's wish to end.
    #[error("signals cannot be listened to ({0}); end other programs or raise the limits")]
    Signals(std::io::Error),
    /// The server's scene has no valid start pose.
    #[error(
        "the server's scene has a start pose that is no pose; check the scene with `taut check`"
    )]
    NoStartPose,
    /// The server does not let the bridge couple.
    #[error(
        "the server couples by itself ({0}): leave out `--coupling edge`, and keep the network short"
    )]
    NoEdge(String),
    /// The server's offer makes no coupling.
    #[error(transparent)]
    Offer(#[from] OfferError),
    /// A thread cannot be started.
    #[error(transparent)]
    Thread(#[from] ThreadError),
    /// The end was asked for before there was a server.
    #[error(
        "no server was there at {server} until the end: check that it runs, the address, and that the firewall lets UDP through"
    )]
    NeverJoined {
        /// As given.
        server: String,
        /// Whether it was to be waited for without end.
        stays: bool,
    },
    /// The server came back with a scene in which the device stands elsewhere.
    #[error(
        "the server {server} came back with another scene ({scene}), and this device finds its place when it is opened: the force is zero; start the bridge again, strings with the grip at the centre, an arm on a HID board at its home"
    )]
    OtherScene {
        /// As given.
        server: String,
        /// Name of the scene.
        scene: String,
    },
    /// The device loop panicked.
    #[error("the device loop broke down; report this, with the lines above")]
    LoopBroke,
    /// The server went away while the bridge ran.
    #[error(
        "the server {server} was lost ({reason}): the force is zero; start it again, or let this bridge wait longer (--give-up)"
    )]
    ServerLost {
        /// As given.
        server: String,
        /// Why.
        reason: String,
        /// What was seen until then.
        report: Box<BridgeReport>,
    },
}

impl BridgeError {
    pub(super) fn other_scene(args: &BridgeArgs, scene: &SceneDescription) -> Self {
        Self::OtherScene {
            server: args.server.clone(),
            scene: scene.name.to_string(),
        }
    }

    /// Exit code of the process: 0 ended as asked, 1 failed, 2 bad input.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Thread(_) | Self::Signals(_) => 1,
            // Who waits for a server without end has done so.
            Self::NeverJoined { stays, .. } => u8::from(!stays),
            Self::LoopBroke => 1,
            Self::ServerLost { .. } | Self::OtherScene { .. } => 1,
            _ => 2,
        }
    }
}
