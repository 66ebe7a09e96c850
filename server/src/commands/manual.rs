//! `taut completions` and `taut man`: made from the command line itself, so that they say what it takes.

use std::path::Path;

use clap::CommandFactory;
use clap_complete::Shell;

use crate::cli::Cli;
use crate::shared::failure::Failure;

pub(super) fn completions(shell: Shell) -> Result<String, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "taut", &mut script);
    String::from_utf8(script).map_err(Failure::failed)
}

/// Writes `taut.1` and one page per command; a sentence on what was written.
pub(super) fn write_pages(directory: &Path) -> Result<String, Failure> {
    let cannot = |error: std::io::Error| {
        Failure::BadInput(format!(
            "{}: the manual pages cannot be written ({error}); name a directory that can be written",
            directory.display()
        ))
    };
    std::fs::create_dir_all(directory).map_err(cannot)?;
    clap_mangen::generate_to(Cli::command().disable_help_subcommand(true), directory)
        .map_err(cannot)?;
    Ok(format!("{}: manual pages written", directory.display()))
}
