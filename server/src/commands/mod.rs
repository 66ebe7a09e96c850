//! The sub-commands: one file or folder each, and what only they need.
//!
//! `taut render` and `taut bridge` are the libraries `taut-render` and `taut-bridge`; `taut check` is `taut_scene::check` and more.

pub mod arguments;
pub mod arm;
#[cfg(feature = "render")]
mod calibrate;
#[cfg(not(feature = "render"))]
#[path = "calibrate_absent.rs"]
mod calibrate;
mod check;
mod demo;
mod deploy;
mod doctor;
pub mod edit;
mod export;
mod import;
mod key;
mod keys;
mod live_scene;
mod manual;
#[cfg(feature = "render")]
mod preview;
#[cfg(not(feature = "render"))]
#[path = "preview_absent.rs"]
mod preview;
pub mod push_wrench;
mod record;
mod recording_size;
pub(crate) mod render;
pub mod replay;
mod sending;
mod serve;
mod setup;
mod signals;
pub mod track;

use std::fmt::Display;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;
use serde::Serialize;
use taut_bridge::console;

use crate::cli::{CheckArgs, Cli, Command, DoctorArgs, FIRST_STEPS, ReplayArgs};
use crate::report::SessionReport;
use crate::shared::failure::{EXIT_BAD_INPUT, EXIT_FAILED, Failure};
use crate::shared::shutdown::Shutdown;

/// The program: reads the command line, runs the command, and says why it failed.
pub fn main() -> ExitCode {
    // Before any key is read. Where the system has no such thing, the file's mode is all there is.
    taut_link::keep_memory_private();
    let cli = Cli::parse();
    let draws = matches!(
        cli.command,
        Some(
            Command::Render(_)
                | Command::Doctor(_)
                | Command::Preview(_)
                | Command::Import(_)
                | Command::Calibrate(_)
        )
    );
    if draws {
        render::restart_with_runtime_directory();
    }
    taut_log::start("warn");
    let done = match cli.command {
        Some(command) => run(command),
        None => print(FIRST_STEPS),
    };
    let code = match done {
        Ok(code) => code,
        Err(error) => {
            taut_log::say(&format!("taut: {error:#}"));
            ExitCode::from(
                error
                    .downcast_ref::<Failure>()
                    .map_or(EXIT_FAILED, Failure::exit_code),
            )
        }
    };
    taut_log::flush();
    code
}

fn run(command: Command) -> Result<ExitCode> {
    match command {
        Command::Demo(args) => end_session(demo::run(&args)?, args.json, args.histogram),
        Command::Serve(args) => end_session(serve::run(&args)?, args.json, args.histogram),
        Command::Render(args) => {
            render::run(args)?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Bridge(args) => Ok(taut_bridge::execute(&args)),
        Command::SimulateDevice(args) => Ok(taut_bridge::execute_simulation(&args)),
        Command::Replay(args) => match &args.recording {
            Some(directory) => recorded_command(directory, &args),
            None => tell(&replay::run(&args)?, args.json),
        },
        Command::Record(args) => {
            let (out, rows) = network(2, record::run(&args))?;
            print(format!("{}: {rows} samples", out.display()))
        }
        Command::Export(args) => tell(&export::run(&args)?, args.json),
        Command::Arm(args) => print(network(1, arm::run(&args))?),
        Command::Edit(args) => print(edit::run(&args)?),
        Command::Check(args) => check_command(&args),
        Command::Import(args) => tell(&import::run(&args)?, args.json),
        Command::Preview(args) => print(preview::run(&args)?.join("\n")),
        Command::Calibrate(args) => match calibrate::run(&args)? {
            written if written.is_empty() => Ok(ExitCode::SUCCESS),
            written => print(written.join("\n")),
        },
        Command::Doctor(args) => doctor_command(&args),
        Command::Track(args) => {
            let sent = network(1, track::run(&args))?;
            print(format!(
                "{sent} readings of the head sent to {}",
                args.server
            ))
        }
        Command::PushWrench(args) => {
            let sent = network(1, push_wrench::run(&args))?;
            print(format!("{sent} wrenches sent to {}", args.server))
        }
        Command::Keys(args) => print(keys::run(&args)?),
        Command::Setup(args) => {
            let (input, output) = (std::io::stdin().lock(), std::io::stdout().lock());
            print(setup::run(&args, input, output)?)
        }
        Command::Deploy(args) => print(deploy::run(&args)?),
        Command::Completions(args) => print(manual::completions(args.shell)?),
        Command::Man(args) => print(manual::write_pages(&args.out)?),
    }
}

fn end_session(
    (report, failure): (SessionReport, Option<Failure>),
    json: bool,
    histogram: bool,
) -> Result<ExitCode> {
    let printed = console::report(match (json, histogram) {
        (true, _) => as_json(&report)?,
        (false, true) => format!("{report}{}", report.histogram()),
        (false, false) => report.to_string(),
    });
    match failure {
        Some(failure) => Err(failure.into()),
        None if printed => Ok(ExitCode::SUCCESS),
        None => Ok(ExitCode::FAILURE),
    }
}

/// A report on standard output, for programs or for people.
fn tell<R: Serialize + Display>(report: &R, json: bool) -> Result<ExitCode> {
    print(if json {
        as_json(report)?
    } else {
        report.to_string()
    })
}

/// What comes of a command that only speaks over the network.
fn network<T>(threads: usize, command: impl Future<Output = Result<T, Failure>>) -> Result<T> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(threads)
        .enable_all()
        .build()
        .context("the network's threads cannot be started")?;
    Ok(runtime.block_on(command)?)
}

/// A session computed again must come to the same: a difference is a failure.
fn recorded_command(directory: &Path, args: &ReplayArgs) -> Result<ExitCode> {
    let interrupted = Shutdown::by_signals()?;
    let report = replay::recorded::run(directory, args.out.as_deref(), args.timings, &interrupted)?;
    tell(&report, args.json)?;
    Ok(if report.first_difference.is_none() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(EXIT_FAILED)
    })
}

fn check_command(args: &CheckArgs) -> Result<ExitCode> {
    let reports = check::reports(&args.files, args.unit);
    if args.json {
        print(as_json(&reports)?)?;
    } else {
        for report in &reports {
            print(report.to_string())?;
        }
    }
    let good = reports.iter().all(taut_scene::FileReport::is_good);
    Ok(if good {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(EXIT_BAD_INPUT)
    })
}

fn doctor_command(args: &DoctorArgs) -> Result<ExitCode> {
    if let Some(device) = &args.device {
        let report = doctor::device::examine(device, args.out.as_deref())?;
        return tell(&report, args.json);
    }
    let report = doctor::examine().context("this machine cannot be examined")?;
    tell(&report, args.json)
}

fn as_json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(value).context("the report cannot be written as JSON")
}

/// Prints the result of a command that holds no session: its success.
fn print(text: impl Into<String>) -> Result<ExitCode> {
    console::print(text).context("standard output cannot be written; check the free space")?;
    Ok(ExitCode::SUCCESS)
}
