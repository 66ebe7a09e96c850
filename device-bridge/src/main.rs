//! `taut-bridge`: the device side alone, for a machine that needs nothing else of taut.

use std::process::ExitCode;

use clap::Parser;

/// The device side of taut: reads a device, sends its poses, renders the forces that come back.
#[derive(Parser)]
#[command(name = "taut-bridge", version)]
struct Cli {
    #[command(flatten)]
    bridge: taut_bridge::BridgeArgs,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    taut_log::start("info");
    let code = taut_bridge::execute(&cli.bridge);
    taut_log::flush();
    code
}
