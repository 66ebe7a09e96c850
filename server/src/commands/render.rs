//! The render node as a sub-command: whether and with what this build can draw (feature `render`).

use crate::commands::arguments::RenderArgs;

/// Whether this build can draw.
pub(crate) const BUILT_IN: bool = cfg!(feature = "render");

/// What a build that cannot draw says.
#[cfg(not(feature = "render"))]
pub(crate) const NOT_BUILT_IN: &str = "this program was built without drawing: build it with `--features render`";

/// Draws one node of the workbench until the session ends.
#[cfg(feature = "render")]
pub(crate) fn run(args: RenderArgs) -> Result<(), crate::shared::failure::Failure> {
    use crate::shared::failure::{EXIT_BAD_INPUT, Failure};
    match taut_render::run(args) {
        Ok(report) => {
            taut_bridge::console::report(report.to_string());
            Ok(())
        }
        Err(error) if error.exit_code() == EXIT_BAD_INPUT => Err(Failure::bad_input(error)),
        Err(error) => Err(Failure::failed(error)),
    }
}

/// Says that this build cannot draw.
#[cfg(not(feature = "render"))]
pub(crate) fn run(_args: RenderArgs) -> Result<(), crate::shared::failure::Failure> {
    Err(crate::shared::failure::Failure::BadInput(format!(
        "{NOT_BUILT_IN}, or use the program `taut-render`"
    )))
}

/// What this machine draws with, or why it does not; `None` in a build that cannot draw.
#[cfg(feature = "render")]
pub(crate) fn adapter() -> Option<Result<String, String>> {
    let gpu = taut_render::renderer::Gpu::open();
    Some(
        gpu.map(|gpu| {
            let slow = if gpu.is_software() {
                "; that is software, slow and good for tests: the screens of a workbench need a graphics card"
            } else {
                ""
            };
            format!("{}{slow}", gpu.chosen())
        })
        .map_err(|error| error.to_string()),
    )
}

/// What this machine draws with, or why it does not; `None` in a build that cannot draw.
#[cfg(not(feature = "render"))]
pub(crate) fn adapter() -> Option<Result<String, String>> {
    None
}

/// Graphics drivers complain on standard error, once for each way in which they look for a screen, where nobody has set a directory for
/// what a login session needs. Nothing is put there: this program executes itself again, in the same process, with one. Returns if there is no need, or
/// if that failed, which the log tells.
pub(super) fn restart_with_runtime_directory() {
    const DIRECTORY: &str = "XDG_RUNTIME_DIR";
    let is_set = std::env::var_os(DIRECTORY).is_some_and(|directory| !directory.is_empty());
    if is_set || !BUILT_IN {
        return;
    }
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt;

        let error = std::env::current_exe().map_or_else(
            |error| error,
            |program| {
                std::process::Command::new(program)
                    .args(std::env::args_os().skip(1))
                    .env(DIRECTORY, std::env::temp_dir())
                    .exec()
            },
        );
        tracing::warn!("graphics drivers may complain of {DIRECTORY} ({error})");
    }
}
