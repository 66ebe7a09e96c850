//! The binary `taut`: one sub-command per role.

use std::process::ExitCode;

fn main() -> ExitCode {
    taut::commands::main()
}
