//! `taut calibrate` in a build that cannot draw.

use crate::cli::CalibrateArgs;
use crate::shared::failure::Failure;

/// Says that this build cannot draw.
pub(super) fn run(_args: &CalibrateArgs) -> Result<Vec<String>, Failure> {
    Err(Failure::bad_input(super::render::NOT_BUILT_IN))
}
