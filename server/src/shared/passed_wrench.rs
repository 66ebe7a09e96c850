//! Shared datum: the wrench from outside that a bridge is to add.
//!
//! Writer: the haptics loop, every tick. Reader: the broadcaster, which sends it. A stale value does no harm: it says when it was measured, and the bridge judges it by that.

use taut_bridge::JudgedWrench;

pub(crate) type PassedWriter = triple_buffer::Input<Option<JudgedWrench>>;
pub(crate) type PassedReader = triple_buffer::Output<Option<JudgedWrench>>;

/// Both ends; nothing is passed on yet.
#[must_use]
pub(crate) fn channel() -> (PassedWriter, PassedReader) {
    triple_buffer::triple_buffer(&None)
}
