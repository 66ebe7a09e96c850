//! The render node as a sub-command: whether and with what this build can draw (feature `render`).

use crate::commands::arguments::RenderArgs;

/// Whether this build can draw.
pub(crate) const BUILT_IN: bool = cfg!(feature = "render");

/// Keeps graphics drivers from complaining, before a command that looks for one: [`taut_render::restart_with_runtime_directory`].
#[cfg(feature = "render")]
pub(crate) use taut_render::restart_with_runtime_directory;

/// Nothing to do in a build that cannot draw.
#[cfg(not(feature = "render"))]
pub(crate) fn restart_with_runtime_directory() {}

/// What a build that cannot draw says.
#[cfg(not(feature = "render"))]
pub(crate) const NOT_BUILT_IN: &str =
    "this program was built without drawing: build it with `--features render`";

/// Draws one node of the workbench until the session ends.
#[cfg(feature = "render")]
pub(crate) fn run(args: RenderArgs) -> Result<(), crate::shared::failure::Failure> {
    use crate::shared::failure::{EXIT_BAD_INPUT, Failure};
    match taut_render::run(args) {
        Ok(report) => {
            let is_written = taut_bridge::console::report(report.to_string());
            is_written
                .then_some(())
                .ok_or_else(|| Failure::failed("the report was not written"))
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

/// What this machine draws with and whether that is software, or why it does not draw; `None` in a build that cannot draw.
#[cfg(feature = "render")]
pub(crate) fn adapter() -> Option<Result<(String, bool), String>> {
    let gpu = taut_render::renderer::Gpu::open();
    Some(
        gpu.map(|gpu| (gpu.chosen().to_string(), gpu.is_software()))
            .map_err(|error| error.to_string()),
    )
}

/// What this machine draws with and whether that is software, or why it does not draw; `None` in a build that cannot draw.
#[cfg(not(feature = "render"))]
pub(crate) fn adapter() -> Option<Result<(String, bool), String>> {
    None
}
