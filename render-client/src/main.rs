//! `taut-render`: one node of the render cluster, for machines that need nothing else of taut.
#![forbid(unsafe_code)]

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::Parser;
use taut_render::cli::{RenderArgs, run};
use tracing_subscriber::EnvFilter;

/// Draws one node of a taut workbench.
#[derive(Parser)]
#[command(
    version,
    after_help = "Example: taut-render --server haptic-pc:4857 --node wall --key render-wall.key"
)]
struct CommandLine {
    #[command(flatten)]
    args: RenderArgs,
}

fn main() -> ExitCode {
    let command_line = CommandLine::parse();
    let filter = EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| EnvFilter::new("warn,taut_render=info"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .init();
    match run(command_line.args) {
        Ok(report) => {
            println!("{report}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
