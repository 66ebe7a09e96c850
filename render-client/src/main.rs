//! `taut-render`: one node of the render cluster, for machines that need nothing else of taut.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::Parser;
use taut_render::cli::{RenderArgs, run};

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
    taut_render::restart_with_runtime_directory();
    taut_log::start("warn,taut_render=info");
    let code = match run(command_line.args) {
        Ok(report) => {
            let is_written = taut_bridge::console::report(report.to_string());
            ExitCode::from(u8::from(!is_written))
        }
        Err(error) => {
            taut_log::say(&format!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    };
    taut_log::flush();
    code
}
