//! The render node as a sub-command. The one place that knows whether this build can draw (feature `render`).

#[cfg(feature = "render")]
pub use taut_render::RenderArgs;

/// Whether this build can draw.
pub const BUILT_IN: bool = cfg!(feature = "render");

/// `taut render` of a build that cannot draw: takes any arguments and says so.
#[cfg(not(feature = "render"))]
#[derive(Clone, Debug, clap::Args)]
pub struct RenderArgs {
    /// Not looked at
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    pub rest: Vec<String>,
}

/// Draws one node of the workbench until the session ends.
#[cfg(feature = "render")]
pub fn run(args: RenderArgs) -> Result<(), crate::failure::Failure> {
    use crate::failure::{EXIT_BAD_INPUT, Failure};
    match taut_render::run(args) {
        Ok(report) => {
            println!("{report}");
            Ok(())
        }
        Err(error) if error.exit_code() == EXIT_BAD_INPUT => Err(Failure::bad_input(error)),
        Err(error) => Err(Failure::failed(error)),
    }
}

/// Says that this build cannot draw.
#[cfg(not(feature = "render"))]
pub fn run(_args: RenderArgs) -> Result<(), crate::failure::Failure> {
    Err(crate::failure::Failure::BadInput(
        "this program was built without drawing: build it with `--features render`, or use the program `taut-render`".into(),
    ))
}

/// What this machine draws with, or why it does not; `None` in a build that cannot draw.
#[cfg(feature = "render")]
pub fn adapter() -> Option<Result<String, String>> {
    let gpu = taut_render::renderer::Gpu::open();
    Some(
        gpu.map(|gpu| gpu.chosen())
            .map_err(|error| error.to_string()),
    )
}

/// What this machine draws with, or why it does not; `None` in a build that cannot draw.
#[cfg(not(feature = "render"))]
pub fn adapter() -> Option<Result<String, String>> {
    None
}
