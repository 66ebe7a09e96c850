//! `taut-bridge`: the device side alone, for a machine that needs nothing else of taut.

use std::io::IsTerminal;
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
    taut_bridge::console::take_panics();
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("info"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(|| taut_bridge::console::Lines)
        .with_ansi(std::io::stderr().is_terminal())
        .init();
    taut_bridge::execute(&cli.bridge)
}
