//! `taut preview` in a build that cannot draw.

use crate::cli::PreviewArgs;
use crate::shared::failure::Failure;

/// Says that this build cannot draw.
pub(super) fn run(_args: &PreviewArgs) -> Result<Vec<String>, Failure> {
    Err(Failure::bad_input(super::render::NOT_BUILT_IN))
}

/// The same, where a picture would only be added.
pub(super) fn beside(_scene: &str) -> Result<String, String> {
    Err(super::render::NOT_BUILT_IN.to_owned())
}
