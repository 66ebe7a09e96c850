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

use crate::cli::{
    ArmArgs, CheckArgs, Cli, Command, DoctorArgs, ExportArgs, FIRST_STEPS, ImportArgs, KeysArgs,
    PushWrenchArgs, RecordArgs, ReplayArgs, TrackArgs,
};
use crate::report::terminal::Terminal;
use crate::report::{ReplayReport, SessionReport};
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
        None => print(FIRST_STEPS).map(|()| ExitCode::SUCCESS),
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
    let terminal = Terminal::standard_error();
    match command {
        Command::Demo(args) => end_session(demo::run(&args, &terminal)?, args.json, args.histogram),
        Command::Serve(args) => {
            end_session(serve::run(&args, &terminal)?, args.json, args.histogram)
        }
        Command::Render(args) => {
            render::run(args)?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Bridge(args) => Ok(taut_bridge::execute(&args)),
        Command::SimulateDevice(args) => Ok(taut_bridge::execute_simulation(&args)),
        Command::Replay(args) => replay_command(&args),
        Command::Record(args) => record_command(&args),
        Command::Export(args) => export_command(&args),
        Command::Arm(args) => arm_command(&args),
        Command::Edit(args) => print(edit::run(&args)?).map(|()| ExitCode::SUCCESS),
        Command::Check(args) => check_command(&args),
        Command::Import(args) => import_command(&args),
        Command::Preview(args) => {
            print(preview::run(&args)?.join("\n")).map(|()| ExitCode::SUCCESS)
        }
        Command::Calibrate(args) => match calibrate::run(&args)? {
            written if written.is_empty() => Ok(ExitCode::SUCCESS),
            written => print(written.join("\n")).map(|()| ExitCode::SUCCESS),
        },
        Command::Doctor(args) => doctor_command(&args),
        Command::Track(args) => track_command(&args),
        Command::PushWrench(args) => push_wrench_command(&args),
        Command::Keys(args) => keys_command(&args),
        Command::Setup(args) => {
            let done = setup::run(&args, std::io::stdin().lock(), std::io::stdout().lock())?;
            print(done).map(|()| ExitCode::SUCCESS)
        }
        Command::Deploy(args) => print(deploy::run(&args)?).map(|()| ExitCode::SUCCESS),
        Command::Completions(args) => {
            print(manual::completions(args.shell)?).map(|()| ExitCode::SUCCESS)
        }
        Command::Man(args) => print(manual::write_pages(&args.out)?).map(|()| ExitCode::SUCCESS),
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
fn tell<R: Serialize + Display>(report: &R, json: bool) -> Result<()> {
    if json {
        print_json(report)
    } else {
        print(report.to_string())
    }
}

/// The runtime of a command that only speaks over the network.
fn network(threads: usize) -> Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(threads)
        .enable_all()
        .build()
        .context("the network's threads cannot be started")
}

fn replay_command(args: &ReplayArgs) -> Result<ExitCode> {
    if let Some(directory) = &args.recording {
        return recorded_command(directory, args);
    }
    let report: ReplayReport = replay::run(args)?;
    tell(&report, args.json)?;
    Ok(ExitCode::SUCCESS)
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

fn record_command(args: &RecordArgs) -> Result<ExitCode> {
    let runtime = network(2)?;
    let (out, rows) = runtime.block_on(record::run(args))?;
    print(format!("{}: {rows} samples", out.display()))?;
    Ok(ExitCode::SUCCESS)
}

fn export_command(args: &ExportArgs) -> Result<ExitCode> {
    let report = export::run(args)?;
    tell(&report, args.json)?;
    Ok(ExitCode::SUCCESS)
}

fn arm_command(args: &ArmArgs) -> Result<ExitCode> {
    let runtime = network(1)?;
    print(runtime.block_on(arm::run(args))?)?;
    Ok(ExitCode::SUCCESS)
}

fn check_command(args: &CheckArgs) -> Result<ExitCode> {
    let reports = check::reports(&args.files);
    if args.json {
        print_json(&reports)?;
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

fn import_command(args: &ImportArgs) -> Result<ExitCode> {
    let report = import::run(args)?;
    tell(&report, args.json)?;
    Ok(ExitCode::SUCCESS)
}

fn doctor_command(args: &DoctorArgs) -> Result<ExitCode> {
    if let Some(device) = &args.device {
        let report = doctor::device::examine(device, args.out.as_deref())?;
        tell(&report, args.json)?;
        return Ok(ExitCode::SUCCESS);
    }
    let report = doctor::examine().context("this machine cannot be examined")?;
    tell(&report, args.json)?;
    Ok(ExitCode::SUCCESS)
}

fn keys_command(args: &KeysArgs) -> Result<ExitCode> {
    print(keys::run(args)?)?;
    Ok(ExitCode::SUCCESS)
}

fn track_command(args: &TrackArgs) -> Result<ExitCode> {
    let runtime = network(1)?;
    let sent = runtime.block_on(track::run(args))?;
    print(format!(
        "{sent} readings of the head sent to {}",
        args.server
    ))?;
    Ok(ExitCode::SUCCESS)
}

fn push_wrench_command(args: &PushWrenchArgs) -> Result<ExitCode> {
    let runtime = network(1)?;
    let sent = runtime.block_on(push_wrench::run(args))?;
    print(format!("{sent} wrenches sent to {}", args.server))?;
    Ok(ExitCode::SUCCESS)
}

fn print_json(value: &impl Serialize) -> Result<()> {
    print(as_json(value)?)
}

fn as_json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(value).context("the report cannot be written as JSON")
}

/// Prints the result of a command that holds no session.
fn print(text: impl Into<String>) -> Result<()> {
    console::print(text).context("standard output cannot be written; check the free space")
}
