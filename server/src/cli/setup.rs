//! The command lines of setting up: keys, workbench file, archives, completions, manual pages.

use std::path::PathBuf;

use clap::Args;

use super::values::output;

/// `taut keys`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  taut keys --out cluster.key\n  taut keys --master cluster.key --config workbench.toml --out keys\n  taut keys --master cluster.key --role render --node front --issue 2 --out front.key\n  taut keys --show front.key"
)]
pub struct KeysArgs {
    /// The file to make (default: cluster.key), a directory with --config; an existing file is never overwritten
    #[arg(long, value_name = "FILE|DIR", value_parser = output())]
    pub out: Option<PathBuf>,
    /// Make credentials from this cluster key
    #[arg(long, value_name = "FILE")]
    pub master: Option<PathBuf>,
    /// For every node of this workbench file, and one for each other role that it lets in
    #[arg(long, value_name = "F", requires = "master", conflicts_with = "role")]
    pub config: Option<PathBuf>,
    /// For one role: render, device, tracker, operator, observer, force
    #[arg(long, value_name = "ROLE", requires = "master")]
    pub role: Option<taut_link::Role>,
    /// For the node of this name only (default: *, any of the role)
    #[arg(long, value_name = "NAME", requires = "role")]
    pub node: Option<String>,
    /// Which issue: a later one stays good when an earlier one is revoked
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub issue: u16,
    /// Instead, say what this key file allows and its fingerprint
    #[arg(long, value_name = "FILE", conflicts_with_all = ["out", "master"])]
    pub show: Option<PathBuf>,
}

/// `taut setup`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  taut setup\n  taut setup --yes --out workbench.toml\n\nOne line answers one question; an empty one takes the default. Answers may come through a pipe."
)]
pub struct SetupArgs {
    /// The file to write; one that is there is refused
    #[arg(long, value_name = "FILE", default_value = "workbench.toml", value_parser = output())]
    pub out: PathBuf,
    /// Take every default, and ask nothing
    #[arg(long)]
    pub yes: bool,
}

/// `taut deploy`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Example: taut deploy workbench.toml --master cluster.key --out deploy\n\nThe machines are those of [[machine]] in the workbench file. The same files make the same archives; one that is there and differs is not replaced without --force."
)]
pub struct DeployArgs {
    /// The workbench file
    #[arg(value_name = "WORKBENCH.toml")]
    pub config: PathBuf,
    /// The folder of the archives, made if it is not there
    #[arg(long, value_name = "DIR", value_parser = output())]
    pub out: PathBuf,
    /// The cluster key (default: `key_file` of the workbench file)
    #[arg(long, value_name = "FILE")]
    pub master: Option<PathBuf>,
    /// Which issue of the credentials: a later one stays good when an earlier one is revoked
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub issue: u16,
    /// The server's service takes up an edited workbench or scene file while it runs (taut serve --follow-scene)
    #[arg(long)]
    pub follow_scene: bool,
    /// Replace archives that are there and differ
    #[arg(long)]
    pub force: bool,
}

/// `taut completions`.
#[derive(Clone, Copy, Debug, Args)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// `taut man`.
#[derive(Clone, Debug, Args)]
pub struct ManArgs {
    /// The directory; files of the same name are replaced
    #[arg(long, value_name = "DIR", value_parser = output())]
    pub out: PathBuf,
}
