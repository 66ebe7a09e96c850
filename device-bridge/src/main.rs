//! `taut-bridge`: the device side alone, for a machine that needs nothing else of taut.

use std::process::ExitCode;

use clap::Parser;

/// The device side of taut: reads a device, sends its poses, renders the forces that come back.
#[derive(Parser)]
#[command(
    name = "taut-bridge",
    version,
    after_help = "taut-bridge simulate-device plays a device; see its --help."
)]
struct Cli {
    #[command(flatten)]
    bridge: taut_bridge::BridgeArgs,
}

/// What `taut-bridge simulate-device` takes: a process that plays a device, for a bridge or for any other program.
#[derive(Parser)]
#[command(name = "taut-bridge simulate-device")]
struct Simulate {
    #[command(flatten)]
    args: taut_bridge::SimulateArgs,
}

fn main() -> ExitCode {
    let mut words = std::env::args_os();
    let program = words.next();
    if words.next().is_some_and(|word| word == "simulate-device") {
        let simulate = Simulate::parse_from(program.into_iter().chain(words));
        taut_log::start("info");
        return ended(taut_bridge::execute_simulation(&simulate.args));
    }
    let cli = Cli::parse();
    taut_log::start("info");
    ended(taut_bridge::execute(&cli.bridge))
}

fn ended(code: ExitCode) -> ExitCode {
    taut_log::flush();
    code
}
