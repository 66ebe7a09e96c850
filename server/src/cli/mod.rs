//! The command line of `taut`: one sub-command per role; none prints what to start with.

mod offline;
mod session;
mod setup;
mod values;

use std::sync::LazyLock;

use clap::{Parser, Subcommand};

pub use offline::{
    CalibrateArgs, CheckArgs, DoctorArgs, ExportArgs, ImportArgs, MethodChoice, PREVIEW_SIZE,
    PreviewArgs, ReplayArgs, SolverChoice,
};
pub use session::{
    ArmArgs, DemoArgs, MembershipArgs, PushWrenchArgs, RecordArgs, ServeArgs, TrackArgs,
    TransportChoice,
};
pub use setup::{CompletionsArgs, DeployArgs, KeysArgs, ManArgs, SetupArgs};

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

#[cfg(test)]
mod tests {
    use super::offline::REPLAY_HELP;
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
    fn no_command_makes_a_file_that_is_called_like_standard_output() {
        for words in [
            "replay --scene a --trace b --out",
            "export a --out",
            "record --server a:1 --out",
            "import a.stl --out",
            "doctor --device wb --out",
            "keys --out",
            "setup --out",
            "deploy a.toml --out",
        ] {
            let read = |out| {
                let words = words.split(' ').chain([out]);
                Cli::try_parse_from(["taut"].into_iter().chain(words))
            };
            let Err(error) = read("-") else {
                panic!("{words} -");
            };
            assert!(error.to_string().contains("./- if"), "{error}");
            if let Err(error) = read("./-") {
                panic!("{error}");
            }
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
