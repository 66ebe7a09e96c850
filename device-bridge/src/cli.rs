//! The arguments of `taut bridge`, and what its process prints and returns.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use taut_kinds::device_help;
use taut_link::Transport;

use crate::bridge::{BridgeError, run};
use crate::choice::DeviceChoice;
use crate::console;
use crate::devices::HandPreset;
use crate::port::{ContactBound, Passivity, PassivitySettings, Rearm, SafetySettings};

/// Read a device, send its poses to the server and render the forces that come back.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = device_help() + "\nExample: taut bridge --server haptic-pc:4857 --key device.key --device simulated --hand firm --path reach.csv --loop"
)]
pub struct BridgeArgs {
    /// Server, as host:port.
    #[arg(long, value_name = "H:P")]
    pub server: String,

    /// File of the device's credential, or of the cluster key; without it the one that the environment variable TAUT_KEY_FILE names.
    #[arg(long, value_name = "FILE")]
    pub key: Option<PathBuf>,

    /// Name of this node, unique in the workbench.
    #[arg(long, value_name = "NAME", default_value = "bridge")]
    pub node: String,

    /// Device: `simulated`, `trace:FILE`, `haply`, `space-mouse`, `vrpn:TRACKER@HOST`; options below.
    #[arg(long, value_name = "D", default_value = "simulated")]
    pub device: DeviceChoice,

    /// Hand that holds the simulated device: released, light, firm or arm.
    #[arg(long, value_name = "HAND", default_value_t)]
    pub hand: HandPreset,

    /// Intention of the simulated hand: via points in the format of a trace, passed by minimum-jerk
    /// movements. Without it the hand sways gently around the start pose.
    #[arg(long, value_name = "FILE")]
    pub path: Option<PathBuf>,

    /// Start the path or the trace again at its end.
    #[arg(long = "loop")]
    pub looping: bool,

    /// Seed of the simulated hand's tremor.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,

    /// Rate of the device loop, in Hz.
    #[arg(long, value_name = "HZ", default_value_t = 1000.0)]
    pub rate: f64,

    /// End after this many seconds; without it, run until told to stop.
    #[arg(long, value_name = "S")]
    pub duration: Option<f64>,

    /// How the hot plane travels: `udp`, or `quic` where only one port is open.
    #[arg(long, value_name = "T", default_value = "udp", value_parser = parse_transport)]
    pub transport: Transport,

    /// Where the force is computed: `edge`, beside the device, so that it never waits for the network; or `server`. Without it, edge
    /// where the server offers that.
    #[arg(long, value_name = "WHERE", value_enum)]
    pub coupling: Option<CouplingChoice>,

    /// Stay when the server stops, and wait for one that is not there yet: for a bridge that runs as a service.
    #[arg(long, alias = "reconnect")]
    pub stay: bool,

    /// End when there was no server for this many seconds [default: a bridge whose link is lost tries for ever, without force].
    #[arg(long, value_name = "S")]
    pub give_up: Option<f64>,

    /// Real-time priority of the device loop, 1 to 99; 0 asks for no real time at all.
    #[arg(long, value_name = "P", default_value_t = 80, value_parser = clap::value_parser!(u8).range(0..=99))]
    pub priority: u8,

    /// Core for the device loop, counted from 0.
    #[arg(long, value_name = "CORE")]
    pub core: Option<usize>,

    /// Print the end report as JSON on standard output.
    #[arg(long)]
    pub json: bool,

    /// Limits of the force.
    #[command(flatten)]
    pub safety: SafetyArgs,
}

/// Where the force is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum CouplingChoice {
    /// Beside the device, from constraint sets.
    Edge,
    /// At the server; the force travels.
    Server,
}

/// What no force may pass: docs/safety.md.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Safety")]
pub struct SafetyArgs {
    /// Largest norm of the force, in N; the device's own limit holds too.
    #[arg(long, value_name = "N", default_value_t = 20.0)]
    pub max_force: f64,

    /// Largest norm of the torque, in N m; the device's own limit holds too.
    #[arg(long, value_name = "NM", default_value_t = 0.5)]
    pub max_torque: f64,

    /// Fastest change of the force, in N per ms, beside what the device's motion explains.
    #[arg(long, value_name = "N/MS", default_value_t = SafetySettings::FORCE_RATE * 1e-3)]
    pub force_slew: f64,

    /// Fastest change of the torque, in N m per ms, the same.
    #[arg(long, value_name = "NM/MS", default_value_t = SafetySettings::TORQUE_RATE * 1e-3)]
    pub torque_slew: f64,

    /// Stiffest contact that is felt as it is met, in N/m: what the device's motion explains of a change of the force, beside --force-slew. 0
    /// explains nothing; the device's own limit holds too.
    #[arg(long, value_name = "N/M", default_value_t = ContactBound::default().stiffness)]
    pub contact_stiffness: f64,

    /// Who arms at the start, after a fault and after an outage: automatic or manual (console, button). Without it a simulated device and one
    /// without motors arm by themselves, and any other waits for a person.
    #[arg(long, value_name = "WHO", value_parser = parse_rearm)]
    pub rearm: Option<Rearm>,

    /// Button, counted from 0, that must be held for any force.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..16))]
    pub dead_man: Option<u8>,

    /// Button, counted from 0, whose press arms.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..16))]
    pub arm_button: Option<u8>,

    /// What is done about energy that comes out of the device, as a delayed force puts it in: control damps it away, observe reports it.
    #[arg(long, value_name = "WHAT", default_value = "control", value_parser = parse_passivity)]
    pub passivity: Passivity,
}

impl SafetyArgs {
    /// As the port takes them. `nobody_is_hurt` by the device if it arms by itself.
    pub(crate) fn settings(&self, rate_hz: f64, nobody_is_hurt: bool) -> SafetySettings {
        let default = SafetySettings::default();
        SafetySettings {
            max_force: self.max_force,
            max_torque: self.max_torque,
            force_rate: self.force_slew * 1e3,
            torque_rate: self.torque_slew * 1e3,
            contact: ContactBound {
                stiffness: self.contact_stiffness,
                ..ContactBound::default()
            },
            period: Duration::from_secs_f64(rate_hz.recip()),
            rearm: self.rearm.unwrap_or(if nobody_is_hurt {
                Rearm::Automatic
            } else {
                Rearm::Manual
            }),
            dead_man: self.dead_man,
            arm_button: self.arm_button,
            passivity: PassivitySettings {
                mode: self.passivity,
                ..default.passivity
            },
            ..default
        }
    }
}

fn parse_rearm(text: &str) -> Result<Rearm, String> {
    match text {
        "automatic" => Ok(Rearm::Automatic),
        "manual" => Ok(Rearm::Manual),
        _ => Err(format!(
            "nobody called `{text}` arms; use automatic or manual"
        )),
    }
}

fn parse_passivity(text: &str) -> Result<Passivity, String> {
    match text {
        "control" => Ok(Passivity::Control),
        "observe" => Ok(Passivity::Observe),
        _ => Err(format!(
            "passivity cannot be `{text}`; use control or observe"
        )),
    }
}

impl BridgeArgs {
    /// The arguments in the words of a command line, the program's name first.
    ///
    /// # Errors
    /// Words that `taut bridge` does not take, told as on a command line.
    pub fn of_words<W: Into<OsString> + Clone>(
        words: impl IntoIterator<Item = W>,
    ) -> Result<Self, clap::Error> {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            args: BridgeArgs,
        }
        <Line as clap::Parser>::try_parse_from(words).map(|line| line.args)
    }

    /// The arguments of `taut bridge --server SERVER --node NODE`, all others as when they are left out.
    #[must_use]
    pub fn joining(server: &str, node: &str) -> Option<Self> {
        let server = format!("--server={server}");
        let node = format!("--node={node}");
        Self::of_words(["taut-bridge", &server, &node]).ok()
    }
}

fn parse_transport(text: &str) -> Result<Transport, String> {
    match text {
        "udp" => Ok(Transport::Udp),
        "quic" => Ok(Transport::QuicDatagram),
        _ => Err(format!("there is no transport `{text}`; use udp or quic")),
    }
}

/// Runs a bridge as a process: report on standard output, one sentence per mistake on standard error. Returns the exit
/// code: 0 done or the server stopped, 1 the server was lost, 2 bad input.
#[must_use]
pub fn execute(args: &BridgeArgs) -> ExitCode {
    let (report, code) = match run(args) {
        Ok(report) => (Some(report), ExitCode::SUCCESS),
        Err(error) => {
            taut_log::say(&format!("taut: {error}"));
            let code = ExitCode::from(error.exit_code());
            match error {
                BridgeError::ServerLost { report, .. } => (Some(*report), code),
                _ => (None, code),
            }
        }
    };
    if let Some(report) = report {
        let text = if args.json {
            serde_json::to_string_pretty(&report).map_err(|error| error.to_string())
        } else {
            Ok(report.to_string())
        };
        let written = text.map(console::report).unwrap_or_else(|error| {
            taut_log::say(&format!("the report cannot be written as JSON: {error}"));
            false
        });
        if !written && code == ExitCode::SUCCESS {
            return ExitCode::FAILURE;
        }
    }
    code
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(words: &[&str]) -> Result<BridgeArgs, clap::Error> {
        BridgeArgs::of_words(["taut-bridge"].iter().chain(words))
    }

    #[test]
    fn a_server_alone_is_enough() {
        let args = parse(&["--server", "pc:4857"]).expect("valid");
        assert_eq!(args.device, DeviceChoice::Simulated { strings: None });
        assert_eq!(args.hand, HandPreset::Light);
        assert_eq!((args.rate, args.transport), (1000.0, Transport::Udp));
        assert_eq!(args.coupling, None);
        assert_eq!(args.safety.passivity, Passivity::Control);
        let args = parse(&["--server", "pc:1", "--coupling", "edge"]).expect("valid");
        assert_eq!(args.coupling, Some(CouplingChoice::Edge));
    }

    #[test]
    fn arguments_can_be_made_without_a_command_line() {
        let args = BridgeArgs::joining("pc:4857", "wall-hand").expect("valid");
        assert_eq!(
            (args.server.as_str(), args.node.as_str()),
            ("pc:4857", "wall-hand")
        );
        assert_eq!(args.rate, 1000.0);
    }

    #[test]
    fn devices_hands_and_transports_are_named() {
        let args = parse(&[
            "--server",
            "pc:1",
            "--device",
            "trace:a.csv",
            "--hand",
            "firm",
            "--transport",
            "quic",
        ])
        .expect("valid");
        assert_eq!(args.device, DeviceChoice::Trace("a.csv".into()));
        assert_eq!(
            (args.hand, args.transport),
            (HandPreset::Firm, Transport::QuicDatagram)
        );
    }

    #[test]
    fn a_wrong_word_is_answered_with_the_right_ones() {
        for (words, part) in [
            (["--device", "simulator"], "did you mean `simulated`?"),
            (["--device", "trace:"], "write trace:FILE"),
            (["--hand", "fist"], "use released, light, firm or arm"),
            (["--transport", "tcp"], "use udp or quic"),
            (["--rearm", "never"], "use automatic or manual"),
            (["--passivity", "on"], "use control or observe"),
        ] {
            let words = ["--server", "pc:1", words[0], words[1]];
            let error = parse(&words).expect_err("a wrong word").to_string();
            assert!(error.contains(part), "{error}");
        }
        assert!(parse(&[]).is_err(), "a server must be named");
    }
}
